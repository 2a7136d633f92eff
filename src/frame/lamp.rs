//! Lamps as one thing sees them: in its own space, and past itself.
//!
//! Where light goes through a thing, the thing is not in its way; others are. Nothing here depends on the eye, so that what
//! is computed for one picture serves while the camera moves.

use super::lights::{LightViews, row_in};
use super::{Member, Surface, tables};
use crate::gpu::{Bind, Sampler};
use crate::problem::Problem;
use crate::scene::{Light, LightKind};
use crate::store::Plan;
use glam::{DAffine3, DMat4, DVec3, Mat4};

/// A lamp, in the space of one object.
pub struct Lamp<'a> {
    light: &'a Light,
    /// Among the scene's lights.
    place: usize,
    pub name: &'a str,
    /// A `Light` of `frame/lights.wgsl`; its `visibility` is its layer in [`Surface::visibility`].
    pub bind: Bind,
    /// The cosine between the ways from the object's middle to the lamp and to the eye: above 0 the lamp stands in front.
    pub in_front: f64,
}

/// Views that see all of an object from a lamp: one for each of its samples, or six faces of a cube for each.
pub struct LampViews {
    /// From the object's space to clip space with reversed depth; and the width of a texel, scene units: of parallel light,
    /// else at unit depth.
    pub views: Vec<(Mat4, f64)>,
    pub per_sample: u32,
    /// Of a map, texels.
    pub size: u32,
}

impl Lamp<'_> {
    /// Whether things are in its way.
    pub fn casts(&self) -> bool {
        super::Frame::casts(self.light)
    }
}

impl<'a> Surface<'a> {
    /// All lamps, as a member sees them.
    pub fn lamps(&self, member: &Member) -> Vec<Lamp<'a>> {
        let (item, frame) = (self.item(member), self.frame);
        let object_from_world = item.world_from_object.inverse();
        let (middle, _) = item.ball();
        let to_eye = (frame.view.camera.eye - middle).normalize_or_zero();
        let mut layers = 0;
        let lamp = |(place, light): (usize, &'a Light)| {
            let layer = if super::Frame::casts(light) { layers } else { -1 };
            layers += i32::from(layer >= 0);
            let to_lamp = match light.kind {
                LightKind::Directional { direction, .. } => -direction,
                LightKind::Point { position, .. } => (position - middle).normalize_or_zero(),
                LightKind::Rect { center, .. } => (center - middle).normalize_or_zero(),
                LightKind::Environment { .. } => unreachable!("the surroundings are no lamp"),
            };
            Lamp {
                light,
                place,
                name: &light.name,
                bind: Bind::uniform(&row_in(light, layer, &object_from_world)),
                in_front: to_lamp.dot(to_eye),
            }
        };
        frame.lamps().into_iter().map(lamp).collect()
    }

    /// What others take of a lamp's light before it reaches a member: bindings of `frame/others.wgsl`. None when they take
    /// nothing.
    pub fn others(
        &self,
        plan: &mut Plan,
        member: &Member,
        lamp: &Lamp,
    ) -> Result<Option<Vec<(&'static str, Bind)>>, Problem> {
        let (item, frame) = (self.item(member), self.frame);
        if !super::Frame::casts(lamp.light) {
            return Ok(None);
        }
        let may_hide =
            |other: &super::Item| !std::ptr::eq(other, item) && lies_before(lamp.light, &other.corners, &item.corners);
        if frame.view.skip && !frame.casters(lamp.place).any(may_hide) {
            let what = format!("what others take of the light of `{}` on its way into `{}`", lamp.name, member.name);
            plan.skip(what, "nothing lies between them");
            return Ok(None);
        }
        let views = frame.views(lamp.light);
        let map = frame.shadow_map(plan, lamp.place, lamp.light, &views, Some(item))?;
        let table: Vec<tables::OthersView> = views
            .views
            .iter()
            .map(|view| {
                let clip_from_object = view.clip_from_world * DMat4::from(item.world_from_object);
                tables::OthersView { clip_from_object: clip_from_object.as_mat4(), per_sample: views.per_sample }
            })
            .collect();
        Ok(Some(vec![
            ("others_views", Bind::list(&table)),
            ("others_map", Bind::Texture(map, 0)),
            ("compare", Bind::Sampler(Sampler::Shadow)),
        ]))
    }

    /// Views of a member alone, grown by `margin` scene units on all sides.
    pub fn lamp_views(&self, member: &Member, lamp: &Lamp, margin: f64) -> LampViews {
        let item = self.item(member);
        // Around each corner an octahedron that holds a ball of the margin.
        let reach = 3f64.sqrt() * margin;
        let around = |p: DVec3| [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| [p - reach * axis, p + reach * axis]);
        let corners: Vec<DVec3> = item.corners.iter().flat_map(|p| around(*p)).flatten().collect();
        let views = LightViews::of(lamp.light, &corners);
        let matrix = |clip_from_world: DMat4| (clip_from_world * DMat4::from(item.world_from_object)).as_mat4();
        LampViews {
            views: views.views.iter().map(|view| (matrix(view.clip_from_world), view.texel)).collect(),
            per_sample: views.per_sample,
            size: views.size,
        }
    }

    /// The middle of a member's box in its own space, and the box's diagonal: scene units.
    pub fn box_of(&self, member: &Member) -> (DVec3, f64) {
        let item = self.item(member);
        let (middle, radius) = item.ball();
        (item.world_from_object.inverse().transform_point3(middle), 2.0 * radius)
    }
}

/// Whether one box may be in the way of light to another. Only of parallel light there is something to say.
fn lies_before(light: &Light, one: &[DVec3; 8], other: &[DVec3; 8]) -> bool {
    let LightKind::Directional { direction, .. } = light.kind else { return true };
    let (a, b) = direction.normalize().any_orthonormal_pair();
    let range = |corners: &[DVec3; 8], axis: DVec3| {
        let along = corners.map(|p| p.dot(axis));
        along.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)))
    };
    let overlap = |axis: DVec3| {
        let ((low, high), (other_low, other_high)) = (range(one, axis), range(other, axis));
        low <= other_high && other_low <= high
    };
    overlap(a) && overlap(b) && range(one, direction).0 <= range(other, direction).1
}

/// Rotation only: what stands in the world's axes, in the object's.
pub(super) fn axes_of(world_from_object: &DAffine3) -> glam::DMat3 {
    world_from_object.matrix3.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_beside_or_behind_hides_nothing() {
        let cube =
            |at: DVec3| std::array::from_fn(|i| at + DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64));
        let kind = LightKind::Directional { direction: DVec3::NEG_Y, irradiance: DVec3::ONE };
        let sun = Light { name: "sun".into(), shadow: true, enabled: true, kind };
        let here = cube(DVec3::ZERO);
        assert!(lies_before(&sun, &cube(5.0 * DVec3::Y), &here) && lies_before(&sun, &cube(0.5 * DVec3::Y), &here));
        assert!(!lies_before(&sun, &cube(-5.0 * DVec3::Y), &here) && !lies_before(&sun, &cube(5.0 * DVec3::X), &here));
    }
}
