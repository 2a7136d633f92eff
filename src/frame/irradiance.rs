//! Light that enters at given points of a surface, for techniques that carry it elsewhere.
//!
//! One pass per lamp adds to what the passes before it found, and looks up the same shadow maps as pixels do; the
//! surroundings come first. Points that no light reaches cost nothing but the cosine.

use super::upload::{self, Stream};
use super::{Frame, tables};
use crate::geometry::mesh::Mesh;
use crate::gpu::{Bind, Buffer, Compute};
use crate::problem::Problem;
use crate::store::{Plan, Slot};

impl Frame<'_> {
    /// Transmitted irradiance at each vertex of `points`, which lie in the space of the item at `place`: 16 bytes each.
    pub(super) fn irradiance(
        &self,
        plan: &mut Plan,
        place: usize,
        points: Slot<Mesh>,
    ) -> Result<Slot<Buffer>, Problem> {
        let item = &self.items[place];
        let positions = upload::stream(plan, points, Stream::Positions);
        let normals = upload::stream(plan, points, Stream::Normals);
        let mut sum = self.sky_irradiance(plan, item, points, normals)?;
        let lights = self.lights_bind();
        let shadows = self.shadows(plan)?;
        let mut add = |sum: Option<Slot<Buffer>>, lamp: Option<(usize, &str)>| {
            let mut flags = Vec::new();
            let which = tables::Points { object: place as u32, light: lamp.map_or(0, |(lamp, _)| lamp as u32) };
            let mut binds = vec![
                ("points", Bind::uniform(&which)),
                ("objects", self.objects_bind()),
                ("positions", Bind::Buffer(positions)),
                ("normals", Bind::Buffer(normals)),
            ];
            if let (Some((lamp, _)), Some(lights)) = (lamp, &lights) {
                flags.push("LAMP");
                binds.push(("lights", lights.clone()));
                if let Some(shadow) = shadows.iter().find(|shadow| shadow.lamp == lamp) {
                    flags.push("SHADOWED");
                    binds.extend(shadow.binds.iter().cloned());
                }
            }
            if let Some(before) = sum {
                flags.push("ON_TOP");
                binds.push(("before", Bind::Buffer(before)));
            }
            Ok(plan.add(Compute {
                name: "frame.irradiance",
                about: match lamp {
                    Some((_, name)) => format!("what `{name}` sends into points of `{}`", item.name),
                    None => format!("no light at points of `{}`", item.name),
                },
                shader: self.shaders.load("frame/irradiance.wgsl", &flags)?,
                output: ("irradiance", 16),
                over: positions,
                over_stride: 12,
                binds,
            }))
        };
        for (lamp, (_, light)) in self.lamps().into_iter().enumerate() {
            sum = Some(add(sum, Some((lamp, &light.name)))?);
        }
        // Without any light there are zeros to be had.
        sum.map_or_else(|| add(None, None), Ok)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Surface, View};
    use crate::geometry::shapes;
    use crate::gpu::Gpu;
    use crate::image::Image;
    use crate::render::Look;
    use crate::session::{Options, Session};
    use crate::store::{Key, Watch};
    use glam::{DVec3, dvec3};
    use std::sync::Arc;

    struct Nobody;
    impl Watch for Nobody {}

    /// A plate of 8 x 8 at y = 0 that is looked down upon, and a roof beside it. Nothing is lost at its boundary.
    const PLATE: &str = r#"mm_per_unit: 10, camera: (eye: (0, 20, 0), target: (0, 0, 0), up: (0, 0, -1), fov_y_deg: 24),
        view: (technique: Opaque(), size: (64, 64), antialias: 1), objects: [
        (name: "plate", mesh: Slab(size: (8, 8, 1), segments: (16, 16)), material: "wax.ron",
         transform: (translate: (0, -0.5, 0), rotate_deg: (-90, 0, 0))),
        (name: "roof", mesh: Box(size: (2, 0.2, 8)), material: "wax.ron", transform: (translate: (7, 4, 0)))]"#;
    const WAX: &str = "Material(version: 1, medium: AlbedoMfp(albedo: 0.9, mfp: 1, g: 0), surface: (ior: 1))";

    struct Studio {
        folder: tempfile::TempDir,
        session: Session,
    }

    impl Studio {
        fn new() -> Studio {
            let folder = tempfile::tempdir().unwrap();
            std::fs::write(folder.path().join("wax.ron"), WAX).unwrap();
            Studio { folder, session: Session::new(Options { no_cache: true, ..Options::default() }) }
        }

        /// What enters at each vertex of the plate, with its place, and the picture of light that leaves where it entered.
        fn plate(&mut self, lights: &str) -> (Vec<(DVec3, DVec3)>, Arc<Image>, f64) {
            self.plate_at(lights, None)
        }

        /// The same at points that are not its vertices.
        fn plate_at(&mut self, lights: &str, points: Option<Mesh>) -> (Vec<(DVec3, DVec3)>, Arc<Image>, f64) {
            let path = self.folder.path().join("scene.ron");
            std::fs::write(&path, format!("Scene(version: 1, {PLATE}, lights: [{lights}])")).unwrap();
            let (scene, _) = self.session.scene(&path).unwrap_or_else(|p| panic!("{p}"));
            let look = Look::of(&scene);
            let view = View { part: crate::scene::Part::Scattered, ..look.view.clone() };
            let (_, picture) = self.session.render(&scene, &Look { view: view.clone(), ..look }, &Nobody).unwrap();
            let mut plan = Plan::default();
            let shaders = crate::gpu::Shaders::new(None, Arc::default());
            let frame = Frame::new(&scene, &view, &shaders, &mut plan);
            let surface = Surface { frame: &frame, items: vec![0], gbuffer: frame.gbuffer(&mut plan).unwrap() };
            let member = surface.members().next().unwrap();
            let points = match points {
                Some(points) => plan.given("test.points", "points", Key::of(&points), Arc::new(points)),
                None => member.mesh,
            };
            let slot = surface.irradiance(&mut plan, &member, points).unwrap();
            let mesh = self.session.get(&plan, points, &Nobody).unwrap();
            let found = self.session.get(&plan, slot, &Nobody).unwrap_or_else(|p| panic!("{p}"));
            let mut values = vec![DVec3::ZERO; mesh.positions.len()];
            let gpu: &Gpu = self.session.gpu().unwrap();
            found
                .floats(gpu, |point, channel, value| {
                    if channel < 3 {
                        values[point][channel] = value as f64;
                    }
                })
                .unwrap();
            let place = |p: &glam::Vec3| frame.items[0].world_from_object.transform_point3(p.as_dvec3());
            let at = mesh.positions.iter().map(place).zip(values).collect();
            (at, picture, member.material.albedo.x)
        }
    }

    const SUN: &str = "Directional(direction: (-1, -1, 0), irradiance: (3, 2, 1))";
    const LAMP: &str = "Point(position: (-2, 3, 1), intensity: (9, 9, 0))";
    const SOFTBOX: &str = "Rect(center: (0, 9, -3), u: (1, 0, 0), v: (0, 0, 1), radiance: 5)";
    const SKY: &str = "Environment(radiance: (1, 2, 3))";

    /// Between the centres of the four pixels around a place on the plate. The picture's half is 20 tan 12 degrees wide.
    fn shown(picture: &Image, p: DVec3) -> DVec3 {
        let at = dvec3(p.x, p.z, 0.0) * 32.0 / (20.0 * 12f64.to_radians().tan()) + 31.5;
        let (low, share) = (at.floor(), at - at.floor());
        let pixel = |x: f64, y: f64| DVec3::from(picture.at(x as u32, y as u32).map(f64::from));
        let row = |y: f64| pixel(low.x, y).lerp(pixel(low.x + 1.0, y), share.x);
        row(low.y).lerp(row(low.y + 1.0), share.y)
    }

    #[test]
    fn what_enters_at_a_point_is_what_a_pixel_there_shows() {
        let mut studio = Studio::new();
        for lights in [SUN, LAMP, SOFTBOX, SKY, "Directional(direction: (0, 1, 0.1), irradiance: 3)", ""] {
            let (points, picture, albedo) = studio.plate(lights);
            let upper = points.iter().filter(|(p, _)| p.y > -1e-3 && p.x.abs() < 3.9 && p.z.abs() < 3.9);
            let (mut seen, mut apart) = (0, 0);
            for (p, found) in upper {
                let shown = shown(&picture, *p) * std::f64::consts::PI / albedo;
                seen += 1;
                apart += ((*found - shown).abs().max_element() > 0.01 * found.max_element() + 1e-6) as u32;
            }
            assert!(seen > 200 && apart <= seen / 12, "{lights}: {apart} of {seen} points differ");
        }
        let (points, ..) = studio.plate(SUN);
        let at = |x: f64, z: f64| points.iter().find(|(p, _)| p.distance(dvec3(x, 0.0, z)) < 1e-3).unwrap().1;
        assert!(at(-1.0, 0.0).distance(dvec3(3.0, 2.0, 1.0) * 0.5f64.sqrt()) < 1e-4, "{}", at(-1.0, 0.0));
        // The roof's shadow falls four units beside it.
        assert_eq!(at(3.0, 0.0), DVec3::ZERO);
    }

    #[test]
    fn light_adds_up_and_other_points_are_as_good() {
        let mut studio = Studio::new();
        // No area light: it would stand in the others' way.
        let lights = [SUN, LAMP, SKY];
        let all = studio.plate(&lights.join(", ")).0;
        let each = lights.map(|light| studio.plate(light).0);
        for (i, (p, sum)) in all.iter().enumerate() {
            let parts: DVec3 = each.iter().map(|points| points[i].1).sum();
            assert!(sum.distance(parts) < 1e-5 * (1.0 + sum.length()), "{p}: {sum} {parts}");
        }
        let total = |points: &[(DVec3, DVec3)]| points.iter().map(|(_, e)| e.x).sum::<f64>();
        assert!(each.iter().all(|one| total(one) < 0.9 * total(&all)));
        let lights = [LAMP, SKY].join(", ");
        let own = studio.plate(&lights).0;
        let other = studio.plate_at(&lights, Some(shapes::slab(dvec3(8.0, 8.0, 1.0), (8, 8)))).0;
        let same = |p: &DVec3| own.iter().filter(|(q, _)| q.distance(*p) < 1e-4).map(|(_, e)| *e).collect::<Vec<_>>();
        for (p, found) in &other {
            // Edges of the plate have a vertex for each side.
            assert!(same(p).iter().any(|e| e.distance(*found) < 1e-4 * (1.0 + e.length())), "{p}: {found}");
        }
    }
}
