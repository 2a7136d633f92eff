//! What a dielectric boundary does to a path: reflection and refraction at a smooth one, GGX microfacets at a rough one
//! [Walter2007], sampled by the normals that the path sees [Dupuy2023].
//!
//! Radiance is counted per squared index of the medium that it travels in: what is transmitted is then multiplied by the
//! transmittance alone, whichever way it goes. A path direction `d` points the way that the path is followed, from the eye
//! onwards; normals are on the side that `d` comes from; `eta` is the index of the far side over that of the near one.

use crate::optics::fresnel::{fresnel_dielectric, refracted_cosine};
use crate::optics::microfacet::{ggx_d, smith_g2};
use glam::DVec3;

/// A point of a boundary, as a path meets it.
#[derive(Clone, Copy, Debug)]
pub struct Facing {
    /// Of the triangle.
    pub flat: DVec3,
    /// Interpolated over it.
    pub normal: DVec3,
    pub eta: f64,
    /// Perceptual, [0, 1]; 0 is smooth.
    pub roughness: f64,
}

/// A path that is split by a boundary: directions on, and the share of each.
#[derive(Clone, Copy, Debug)]
pub struct Split {
    pub reflectance: f64,
    pub reflected: DVec3,
    /// None when all is reflected.
    pub refracted: Option<DVec3>,
}

/// A roughness below which a lobe is too narrow for f64's cosines: smooth.
const SMOOTHEST: f64 = 0.02;

impl Facing {
    pub fn is_smooth(&self) -> bool {
        self.roughness < SMOOTHEST || self.eta == 1.0
    }

    /// What a smooth boundary does. Where the interpolated normal would send the path to the wrong side of the triangle,
    /// the triangle's own is taken, so that no energy is lost and no path is on a side that it did not cross to.
    pub fn split(&self, d: DVec3) -> Split {
        self.split_well(d).unwrap_or_else(|| split(d, self.flat, self.eta))
    }

    /// By the interpolated normal, if that sends the path to no wrong side.
    fn split_well(&self, d: DVec3) -> Option<Split> {
        let split = split(d, self.normal, self.eta);
        let goes_wrong = d.dot(self.normal) >= 0.0
            || split.reflected.dot(self.flat) <= 0.0
            || split.refracted.is_some_and(|r| r.dot(self.flat) >= 0.0);
        (!goes_wrong).then_some(split)
    }

    /// The same for light, which comes from the side of the normals: directions into which a smooth boundary reflects or
    /// refracts it, so that paths which come against them go on against `light`. Each with the share of light that those paths
    /// get, times what turns arriving flux into flux that goes on [Veach1997, sec. 5.3]: that is 1 for a reflection where both
    /// normals are one.
    pub fn reversed(&self, light: DVec3, is_reflection: bool) -> [Option<(DVec3, f64)>; 2] {
        let (side, eta) = if is_reflection { (1.0, self.eta) } else { (-1.0, 1.0 / self.eta) };
        let seen = Facing { flat: side * self.flat, normal: side * self.normal, eta, ..*self };
        let by = |n: DVec3, is_flat: bool| {
            let there = split(light, n, self.eta);
            let to = if is_reflection { there.reflected } else { there.refracted? };
            // The path takes the one normal or the other.
            let is_taken = light.dot(n) < 0.0 && to.dot(seen.flat) > 0.0 && seen.split_well(-to).is_none() == is_flat;
            if !is_taken {
                return None;
            }
            let reflectance = split(-to, side * n, eta).reflectance;
            let turned = (to.dot(self.flat) / light.dot(self.flat)).abs();
            Some(match is_reflection {
                true => (to, reflectance * turned),
                false => {
                    let bent = light.dot(n) / to.dot(n) / (self.eta * self.eta);
                    (to, (1.0 - reflectance) * turned * bent)
                }
            })
        };
        match self.normal == self.flat {
            true => [by(self.flat, false).or_else(|| by(self.flat, true)), None],
            false => [by(self.normal, false), by(self.flat, true)],
        }
    }

    /// A normal of a rough boundary's microfacets among those that the path sees, from two numbers in [0, 1).
    pub fn microfacet(&self, d: DVec3, (u, v): (f64, f64)) -> DVec3 {
        let alpha = self.roughness * self.roughness;
        let (x, y) = self.normal.any_orthonormal_pair();
        let eye = DVec3::new(-d.dot(x), -d.dot(y), -d.dot(self.normal));
        // Stretched, the visible normals are halfway to directions that are uniform in a cap.
        let stretched = DVec3::new(alpha * eye.x, alpha * eye.y, eye.z).normalize();
        let z = (1.0 - u) * (1.0 + stretched.z) - stretched.z;
        let ring = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let (sin, cos) = (2.0 * std::f64::consts::PI * v).sin_cos();
        let h = DVec3::new(ring * cos, ring * sin, z) + stretched;
        let h = DVec3::new(alpha * h.x, alpha * h.y, h.z).normalize();
        h.x * x + h.y * y + h.z * self.normal
    }

