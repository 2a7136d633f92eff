//! Polygons cut into triangles by clipping ears [Meisters1975], so that concave ones come out right.

use glam::{DVec2, DVec3};

/// Above this many corners the quadratic cost of clipping would let a small file stall the reader.
pub const MOST_CORNERS: usize = 512;

/// The triangles of a polygon as indices into `corners`, turning as it does. A polygon that is not flat is cut as seen
/// along its mean normal; one that crosses itself, or has no area, is cut somehow. None beyond [`MOST_CORNERS`].
pub fn triangulate(corners: &[DVec3]) -> Option<Vec<[usize; 3]>> {
    match corners.len() {
        3 => return Some(vec![[0, 1, 2]]),
        4.. => (),
        _ => return Some(vec![]),
    }
    if corners.len() > MOST_CORNERS {
        return None;
    }
    let flat = flatten(corners);
    let mut left: Vec<usize> = (0..corners.len()).collect();
    let mut triangles = Vec::with_capacity(corners.len() - 2);
    // How many corners may still be looked at. A polygon that crosses itself everywhere would take the cube of its corners.
    let mut patience = 16 * corners.len() * corners.len();
    while left.len() > 3 {
        let n = left.len();
        let around = |i: usize| [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
        // Of all ears the one whose sharpest angle is widest: fewer slivers than the first ear gives. Without any ear
        // the polygon crosses itself or is a line, and any corner will do.
        let quality = |i: usize| {
            let [a, b, c] = around(i).map(|k| flat[k]);
            let inside = |&k: &usize| !around(i).contains(&k) && holds([a, b, c], flat[k]);
            if turn(a, b, c) > 0.0 && !left.iter().any(inside) { sharpness(a, b, c) } else { -1.0 }
        };
        // Quads decide by one diagonal; large polygons take the first good enough ear, to stay quadratic.
        let candidates = (0..n).map(|i| (i, quality(i)));
        let ear = if patience == 0 {
            None
        } else if n <= 8 {
            candidates.reduce(|best, one| if one.1 > best.1 { one } else { best })
        } else {
            candidates.take(n).find(|one| one.1 >= 0.0)
        };
        patience = patience.saturating_sub(n * ear.map_or(n, |(i, _)| i + 1));
        let ear = ear.map_or(1, |(i, _)| i);
        triangles.push(around(ear));
        left.remove(ear);
    }
    triangles.push([left[0], left[1], left[2]]);
    Some(triangles)
}

/// The polygon along its mean normal (Newell), so that it turns counter-clockwise, about as large as 1.
fn flatten(corners: &[DVec3]) -> Vec<DVec2> {
    let center = corners.iter().sum::<DVec3>() / corners.len() as f64;
    let size = corners.iter().map(|p| p.distance(center)).fold(0.0, f64::max);
    let local: Vec<DVec3> =
        corners.iter().map(|p| if size > 0.0 { (p - center) / size } else { DVec3::ZERO }).collect();
    let pairs = local.iter().zip(local.iter().cycle().skip(1));
    let normal: DVec3 = pairs.map(|(a, b)| a.cross(*b)).sum();
    let (u, v) = normal.normalize_or(DVec3::Z).any_orthonormal_pair();
    local.iter().map(|p| DVec2::new(p.dot(u), p.dot(v))).collect()
}

/// Twice the signed area, positive counter-clockwise.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

fn holds([a, b, c]: [DVec2; 3], p: DVec2) -> bool {
    // A repeated corner (a bridge to a hole) stands on the rim and hides no ear.
    let corner = p == a || p == b || p == c;
    !corner && turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0
}

/// Twice the area over the longest side squared: 0 for slivers, 0.87 at best.
fn sharpness(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    turn(a, b, c) / a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;
    use proptest::prelude::*;

    fn area(corners: &[DVec3], triangles: &[[usize; 3]]) -> (f64, f64) {
        let areas = triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| corners[i]);
            0.5 * (b - a).cross(c - a)
        });
        areas.fold((0.0, 0.0), |(net, gross), a| (net + a.z, gross + a.length()))
    }

    #[test]
    fn concave_polygons_are_covered_once() {
        let star = |n: usize| -> Vec<DVec3> {
            (0..2 * n)
                .map(|i| {
                    let (sin, cos) = (std::f64::consts::PI * i as f64 / n as f64).sin_cos();
                    dvec3(cos, sin, 0.0) * if i % 2 == 0 { 1.0 } else { 0.3 }
                })
                .collect()
        };
        // An arrow whose fan from the first corner would leave it.
        let arrow = vec![dvec3(1.0, 0.0, 0.0), dvec3(0.0, 2.0, 0.0), dvec3(-1.0, 0.0, 0.0), dvec3(0.0, 0.5, 0.0)];
        for corners in [arrow, star(3), star(5), star(100)] {
            let triangles = triangulate(&corners).unwrap();
            assert_eq!(triangles.len(), corners.len() - 2);
            let (net, gross) = area(&corners, &triangles);
            let newell: f64 = (0..corners.len())
                .map(|i| 0.5 * corners[i].truncate().perp_dot(corners[(i + 1) % corners.len()].truncate()))
                .sum();
            assert!((net - newell).abs() < 1e-12 && (gross - newell).abs() < 1e-12, "{net} {gross} {newell}");
        }
        assert_eq!(triangulate(&star(400)), None);
        // One that crosses itself everywhere.
        let wild: Vec<DVec3> = (0..512).map(|i| star(256)[i * 211 % 512]).collect();
        assert_eq!(triangulate(&wild).unwrap().len(), 510);
    }

    proptest! {
        #[test]
        fn every_polygon_gives_two_triangles_less_than_corners(points in prop::collection::vec(-3i8..3, 9..60)) {
            let corners: Vec<DVec3> = points.chunks_exact(3).map(|p| dvec3(p[0] as f64, p[1] as f64, p[2] as f64)).collect();
            let triangles = triangulate(&corners).unwrap();
            prop_assert_eq!(triangles.len(), corners.len().saturating_sub(2));
        }
    }
}
