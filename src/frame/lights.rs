//! Lights as the shaders see them, their shadow maps, and how much of each light every pixel sees.
//!
//! A light is one sample, an area light a grid of 4 x 4. A sample that sees everything that casts a shadow within one
//! frustum has one shadow map, fitted to it; one that stands among the casters has the six faces of a cube. Nothing is
//! tuned per scene: offsets follow from the size of a texel.

use super::upload::{self, Stream};
use super::{Frame, Item, PACKED, POSITION, Thing, tables};
use crate::gpu::{Bind, Cover, Depth, Draw, Format, Images, Layer, Raster, Sampler};
use crate::problem::{Problem, counted};
use crate::scene::{Light, LightKind};
use crate::store::{Plan, Slot};
use glam::{DAffine3, DMat4, DVec3, DVec4};

const DIRECTIONAL: u32 = 0;
const POINT: u32 = 1;
const RECT: u32 = 2;

/// Texels along a side of a shadow map.
const DIRECTIONAL_SIZE: u32 = 2048;
const POINT_SIZE: u32 = 1024;
/// Each of an area light's 16; the filter between them is the light itself.
const RECT_SIZE: u32 = 512;

/// A view from a light. World space.
pub(super) struct LightView {
    pub clip_from_world: DMat4,
    /// The width of a texel: in the world for a directional light, else at unit depth.
    pub texel: f64,
}

/// The views of one light.
pub(super) struct LightViews {
    pub views: Vec<LightView>,
    pub per_sample: u32,
    pub size: u32,
}