    /// What the microfacet of normal `h` does to the path; the share that other microfacets do not hide follows with
    /// [`Facing::unhidden`].
    pub fn split_at(&self, d: DVec3, h: DVec3) -> Split {
        split(d, h, self.eta)
    }

    /// Of what goes from `d` to `to`, the share that no other microfacet hides, given that the path saw the first: G2/G1.
    /// 0 for directions that lie on the wrong side of the boundary.
    pub fn unhidden(&self, d: DVec3, to: DVec3, is_reflection: bool) -> f64 {
        let side = if is_reflection { 1.0 } else { -1.0 };
        let (cos_d, cos_to) = (-d.dot(self.normal), side * to.dot(self.normal));
        if cos_d <= 0.0 || cos_to <= 0.0 || side * to.dot(self.flat) <= 0.0 {
            return 0.0;
        }
        smith_g2(cos_to, cos_d, self.roughness) / smith_g1(cos_d, self.roughness)
    }

    /// The rough boundary's value for light that comes along `-to`, times its cosine, 1/sr, and the density with which
    /// [`Facing::microfacet`] leads there, given that the path is reflected, or given that it is refracted.
    pub fn value(&self, d: DVec3, to: DVec3) -> (f64, f64) {
        let is_reflection = to.dot(self.normal) > 0.0;
        let half = if is_reflection { to - d } else { self.eta * to - d };
        // The normal of the microfacet that does it, on the path's side.
        let h = half.normalize_or_zero();
        let h = if h.dot(self.normal) < 0.0 { -h } else { h };
        let (cos_dh, cos_n) = (-d.dot(h), -d.dot(self.normal));
        if h == DVec3::ZERO || cos_dh <= 0.0 || cos_n <= 0.0 {
            return (0.0, 0.0);
        }
        let reflectance = fresnel_dielectric(cos_dh.min(1.0), self.eta);
        let visible =
            smith_g1(cos_n, self.roughness) * cos_dh * ggx_d(h.dot(self.normal).min(1.0), self.roughness) / cos_n;
        let (share, density) = if is_reflection {
            (reflectance, visible / (4.0 * cos_dh))
        } else {
            let cos_th = to.dot(h);
            if cos_th >= 0.0 {
                return (0.0, 0.0);
            }
            // d omega_h / d omega_to.
            let density = visible * self.eta * self.eta * -cos_th / (cos_dh + self.eta * cos_th).powi(2);
            (1.0 - reflectance, density)
        };
        (share * density * self.unhidden(d, to, is_reflection), density)
    }
}

fn split(d: DVec3, n: DVec3, eta: f64) -> Split {
    let cos = -d.dot(n);
    let reflected = d + 2.0 * cos * n;
    let cos = cos.clamp(0.0, 1.0);
    match refracted_cosine(cos, eta) {
        Some(cos_t) => {
            let refracted = ((d + cos * n) / eta - cos_t * n).normalize();
            Split { reflectance: fresnel_dielectric(cos, eta), reflected, refracted: Some(refracted) }
        }
        None => Split { reflectance: 1.0, reflected, refracted: None },
    }
}

