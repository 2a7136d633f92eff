//! The surroundings: what they send to each vertex through the gaps that the objects leave, and what is mirrored of them.
//!
//! Rays in 256 directions say, once per rigid arrangement, where each vertex sees out; that is one bit per direction, 32
//! bytes a vertex, kept on disk. The light from the visible directions is then summed up on the device for whatever
//! normal a technique hands over, so that editing the sky, the material or the normals casts no ray. What deforms sees the
//! whole sky and hides none of it: `explain` says so.

mod harmonics;
mod lamps;
mod light;
mod mirror;

use super::{Frame, Item, tables, upload};
use crate::gpu::{Bind, Buffer, Compute, Sampler};
use crate::image::Texture;
use crate::problem::Problem;
use crate::scene::{LightKind, Sky, TextureMap};
use crate::store::{Key, Plan, Slot};
use glam::{DAffine3, DMat4, DVec3, Vec3};
use light::{DIRECTIONS, SkyCells, SkyLight, SkyVisibility};
use mirror::{SkyBlurred, SkyImage, UploadBlurred};
use std::f64::consts::PI;

/// What a pass that looks at the sky needs: flags and bindings of `frame/sky.wgsl`.
pub(super) struct SkyBinds {
    pub flags: Vec<&'static str>,
    pub binds: Vec<(&'static str, Bind)>,
}

/// The surroundings of a scene, planned.
pub(super) struct Surroundings {
    radiance: DVec3,
    rotation: f64,
    image: Option<Slot<Texture>>,
    /// Whether objects are in its way.
    shadow: bool,
}

/// The direction of a texel's centre; `shaders/frame/sky.wgsl` has the inverse.
fn sky_direction(x: u32, theta: f64, width: u32, rotation: f64) -> DVec3 {
    let phi = 2.0 * PI * ((x as f64 + 0.5) / width as f64 - 0.5) - rotation;
    DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
}

/// The texel in a direction.
fn sample(image: &Texture, d: DVec3, rotation: f64) -> DVec3 {
    let u = (0.5 + (d.x.atan2(-d.z) + rotation) / (2.0 * PI)).rem_euclid(1.0);
    let v = d.y.clamp(-1.0, 1.0).acos() / PI;
    let x = ((u * image.width as f64) as u32).min(image.width - 1);
    let y = ((v * image.height as f64) as u32).min(image.height - 1);
    let [r, g, b, _] = image.texels[(y * image.width + x) as usize];
    Vec3::new(r, g, b).as_dvec3()
}

fn texture_slot(plan: &mut Plan, map: &TextureMap) -> Slot<Texture> {
    plan.given("image.file", map.path.display().to_string(), Key::of(map), map.texture.clone())
}

impl Frame<'_> {
    /// The surroundings that are switched on and not black.
    pub(super) fn surroundings(&self, plan: &mut Plan) -> Option<Surroundings> {
        self.scene.lights.iter().filter(|light| light.enabled).find_map(|light| {
            let LightKind::Environment { sky, scale, rotation_deg } = &light.kind else { return None };
            let (radiance, image) = match sky {
                Sky::Constant(radiance) => (*radiance, None),
                Sky::Image(map) => (DVec3::ONE, Some(texture_slot(plan, map))),
            };
            (radiance * *scale != DVec3::ZERO || !self.view.skip).then(|| Surroundings {
                radiance: radiance * *scale,
                rotation: rotation_deg.to_radians(),
                image,
                shadow: light.shadow,
            })
        })
    }

    fn is_rigid(&self, item: &Item) -> bool {
        self.object(item).is_none_or(|object| object.deform.is_empty())
    }

    /// One bit per vertex and direction, or none where the sky counts as open.
    fn sky_visibility(&self, plan: &mut Plan, item: &Item, surroundings: &Surroundings) -> Option<Slot<Buffer>> {
        if !surroundings.shadow {
            plan.skip("shadows of the surroundings", "shadow: false");
            return None;
        }
        if !self.is_rigid(item) {
            plan.skip(
                format!("where `{}` sees the sky", item.name),
                "it deforms: it sees the whole sky, and hides none of it from others",
            );
            return None;
        }
        // Seen from the item's own place: vertices are f32, and far from the origin they would fall into one another.
        let here = DAffine3::from_translation(-item.world_from_object.translation);
        let occluders = self
            .items
            .iter()
            .filter(|other| self.is_rigid(other))
            .map(|other| (other.mesh, here * other.world_from_object))
            .collect();
        let words = plan.bake(SkyVisibility { mesh: item.mesh, turned: here * item.world_from_object, occluders });
        Some(upload::list(plan, words, "visible directions"))
    }