impl Frame<'_> {
    /// The lights that shine on surfaces from a place or direction, with their places in the scene.
    pub(super) fn lamps(&self) -> Vec<(usize, &Light)> {
        let shines = |light: &Light| {
            light.enabled
                && match light.kind {
                    LightKind::Directional { irradiance, .. } => irradiance != DVec3::ZERO || !self.view.skip,
                    LightKind::Point { intensity, .. } => intensity != DVec3::ZERO || !self.view.skip,
                    LightKind::Rect { radiance, .. } => radiance != DVec3::ZERO || !self.view.skip,
                    LightKind::Environment { .. } => false,
                }
        };
        self.scene.lights.iter().enumerate().filter(|(_, light)| shines(light)).collect()
    }

    pub(super) fn casts(light: &Light) -> bool {
        light.shadow
    }

    /// The table of lamps. A lamp that casts shadows names its layer of the visibility map.
    pub(crate) fn lights_bind(&self) -> Option<Bind> {
        let lamps = self.lamps();
        let mut layers = 0;
        let table: Vec<tables::Light> = lamps
            .iter()
            .map(|(_, light)| {
                let visibility = if Self::casts(light) {
                    layers += 1;
                    layers - 1
                } else {
                    -1
                };
                self.row_of(light, visibility)
            })
            .collect();
        (!table.is_empty()).then(|| Bind::list(&table))
    }

    fn row_of(&self, light: &Light, visibility: i32) -> tables::Light {
        row_in(light, visibility, &DAffine3::from_translation(-self.view.camera.eye))
    }

    /// How much of each lamp that casts shadows every pixel sees: an array of layers. None when no lamp does.
    pub(crate) fn visibility(&self, plan: &mut Plan, gbuffer: Slot<Images>) -> Result<Option<Slot<Images>>, Problem> {
        if let Some(planned) = self.visibility.get() {
            return Ok(*planned);
        }
        let planned = self.plan_visibility(plan, gbuffer)?;
        Ok(*self.visibility.get_or_init(|| planned))
    }

    fn plan_visibility(&self, plan: &mut Plan, gbuffer: Slot<Images>) -> Result<Option<Slot<Images>>, Problem> {
        let lamps = self.lamps();
        let Some(lights) = self.lights_bind() else { return Ok(None) };
        let mut layers = Vec::new();
        for (place, (i, light)) in lamps.iter().enumerate() {
            if !Self::casts(light) {
                plan.skip(format!("shadows of the light `{}`", light.name), "shadow: false");
                continue;
            }
            let views = self.views(light);
            let shadow_map = self.shadow_map(plan, *i, light, &views, None)?;
            let eye = DMat4::from_translation(self.view.camera.eye);
            let table: Vec<tables::ShadowView> = views
                .views
                .iter()
                .map(|view| tables::ShadowView {
                    clip_from_eye: (view.clip_from_world * eye).as_mat4(),
                    texel: view.texel as f32,
                    is_directional: matches!(light.kind, LightKind::Directional { .. }) as u32,
                })
                .collect();
            let which = tables::Views { light: place as u32, per_sample: views.per_sample };
            layers.push(Layer {
                binds: vec![
                    ("views", Bind::uniform(&which)),
                    ("shadow_views", Bind::list(&table)),
                    ("shadow_map", Bind::Texture(shadow_map, 0)),
                ],
                cover: Cover::Pixels,
            });
        }
        if layers.is_empty() {
            return Ok(None);
        }
        Ok(Some(plan.add(Raster {
            name: "frame.visibility",
            about: format!("how much of {} each pixel sees", counted(layers.len(), "light")),
            shader: self.shaders.load("frame/visibility.wgsl", &[])?,
            size: self.view.sampled_size(),
            targets: vec![(Format::R16Float, crate::gpu::Blend::Replace)],
            depth: Depth::Off,
            layers,
            array: true,
            binds: vec![
                ("objects", self.objects_bind()),
                ("position_map", Bind::Texture(gbuffer, POSITION)),
                ("packed_map", Bind::Texture(gbuffer, PACKED)),
                ("lights", lights),
                ("compare", Bind::Sampler(Sampler::Shadow)),
            ],
        })))
    }

    /// Depth from each of the light's views. Everything visible casts, in view of the camera or not, but for the light
    /// itself and the item `but`.
    pub(super) fn shadow_map(
        &self,
        plan: &mut Plan,
        place: usize,
        light: &Light,
        views: &LightViews,
        but: Option<&Item>,
    ) -> Result<Slot<Images>, Problem> {
        // Planned once: an area light has up to 96 views of them.
        let casters: Vec<(&Item, Draw)> = self
            .casters(place)
            .filter(|item| but.is_none_or(|but| !std::ptr::eq(*item, but)))
            .map(|item| {
                let streams = vec![upload::stream(plan, item.mesh, Stream::Positions)];
                (item, Draw { streams, indices: upload::stream(plan, item.mesh, Stream::Indices), instance: 0 })
            })
            .collect();
        let mut layers = Vec::new();
        for view in &views.views {
            let mut draws = Vec::new();
            let mut table = Vec::new();
            for (item, draw) in &casters {
                let clip_from_object = view.clip_from_world * DMat4::from(item.world_from_object);
                if self.view.skip && is_outside(&item.corners, &view.clip_from_world) {
                    continue;
                }
                draws.push(Draw { instance: table.len() as u32, ..draw.clone() });
                table.push(tables::Caster { clip_from_object: clip_from_object.as_mat4() });
            }
            // An empty list cannot be bound; a view without casters draws nothing from a list of one.
            if table.is_empty() {
                table.push(tables::Caster { clip_from_object: glam::Mat4::IDENTITY });
            }
            layers.push(Layer { binds: vec![("casters", Bind::list(&table))], cover: Cover::Meshes(draws) });
        }
        Ok(plan.add(Raster {
            name: "frame.shadow",
            about: format!("depth from `{}`, {}", light.name, counted(layers.len(), "view")),
            shader: self.shaders.load("frame/shadow.wgsl", &[])?,
            size: (views.size, views.size),
            targets: Vec::new(),
            depth: Depth::Write,
            layers,
            array: true,
            binds: Vec::new(),
        }))
    }

    pub(super) fn casters(&self, light: usize) -> impl Iterator<Item = &Item> {
        self.items.iter().filter(move |item| item.thing != Thing::Light(light))
    }

    pub(super) fn views(&self, light: &Light) -> LightViews {
        let place = self.scene.lights.iter().position(|other| std::ptr::eq(other, light)).unwrap_or(usize::MAX);
        let corners: Vec<DVec3> = self.casters(place).flat_map(|item| item.corners).collect();
        LightViews::of(light, &corners)
    }
}

