//! Deformations that move with time, in object space.

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use crate::geometry::mesh::Mesh;

/// Each slice across the axis through the origin turns by an angle that grows with its height along the axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Twist {
    /// Any length but zero.
    pub axis: DVec3,
    /// Degrees per scene unit of height, seen against the axis counter-clockwise.
    pub deg_per_unit: f64,
    /// How often per second the twist swings there and back: it is `deg_per_unit` times sin(2 pi speed_hz t). At 0 it
    /// does not swing but stands at `deg_per_unit`.
    pub speed_hz: f64,
}

impl Twist {
    /// The mesh at `time_s` seconds. Normals follow by the inverse transpose of the Jacobian, exactly.
    pub fn apply(&self, mesh: &Mesh, time_s: f64) -> Mesh {
        let axis = self.axis.normalize();
        let swing = if self.speed_hz == 0.0 { 1.0 } else { (std::f64::consts::TAU * self.speed_hz * time_s).sin() };
        let rate = self.deg_per_unit.to_radians() * swing;
        // x' = R(k h) x with h = a.x has the Jacobian R (I + k (a × x) a^T). Since (a × x).a = 0, its determinant is 1
        // and its inverse transpose R (I - k a (a × x)^T).
        let moved = |(position, normal): (&glam::Vec3, Option<&glam::Vec3>)| {
            let x = position.as_dvec3();
            let turn = DMat3::from_axis_angle(axis, rate * axis.dot(x));
            let normal = normal.map(|n| {
                let n = n.as_dvec3();
                (turn * (n - rate * axis.cross(x).dot(n) * axis)).normalize().as_vec3()
            });
            ((turn * x).as_vec3(), normal)
        };
        let normals = mesh.normals.iter().map(Some).chain(std::iter::repeat(None));
        let (positions, normals): (Vec<_>, Vec<_>) = mesh.positions.iter().zip(normals).map(moved).unzip();
        Mesh {
            positions,
            normals: normals.into_iter().flatten().collect(),
            uvs: mesh.uvs.clone(),
            triangles: mesh.triangles.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;
    use glam::Vec3;

    const TWIST: Twist = Twist { axis: DVec3::new(0.3, 2.0, -0.5), deg_per_unit: 25.0, speed_hz: 0.0 };

    #[test]
    fn normals_are_those_of_the_twisted_surface() {
        let error = |around| {
            let torus = TWIST.apply(&shapes::torus(2.0, 0.7, (2 * around, around)), 0.0);
            let smooth = torus.smooth_normals();
            torus.normals.iter().zip(&smooth).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
        };
        let (coarse, fine) = (error(32), error(64));
        assert!(fine < 0.02 && coarse / fine > 3.0, "{coarse} {fine}");
    }

    #[test]
    fn volume_stays_and_the_mesh_stays_closed() {
        let sphere = shapes::sphere(2.0, 5);
        let twisted = TWIST.apply(&sphere, 0.0);
        assert!(twisted.is_closed());
        assert!((twisted.signed_volume() / sphere.signed_volume() - 1.0).abs() < 1e-3);
        let slab = shapes::slab(DVec3::new(1.0, 4.0, 0.3), (4, 40));
        assert!(TWIST.apply(&slab, 0.0).is_closed());
        assert!(TWIST.apply(&slab, 0.0).positions.iter().zip(&slab.positions).any(|(a, b)| a.distance(*b) > 0.2));
    }

    #[test]
    fn swings_through_rest_to_both_sides() {
        let slab = shapes::slab(DVec3::new(1.0, 4.0, 0.3), (4, 40));
        let swing = Twist { speed_hz: 0.5, ..TWIST };
        let near = |a: &Mesh, b: &Mesh| a.positions.iter().zip(&b.positions).all(|(a, b)| a.distance(*b) < 1e-6);
        assert!(near(&swing.apply(&slab, 0.0), &slab) && near(&swing.apply(&slab, 1.0), &slab));
        assert!(near(&swing.apply(&slab, 0.5), &TWIST.apply(&slab, 9.0)));
        let back = Twist { deg_per_unit: -25.0, ..TWIST };
        assert!(near(&swing.apply(&slab, 1.5), &back.apply(&slab, 0.0)));
        // Counter-clockwise: at height 1 the x axis turns towards -z by the right hand about y.
        let y = Twist { axis: DVec3::Y, deg_per_unit: 90.0, speed_hz: 0.0 };
        let mesh = Mesh { positions: vec![Vec3::new(1.0, 1.0, 0.0)], ..Mesh::default() };
        assert!(y.apply(&mesh, 0.0).positions[0].distance(Vec3::new(0.0, 1.0, -1.0)) < 1e-6);
    }
}
