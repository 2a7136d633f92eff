//! The vocabulary of the figures: solids, smooth ways to join and cut them, and frames to pose them in.
//!
//! All lengths are in the figure's own units (it is about 100 tall). Joins have a width `k` over which they round off;
//! where two surfaces are farther apart than `k` they do not touch each other's shape.

use glam::{DMat3, DVec2, DVec3};

pub fn sphere(p: DVec3, center: DVec3, radius: f64) -> f64 {
    p.distance(center) - radius
}

/// First order near the surface: exact in sign, and in slope on it.
pub fn ellipsoid(p: DVec3, center: DVec3, radii: DVec3) -> f64 {
    let q = (p - center) / radii;
    let (k, slope) = (q.length(), (q / radii).length());
    // At the centre the quotient has no value; the distance there is known.
    if slope < 1e-9 { -radii.min_element() } else { k * (k - 1.0) / slope }
}

/// The hull of two spheres.
pub fn round_cone(p: DVec3, (a, ra): (DVec3, f64), (b, rb): (DVec3, f64)) -> f64 {
    let axis = b - a;
    let length = axis.length();
    let along = (p - a).dot(axis) / length;
    let across = ((p - a).length_squared() - along * along).max(0.0).sqrt();
    round_cone_profile(DVec2::new(across, along), length, ra, rb)
}

/// The hull of two circles in the plane: radius `ra` at the origin and `rb` at `length` up the y axis; x ≥ 0.
pub fn round_cone_profile(p: DVec2, length: f64, ra: f64, rb: f64) -> f64 {
    let sin = (ra - rb) / length;
    let cos = (1.0 - sin * sin).max(0.0).sqrt();
    let k = p.dot(DVec2::new(-sin, cos));
    if k < 0.0 {
        p.length() - ra
    } else if k > cos * length {
        p.distance(DVec2::new(0.0, length)) - rb
    } else {
        p.dot(DVec2::new(cos, sin)) - ra
    }
}

/// The union, with a fillet of width `k`; two continuous derivatives, so that highlights flow across it.
pub fn join(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * h * k / 6.0
}

/// The intersection, with its edge rounded over `k`.
pub fn meet(a: f64, b: f64, k: f64) -> f64 {
    -join(-a, -b, k)
}

/// `a` without `b`, with its edge rounded over `k`.
pub fn cut(a: f64, b: f64, k: f64) -> f64 {
    meet(a, -b, k)
}

/// How much to add to a distance to engrave a line `depth` deep, `off` away from its middle. The line follows the
/// surface wherever that lies: it is drawn, not carved with a tool that could miss it or tunnel.
pub fn groove(off: f64, width: f64, depth: f64) -> f64 {
    depth * (-(off / width).powi(2)).exp()
}

/// Both sides at once: x as seen on the side of positive x. Rounded at the middle plane, so that nothing creases there.
pub fn mirrored(p: DVec3) -> DVec3 {
    DVec3::new((p.x * p.x + 0.01).sqrt(), p.y, p.z)
}

/// 0 below `from`, 1 above `to`, smooth between.
pub fn ramp(x: f64, from: f64, to: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

/// A place and a posture.
pub struct Frame {
    origin: DVec3,
    local_from_figure: DMat3,
}

impl Frame {
    /// Turned about the fixed x, then y, then z axis, in degrees.
    pub fn new(origin: DVec3, turn_deg: DVec3) -> Frame {
        let [x, y, z] = turn_deg.to_array().map(f64::to_radians);
        let turn = DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x);
        Frame { origin, local_from_figure: turn.transpose() }
    }

    pub fn local(&self, p: DVec3) -> DVec3 {
        self.local_from_figure * (p - self.origin)
    }
}