impl LightViews {
    /// Those of a light that see all of the corners.
    pub fn of(light: &Light, corners: &[DVec3]) -> LightViews {
        match light.kind {
            LightKind::Directional { direction, .. } => LightViews {
                views: vec![directional_view(direction, corners, DIRECTIONAL_SIZE)],
                per_sample: 1,
                size: DIRECTIONAL_SIZE,
            },
            LightKind::Point { position, .. } => views_from(&[position], corners, POINT_SIZE),
            LightKind::Rect { center, u, v, .. } => {
                let samples: Vec<DVec3> = (0..16)
                    .map(|i| {
                        let at = |k: usize| (k as f64 - 1.5) * 0.5;
                        center + at(i & 3) * u + at(i >> 2) * v
                    })
                    .collect();
                views_from(&samples, corners, RECT_SIZE)
            }
            LightKind::Environment { .. } => unreachable!("the surroundings are no lamp"),
        }
    }
}

/// A lamp's row, in another space than the world.
pub(super) fn row_in(light: &Light, visibility: i32, from_world: &DAffine3) -> tables::Light {
    let (place, way) = (|p| from_world.transform_point3(p), |d| from_world.transform_vector3(d));
    let (kind, position, power, u, v) = match light.kind {
        LightKind::Directional { direction, irradiance } => {
            (DIRECTIONAL, way(-direction), irradiance, DVec3::ZERO, DVec3::ZERO)
        }
        LightKind::Point { position, intensity } => (POINT, place(position), intensity, DVec3::ZERO, DVec3::ZERO),
        LightKind::Rect { center, u, v, radiance } => (RECT, place(center), radiance, way(u), way(v)),
        LightKind::Environment { .. } => unreachable!("the surroundings are no lamp"),
    };
    tables::Light {
        position: position.as_vec3(),
        kind,
        power: power.as_vec3(),
        visibility,
        u: u.as_vec3(),
        v: v.as_vec3(),
    }
}

/// Whether a box lies wholly outside a view.
pub(super) fn is_outside(corners: &[DVec3; 8], clip_from_world: &DMat4) -> bool {
    let clip = corners.map(|p| *clip_from_world * p.extend(1.0));
    let out = |beyond: fn(&DVec4) -> bool| clip.iter().all(beyond);
    out(|p| p.x < -p.w) || out(|p| p.x > p.w) || out(|p| p.y < -p.w) || out(|p| p.y > p.w) || out(|p| p.w < 0.0)
}

/// A rotation that turns `forward` into -z.
fn look_along(forward: DVec3) -> DMat4 {
    let forward = forward.normalize();
    let right = forward.any_orthonormal_vector();
    let up = right.cross(forward);
    DMat4::from_mat3(glam::DMat3::from_cols(right, up, -forward).transpose())
}

/// Parallel light: a box around all casters, depth 1 at the side of the light, 0 at the other.
fn directional_view(direction: DVec3, corners: &[DVec3], size: u32) -> LightView {
    let view = look_along(direction);
    let seen: Vec<DVec3> = corners.iter().map(|p| view.transform_point3(*p)).collect();
    let min = seen.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let max = seen.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let (min, max) = if seen.is_empty() { (DVec3::NEG_ONE, DVec3::ONE) } else { (min, max) };
    // A border for the filter, and depth that nothing touches the ends of.
    let extent = (max - min).max_element().max(f64::MIN_POSITIVE);
    let center = 0.5 * (min + max);
    let half = 0.5 * (max.x - min.x).max(max.y - min.y).max(1e-6 * extent) * (1.0 + 8.0 / size as f64);
    let (near, far) = (max.z + 1e-3 * extent, min.z - 1e-3 * extent);
    let project = DMat4::from_cols_array_2d(&[
        [1.0 / half, 0.0, 0.0, 0.0],
        [0.0, 1.0 / half, 0.0, 0.0],
        [0.0, 0.0, 1.0 / (near - far), 0.0],
        [-center.x / half, -center.y / half, -far / (near - far), 1.0],
    ]);
    LightView { clip_from_world: project * view, texel: 2.0 * half / size as f64 }
}