/// The share of microfacets that one direction sees.
fn smith_g1(cos: f64, roughness: f64) -> f64 {
    let a = roughness.powi(4);
    2.0 * cos / (cos + (a + (1.0 - a) * cos * cos).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::microfacet::directional_albedo;
    use crate::reference::random::Random;
    use std::f64::consts::PI;

    fn facing(eta: f64, roughness: f64) -> Facing {
        Facing { flat: DVec3::Z, normal: DVec3::Z, eta, roughness }
    }

    #[test]
    fn what_is_refracted_comes_back_the_same_way() {
        for eta in [1.0, 1.3, 1.5, 3.0] {
            for cos in [1.0f64, 0.7, 0.2, 0.01] {
                let d = DVec3::new((1.0 - cos * cos).sqrt(), 0.0, -cos);
                let there = facing(eta, 0.0).split(d);
                let inside = there.refracted.unwrap();
                let back = Facing { flat: -DVec3::Z, normal: -DVec3::Z, eta: 1.0 / eta, roughness: 0.0 }.split(-inside);
                // The path -inside comes from below: seen from there the normal is -z.
                assert!((back.refracted.unwrap() + d).length() < 1e-7, "eta {eta} cos {cos}");
                assert!((there.reflectance - back.reflectance).abs() < 1e-7);
                assert!((inside.x * eta - d.x).abs() < 1e-12, "Snell");
            }
        }
        let grazing = DVec3::new(0.999, 0.0, (1.0 - 0.999f64 * 0.999).sqrt());
        let inside = Facing { flat: -DVec3::Z, normal: -DVec3::Z, eta: 1.0 / 1.5, roughness: 0.0 };
        assert!(inside.split(grazing).refracted.is_none());
    }

    #[test]
    fn normals_that_point_to_the_wrong_side_are_replaced() {
        let tilted = Facing { normal: DVec3::new(0.9, 0.0, 0.1).normalize(), ..facing(1.5, 0.0) };
        let d = DVec3::new(0.6, 0.0, -0.8);
        let split = tilted.split(d);
        assert!(split.reflected.z > 0.0 && split.refracted.unwrap().z < 0.0);
    }

    /// Light that boundaries turn is what paths bring back that they turn: the same integral over pairs of directions from
    /// either side, weighed by a function that has no symmetry.
    #[test]
    fn light_goes_the_ways_of_paths_backwards() {
        for (eta, tilt, is_reflection) in
            [(1.4, 0.0, false), (1.4, 0.5, false), (1.0 / 1.4, 0.5, false), (1.4, 0.7, true), (1.0 / 1.4, 0.4, true)]
        {
            // As light meets it.
            let normal = DVec3::new(tilt, 0.0, 1.0).normalize();
            let outside = Facing { normal, ..facing(eta, 0.0) };
            let seen = match is_reflection {
                true => outside,
                false => Facing { flat: -DVec3::Z, normal: -normal, eta: 1.0 / eta, roughness: 0.0 },
            };
            let weigh = |light: DVec3, to: DVec3| 1.0 + light.x + 0.5 * to.y * light.y + 0.7 * to.x * to.x;
            let mut random = Random::new(1, 2, 3);
            let n = 400_000;
            let (mut forth, mut back) = (0.0, 0.0);
            for _ in 0..n {
                let (z, phi) = (random.unit(), 2.0 * PI * random.unit());
                let ring = ((1.0 - z) * (1.0 + z)).sqrt();
                let down = DVec3::new(ring * phi.cos(), ring * phi.sin(), -z);
                for (to, share) in outside.reversed(down, is_reflection).into_iter().flatten() {
                    forth += z * share * weigh(down, to) / n as f64;
                }
                let path = if is_reflection { down } else { -down };
                let split = seen.split(path);
                back += match (is_reflection, split.refracted) {
                    (true, _) => split.reflectance * z * weigh(-split.reflected, -path),
                    (false, Some(to)) => (1.0 - split.reflectance) * z * weigh(-to, -path),
                    (false, None) => 0.0,
                } / n as f64;
            }
            assert!((forth / back - 1.0).abs() < 0.01, "{eta} {tilt} {is_reflection}: {forth} {back}");
        }
    }

    /// Sampled normals and evaluated densities are two spellings of one thing; and the reflected share is the integral
    /// that the optics know.
    #[test]
    fn rough_boundaries_sample_what_they_evaluate() {
        for (eta, cos) in [(1.5, 0.8f64), (1.0 / 1.5, 0.9), (1.3, 0.3)] {
            let rough = facing(eta, 0.6);
            let d = DVec3::new((1.0 - cos * cos).sqrt(), 0.0, -cos);
            let mut random = Random::new(1, 2, 3);
            let n = 200_000;
            let (mut reflected, mut bins, mut expected) = (0.0, [0.0; 16], [0.0; 16]);
            // Sectors of azimuth on either side of the boundary.
            let bin = |to: DVec3| (to.y.atan2(to.x) / PI * 4.0 + 4.0).min(7.0) as usize + 8 * (to.z < 0.0) as usize;
            for _ in 0..n {
                let h = rough.microfacet(d, random.pair());
                let split = rough.split_at(d, h);
                let is_reflection = random.unit() < split.reflectance;
                let to = if is_reflection { split.reflected } else { split.refracted.unwrap() };
                let weight = rough.unhidden(d, to, is_reflection);
                reflected += if is_reflection { weight } else { 0.0 } / n as f64;
                bins[bin(to)] += weight / n as f64;
                // And by uniform directions.
                let (z, phi) = (2.0 * random.unit() - 1.0, 2.0 * PI * random.unit());
                let ring = (1.0 - z * z).sqrt();
                let to = DVec3::new(ring * phi.cos(), ring * phi.sin(), z);
                expected[bin(to)] += rough.value(d, to).0 * 4.0 * PI / n as f64;
            }
            if eta > 1.0 {
                let exact = directional_albedo(cos, 0.6, eta);
                assert!((reflected - exact).abs() < 0.004, "eta {eta}: {reflected} {exact}");
            }
            for (a, b) in bins.iter().zip(expected) {
                assert!((a - b).abs() < 0.012, "eta {eta}: {bins:?} {expected:?}");
            }
        }
    }
}
