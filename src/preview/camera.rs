//! What the mouse does to a camera. Pixels go right and down; lengths are scene units.

use crate::scene::Camera;
use glam::{DQuat, DVec2, DVec3};
use std::f64::consts::PI;

/// The camera comes no nearer than this to looking along its own up, radians.
const POLE: f64 = 0.02;

/// Turns the eye about the target: half a turn for a drag across the whole height.
pub fn orbit(camera: &mut Camera, drag: DVec2, height: f64) {
    let up = camera.up.normalize();
    let arm = camera.eye - camera.target;
    let around = DQuat::from_axis_angle(up, -PI * drag.x / height);
    let from_pole = arm.angle_between(up);
    let wanted = (from_pole - PI * drag.y / height).clamp(POLE, PI - POLE);
    let over = DQuat::from_axis_angle(up.cross(arm).normalize(), wanted - from_pole);
    camera.eye = camera.target + around * (over * arm);
}

/// Moves eye and target alike, so that what is at the target stays under the mouse.
pub fn pan(camera: &mut Camera, drag: DVec2, height: f64) {
    let Axes { right, up, .. } = axes(camera);
    let step = (-drag.x * right + drag.y * up) * unit_at_target(camera) / height;
    camera.eye += step;
    camera.target += step;
}

/// Brings the eye nearer to the target: by a seventh for each notch of a wheel.
pub fn zoom(camera: &mut Camera, notches: f64) {
    camera.eye = camera.target + (camera.eye - camera.target) * (-notches / 7.0).exp();
}

/// Looks at a ball from where the eye is, so that it fills the smaller side of the view.
pub fn frame(camera: &mut Camera, center: DVec3, radius: f64, aspect: f64) {
    let half = 0.5 * camera.fov_y_deg.to_radians();
    let smaller = half.min((half.tan() * aspect).atan());
    let back = (camera.eye - camera.target).normalize();
    camera.target = center;
    camera.eye = center + back * (1.1 * radius / smaller.sin());
}

/// The camera that sees one place of another's view, and nothing beside it. `place` is counted from the middle in half
/// heights, right and up.
pub fn through(camera: &Camera, place: DVec2) -> Camera {
    let Axes { forward, right, up } = axes(camera);
    let tan = (0.5 * camera.fov_y_deg.to_radians()).tan();
    let direction = forward + tan * (place.x * right + place.y * up);
    Camera { target: camera.eye + direction, fov_y_deg: 0.01, up, ..*camera }
}

struct Axes {
    forward: DVec3,
    right: DVec3,
    up: DVec3,
}

fn axes(camera: &Camera) -> Axes {
    let forward = (camera.target - camera.eye).normalize();
    let right = forward.cross(camera.up).normalize();
    Axes { forward, right, up: right.cross(forward) }
}

/// The height of what is seen at the target's distance.
fn unit_at_target(camera: &Camera) -> f64 {
    2.0 * camera.eye.distance(camera.target) * (0.5 * camera.fov_y_deg.to_radians()).tan()
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: Camera =
        Camera { eye: DVec3::new(1.0, 2.0, 5.0), target: DVec3::new(0.5, 0.0, -1.0), up: DVec3::Y, fov_y_deg: 40.0 };

    /// Where a point is seen: half heights from the middle, right and up.
    fn seen(camera: &Camera, point: DVec3) -> DVec2 {
        let Axes { forward, right, up } = axes(camera);
        let arm = point - camera.eye;
        let tan = (0.5 * camera.fov_y_deg.to_radians()).tan();
        DVec2::new(arm.dot(right), arm.dot(up)) / (arm.dot(forward) * tan)
    }

    #[test]
    fn an_orbit_keeps_the_distance_goes_back_and_stops_short_of_the_pole() {
        let mut camera = START;
        orbit(&mut camera, DVec2::new(130.0, -40.0), 500.0);
        let distance = |camera: &Camera| camera.eye.distance(camera.target);
        assert!((distance(&camera) - distance(&START)).abs() < 1e-12 && camera.target == START.target);
        assert!(camera.eye.distance(START.eye) > 1.0);
        orbit(&mut camera, DVec2::new(0.0, 40.0), 500.0);
        orbit(&mut camera, DVec2::new(-130.0, 0.0), 500.0);
        assert!(camera.eye.distance(START.eye) < 1e-9);
        for drag in [1e4, -1e4] {
            orbit(&mut camera, DVec2::new(3.0, drag), 500.0);
            assert!(axes(&camera).right.is_finite() && (distance(&camera) - distance(&START)).abs() < 1e-9);
        }
    }

    #[test]
    fn a_drag_to_the_right_turns_what_is_in_front_to_the_right() {
        let mut camera = START;
        let front = camera.target + (camera.eye - camera.target) * 0.1;
        orbit(&mut camera, DVec2::new(20.0, 0.0), 500.0);
        assert!(seen(&camera, front).x > 0.0);
        let mut camera = START;
        orbit(&mut camera, DVec2::new(0.0, 20.0), 500.0);
        assert!(seen(&camera, front).y < 0.0);
    }

    #[test]
    fn a_pan_keeps_the_target_s_old_place_under_the_mouse() {
        let mut camera = START;
        pan(&mut camera, DVec2::new(50.0, -25.0), 500.0);
        let place = seen(&camera, START.target);
        assert!(place.distance(DVec2::new(0.2, 0.1)) < 1e-12, "{place}");
    }

    #[test]
    fn a_wheel_never_passes_the_target_and_turning_back_undoes_it() {
        let mut camera = START;
        zoom(&mut camera, 50.0);
        assert!((camera.eye - camera.target).dot(START.eye - START.target) > 0.0);
        zoom(&mut camera, -50.0);
        assert!(camera.eye.distance(START.eye) < 1e-9);
    }

    #[test]
    fn a_framed_ball_touches_no_edge_and_a_ray_goes_through_its_place() {
        let mut camera = START;
        frame(&mut camera, DVec3::new(7.0, 1.0, 0.0), 2.0, 0.5);
        let edge = seen(&camera, camera.target + 2.0 * axes(&camera).right);
        assert!(seen(&camera, camera.target).length() < 1e-12 && edge.x < 0.5 && edge.x > 0.4, "{edge}");
        let place = DVec2::new(0.3, -0.6);
        let ray = through(&START, place);
        assert!(seen(&START, ray.target + 3.0 * (ray.target - ray.eye)).distance(place) < 1e-12);
    }
}