/// Views from points: one frustum each if it holds all casters, else six faces of a cube.
fn views_from(samples: &[DVec3], corners: &[DVec3], size: u32) -> LightViews {
    let low = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let center = 0.5 * (low + high);
    let extent = (high - low).length();
    // The widest angle between the way to the centre and the way to a corner, over all samples; what is at the light
    // itself has no direction, and lies all around it.
    let widest = samples
        .iter()
        .flat_map(|s| corners.iter().map(move |c| (center - *s).angle_between(*c - *s)))
        .map(|angle| if angle.is_nan() { std::f64::consts::PI } else { angle })
        .fold(0.0, f64::max);
    // A frustum beyond this half angle wastes most of its texels on its rim.
    let fits = corners.is_empty() || widest < 60f64.to_radians();
    let near = |s: DVec3| {
        let nearest = corners.iter().map(|c| c.distance(s)).fold(f64::INFINITY, f64::min);
        // Inside the casters' bounds the nearest of them may be very near.
        if fits && nearest.is_finite() {
            (0.05 * nearest).max(1e-4 * extent)
        } else {
            1e-3 * extent.max(f64::MIN_POSITIVE)
        }
    };
    let perspective = |s: DVec3, view: DMat4, half_angle: f64| {
        let f = 1.0 / half_angle.tan();
        let project = DMat4::from_cols_array_2d(&[
            [f, 0.0, 0.0, 0.0],
            [0.0, f, 0.0, 0.0],
            [0.0, 0.0, 0.0, -1.0],
            [0.0, 0.0, near(s), 0.0],
        ]);
        LightView {
            clip_from_world: project * view * DMat4::from_translation(-s),
            texel: 2.0 * half_angle.tan() / size as f64,
        }
    };
    if fits {
        let half_angle = (widest * 1.02 + 0.002).min(65f64.to_radians());
        let towards = |s: DVec3| if corners.is_empty() { DVec3::NEG_Y } else { center - s };
        let views = samples.iter().map(|s| perspective(*s, look_along(towards(*s)), half_angle)).collect();
        return LightViews { views, per_sample: 1, size };
    }
    // A little wider than a face, so that the filter finds its neighbours there.
    let half_angle = (1.0 + 6.0 / size as f64).atan();
    let faces = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let views = samples.iter().flat_map(|s| faces.map(|face| perspective(*s, look_along(face), half_angle))).collect();
    LightViews { views, per_sample: 6, size }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ndc(view: &LightView, p: DVec3) -> DVec3 {
        let clip = view.clip_from_world * p.extend(1.0);
        clip.truncate() / clip.w
    }

    const CUBE: [DVec3; 4] =
        [DVec3::ZERO, DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.0, 1.0, 1.0), DVec3::new(1.0, 1.0, 1.0)];

    #[test]
    fn every_view_holds_its_casters_and_depth_is_reversed() {
        for scale in [1e-6, 1.0, 1e6] {
            let corners = CUBE.map(|p| p * scale);
            let down = directional_view(DVec3::new(0.3, -1.0, 0.2), &corners, 512);
            let lamp = &views_from(&[DVec3::new(0.5, 5.0, 0.5) * scale], &corners, 512).views[0];
            for p in corners {
                for view in [&down, lamp] {
                    let p = ndc(view, p);
                    assert!(p.x.abs() <= 1.0 && p.y.abs() <= 1.0 && (0.0..=1.0).contains(&p.z), "{p}");
                }
            }
            let (near, far) = (DVec3::new(0.5, 0.9, 0.5) * scale, DVec3::new(0.5, 0.1, 0.5) * scale);
            assert!(ndc(&down, near).z > ndc(&down, far).z && ndc(lamp, near).z > ndc(lamp, far).z);
        }
    }

    #[test]
    fn a_light_among_its_casters_has_the_faces_of_a_cube_in_the_order_of_the_shader() {
        let views = views_from(&[DVec3::splat(0.5)], &CUBE, 512);
        assert_eq!((views.per_sample, views.views.len()), (6, 6));
        for (view, d) in
            views.views.iter().zip([DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z])
        {
            let p = ndc(view, DVec3::splat(0.5) + d);
            assert!(p.x.abs() < 1e-9 && p.y.abs() < 1e-9 && p.z > 0.0);
        }
    }
}