    fn sky_light(&self, plan: &mut Plan, surroundings: &Surroundings) -> Slot<Buffer> {
        let cells = self.sky_cells(plan, surroundings);
        plan.add(SkyLight { radiance: surroundings.radiance, cells })
    }

    /// The mean radiance of an image around each direction; none where the sky is even.
    fn sky_cells(&self, plan: &mut Plan, surroundings: &Surroundings) -> Option<Slot<Vec<Vec3>>> {
        surroundings.image.map(|image| plan.bake(SkyCells { image, rotation: surroundings.rotation }))
    }

    /// The irradiance that enters at each vertex from the surroundings, for a normal each; 16 bytes a vertex.
    pub(super) fn sky_irradiance(
        &self,
        plan: &mut Plan,
        item: &Item,
        normals: Slot<Buffer>,
    ) -> Result<Option<Slot<Buffer>>, Problem> {
        let Some(surroundings) = self.surroundings(plan) else { return Ok(None) };
        let eta = self.material(item).map_or(1.0, |material| material.surface.ior);
        let rotation = DAffine3 { translation: DVec3::ZERO, ..item.world_from_object };
        let vertices = tables::Vertices {
            world_from_object: DMat4::from(rotation).as_mat4(),
            eta: eta as f32,
            words: (DIRECTIONS / 32) as u32,
        };
        let visible = self.sky_visibility(plan, item, &surroundings);
        let mut binds = vec![
            ("vertices", Bind::uniform(&vertices)),
            ("normals", Bind::Buffer(normals)),
            ("directions", Bind::Buffer(self.sky_light(plan, &surroundings))),
        ];
        let mut flags = Vec::new();
        if let Some(visible) = visible {
            flags.push("OCCLUDED");
            binds.push(("visible", Bind::Buffer(visible)));
        }
        Ok(Some(plan.add(Compute {
            name: "frame.environment",
            about: format!("what the surroundings send into each vertex of `{}`", item.name),
            shader: self.shaders.load("frame/environment.wgsl", &flags)?,
            output: ("irradiance", 16),
            over: normals,
            over_stride: 12,
            binds,
        })))
    }

    /// How open the sky is from each vertex, for reflections; none where it counts as open.
    pub(super) fn openness(&self, plan: &mut Plan, item: &Item) -> Result<Option<Slot<Buffer>>, Problem> {
        let Some(surroundings) = self.surroundings(plan) else { return Ok(None) };
        let Some(visible) = self.sky_visibility(plan, item, &surroundings) else { return Ok(None) };
        let over = upload::stream(plan, item.mesh, upload::Stream::Positions);
        let light = self.sky_light(plan, &surroundings);
        Ok(Some(plan.add(Compute {
            name: "frame.openness",
            about: format!("how open the sky is from each vertex of `{}`", item.name),
            shader: self.shaders.load("frame/openness.wgsl", &[])?,
            output: ("openness", 16),
            over,
            over_stride: 12,
            binds: vec![("directions", Bind::Buffer(light)), ("visible", Bind::Buffer(visible))],
        })))
    }

    /// For passes that look at the sky (`blurred`: as rough things mirror it).
    pub(super) fn sky_binds(&self, plan: &mut Plan, blurred: bool) -> Option<SkyBinds> {
        let surroundings = self.surroundings(plan)?;
        let sky = tables::Sky { radiance: surroundings.radiance.as_vec3(), rotation: surroundings.rotation as f32 };
        let mut flags = vec!["ENVIRONMENT"];
        let mut binds = vec![("sky", Bind::uniform(&sky))];
        if let Some(image) = surroundings.image {
            flags.push("SKY_IMAGE");
            binds.push(("sky_image", Bind::Texture(plan.add(SkyImage { image }), 0)));
            binds.push(("around", Bind::Sampler(Sampler::LinearAround)));
            if blurred {
                let texels = plan.bake(SkyBlurred { image });
                flags.push("SKY_BLURRED");
                binds.push(("sky_blurred", Bind::Texture(plan.add(UploadBlurred { texels }), 0)));
            }
        }
        Some(SkyBinds { flags, binds })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_finds_the_texel_that_it_came_from() {
        let (width, height) = (16, 8);
        let texels = (0..width * height).map(|i| [i as f32, 0.0, 0.0, 1.0]).collect();
        let image = Texture { width, height, texels };
        for y in 0..height {
            let theta = PI * (y as f64 + 0.5) / height as f64;
            for x in 0..width {
                for rotation in [0.0, 1.0, -2.5] {
                    let d = sky_direction(x, theta, width, rotation);
                    assert_eq!(sample(&image, d, rotation).x as u32, y * width + x);
                }
            }
        }
    }
}
