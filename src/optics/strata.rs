//! How much light a stack of layers over a half space sends back, by diffusion: the effective medium of a texel.
//!
//! Light goes down from the surface at a cosine inside, is lost as e^(-sigma_t' z / cos) and diffuses from where it scatters.
//! The chance P(z) to leave from the depth z solves D P'' = sigma_a P in each layer, and P and D P' go on across boundaries
//! of layers [Donner2005]. From the deepest layer upwards two numbers say all of what lies below a level:
//!
//! - its *admittance* q = -sqrt(3) D P'/P, which in a half space is the root of the co-albedo sigma_a / sigma_t', so that
//!   every stack has a half space that admits light as it does;
//! - what is *returned*: ∫ sigma_s'/cos e^(-sigma_t' z / cos) P(z)/P(0) dz, for light that goes down through the level.
//!
//! A layer is put on top in closed form, so layers of one medium are one layer. At the surface P(0) = 1/(1 + b q), with b the
//! [`boundary`] of Fresnel's moments [dEon2011]. In a half space that is a few percent too much, up to a quarter where
//! little is scattered: [`correction`] is what makes it exact, for a stack as for the half space of its admittance.
//!
//! Anisotropy enters by similarity. Lengths in mm.

use crate::optics::fresnel::{diffuse_transmittance, fresnel_dielectric, fresnel_moment, refracted_cosine};
use crate::optics::half_space::HalfSpace;
use crate::optics::phase::Phase;
use crate::optics::quadrature::halving;
use std::f64::consts::PI;

/// Less absorption than this, as a root of the co-albedo, counts as this: hyperbolas would become straight lines.
const CLEAREST: f64 = 1e-3;

/// Admittance and what is returned of a half space, for light that goes down at `cos` above 0. A vacuum returns nothing.
/// Twin: `strata.wgsl`.
pub fn below_all(sigma_a: f64, sigma_s_prime: f64, cos: f64) -> [f64; 2] {
    let q = admittance(sigma_a, sigma_s_prime);
    let sigma_t_prime = (sigma_a + sigma_s_prime).max(f64::MIN_POSITIVE);
    [q, sigma_s_prime / sigma_t_prime / (1.0 + 3f64.sqrt() * q * cos)]
}

/// The same of a layer of this thickness on top of what has `q` and `returned`. Twin: `strata.wgsl`.
pub fn on_top(sigma_a: f64, sigma_s_prime: f64, thickness: f64, cos: f64, q: f64, returned: f64) -> [f64; 2] {
    let own = admittance(sigma_a, sigma_s_prime);
    let tau = (sigma_a + sigma_s_prime) * thickness;
    // In the layer P is e^(-k z) and what the layer's end reflects of it.
    let k = 3f64.sqrt() * own * tau;
    let reflected = (own - q) / (own + q);
    let down = tau / cos;
    let there_and_back = reflected * (-2.0 * k).exp();
    let at_top = 1.0 + there_and_back;
    let scattered = sigma_s_prime * thickness / cos;
    let within = scattered * (mean_exp(0.0, down + k) + reflected * mean_exp(2.0 * k, down + k)) / at_top;
    let through = (-down - k).exp() * (1.0 + reflected) / at_top;
    [own * (1.0 - there_and_back) / at_top, within + through * returned]
}

/// The admittance of a half space: that of a vacuum is 1. Twin: `strata.wgsl`.
pub fn admittance(sigma_a: f64, sigma_s_prime: f64) -> f64 {
    let sigma_t_prime = sigma_a + sigma_s_prime;
    if sigma_t_prime > 0.0 { (sigma_a / sigma_t_prime).sqrt().max(CLEAREST) } else { 1.0 }
}

/// The mean of e^-x for x from `a` to `b`, both 0 or more. Twin: `strata.wgsl`.
pub fn mean_exp(a: f64, b: f64) -> f64 {
    let x = (b - a).abs();
    if x == 0.0 { (-a).exp() } else { (-a.min(b)).exp() * -(-x).exp_m1() / x }
}

/// b of a boundary of relative index `ior`: of what diffuses to the surface, 1/(1 + b q) leaves.
pub fn boundary(ior: f64) -> f64 {
    let leaving = diffuse_transmittance(ior) / (ior * ior);
    2.0 * (1.0 + 3.0 * fresnel_moment(2, ior)) / leaving / 3f64.sqrt()
}

/// What diffusion's albedo of a half space of admittance `q` is to be multiplied with to be exact, for light that came in
/// at each of these cosines *outside*, above a boundary of relative index `ior`, 1 or more: at most 1.
pub fn correction(q: f64, ior: f64, cosines: &[f64]) -> Vec<f64> {
    // Where nothing scatters both albedos are 0.
    let q = q.clamp(CLEAREST, 0.999);
    let inside: Vec<f64> = cosines.iter().map(|cos| below_surface(*cos, ior)).collect();
    let exact = HalfSpace::new(ior).albedos_from(q * q, &inside);
    let leaves = 1.0 / (1.0 + boundary(ior) * q);
    let diffused = |cos: f64| leaves * below_all(q * q, 1.0 - q * q, cos)[1];
    inside.iter().zip(exact).map(|(cos, exact)| (exact / diffused(*cos)).min(1.0)).collect()
}

fn below_surface(cos: f64, ior: f64) -> f64 {
    refracted_cosine(cos, ior).expect("a denser medium refracts every ray")
}

/// Of light that came into a half space without absorption at the cosine `cos` *outside*, the share that leaves again after
/// it was scattered once. `bend` is the index by which rays are bent, `ior` that by which the boundary reflects.
pub fn single(phase: Phase, parameter: f64, ior: f64, bend: f64, cos: f64) -> f64 {
    let below = |angle: f64| (angle.sin() / bend).atan2(below_surface(angle.cos(), bend));
    let came = cos.acos();
    let into = below(came);
    let towards = |(angle, weight): (f64, f64)| {
        let (sin, cos) = angle.sin_cos();
        let out = below(angle);
        let scattered = phase.around(into, out, parameter) / (into.cos() + out.cos());
        weight * sin * cos * (1.0 - fresnel_dielectric(cos, ior)) / (bend * bend) * scattered
    };
    // Light that scatters straight back leaves where it came from, and light that goes on, where it comes near the surface.
    let width = (1.0 - parameter.abs()).min(FINEST);
    let middle = 0.5 * (came + 0.5 * PI);
    let ranges = [(came, 0.0), (came, middle), (0.5 * PI, middle)];
    ranges.into_iter().flat_map(|(peak, far)| halving(peak, far, width)).map(towards).sum()
}

/// Rad: what of a rule is as fine even where light scatters evenly, since light that grazes changes fast with its angle.
const FINEST: f64 = 0.05;

/// Of light that half spaces of admittance `q` send back after more than one isotropic event, and would send back all of
/// without absorption, the share that they do send back: for light that came in at each of these cosines *outside*, above a
/// boundary of relative index `ior`, 1 or more. Above 0 and at most 1.
pub fn survival(q: f64, ior: f64, cosines: &[f64]) -> Vec<f64> {
    let q = q.clamp(CLEAREST, 0.999);
    let inside: Vec<f64> = cosines.iter().map(|cos| below_surface(*cos, ior)).collect();
    let albedos = HalfSpace::new(ior).albedos_from(q * q, &inside);
    let survives = |(cos, all): (&f64, f64)| {
        let once = single(Phase::HenyeyGreenstein, 0.0, ior, ior, *cos);
        (all - (1.0 - q * q) * once) / (1.0 - once)
    };
    cosines.iter().zip(albedos).map(survives).collect()
}

/// Of light that comes back, `all` by diffusion, the share that was scattered more than once: `once` comes back after one
/// event, and `once_white` would without absorption; `survival` is that of the admittance.
///
/// All less once would be below 0 where similarity, to which only the mean cosine of a phase function is known, makes light
/// of one event out to be more than all: where much is scattered straight back, or on along a surface that is grazed. So
/// diffusion says how much comes back, and events how that is shared out. Exact for isotropic half spaces and for white ones.
/// Twin: `strata.wgsl`.
pub fn often(all: f64, once: f64, once_white: f64, survival: f64) -> f64 {
    let more = (1.0 - once_white) * survival;
    all * more / (once + more)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg64Mcg;
    use rand_pcg::rand_core::Rng;

    /// sigma_a, sigma_s', and where it ends.
    type Layer = (f64, f64, f64);

    fn diffused(layers: &[Layer], ior: f64, cos: f64) -> (f64, f64) {
        let inside = below_surface(cos, ior);
        let (&(sigma_a, sigma_s, _), above) = layers.split_last().unwrap();
        let mut level = below_all(sigma_a, sigma_s, inside);
        for (i, &(sigma_a, sigma_s, end)) in above.iter().enumerate().rev() {
            let start = if i > 0 { layers[i - 1].2 } else { 0.0 };
            level = on_top(sigma_a, sigma_s, end - start, inside, level[0], level[1]);
        }
        (level[0], level[1] / (1.0 + boundary(ior) * level[0]))
    }

    fn albedo(layers: &[Layer], ior: f64, cos: f64) -> f64 {
        let (q, diffused) = diffused(layers, ior, cos);
        diffused * correction(q, ior, &[cos])[0]
    }

    /// The share of random walks that leave, and of those that do so after one event. Light scatters with the mean cosine `g`,
    /// as often as the second number of a layer says.
    fn walked(layers: &[Layer], g: f64, ior: f64, cos: f64) -> (f64, f64) {
        let mut random = Pcg64Mcg::new(7);
        let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        const WALKS: usize = 40_000;
        let (mut all, mut once) = (0.0, 0.0);
        for _ in 0..WALKS {
            let (mut z, mut cos, mut weight, mut events, mut i) = (0.0, below_surface(cos, ior), 1.0, 0, 0);
            let mut left = -(1.0 - uniform()).ln();
            while weight > 1e-4 {
                let (sigma_a, sigma_s, end) = layers[i];
                let start = if i > 0 { layers[i - 1].2 } else { 0.0 };
                let sigma_t = sigma_a + sigma_s;
                let to_end = (if cos > 0.0 { end } else { start } - z) / cos;
                if left < to_end * sigma_t {
                    z += cos * left / sigma_t;
                    (weight, events) = (weight * sigma_s / sigma_t, events + 1);
                    let (turn, around) = (-Phase::HenyeyGreenstein.sample(uniform(), g), (PI * uniform()).cos());
                    let sines = ((1.0 - turn * turn) * (1.0 - cos * cos)).max(0.0).sqrt();
                    (cos, left) = (cos * turn + sines * around, -(1.0 - uniform()).ln());
                    continue;
                }
                left -= to_end * sigma_t;
                if cos > 0.0 {
                    (z, i) = (end, i + 1);
                } else if i > 0 {
                    (z, i) = (start, i - 1);
                } else if uniform() < fresnel_dielectric(-cos, 1.0 / ior) {
                    (z, cos) = (0.0, -cos);
                } else {
                    all += weight;
                    once += if events == 1 { weight } else { 0.0 };
                    break;
                }
            }
        }
        (all / WALKS as f64, once / WALKS as f64)
    }

    const INF: f64 = f64::INFINITY;

    #[test]
    fn walks_through_stacks_come_back_as_it_says() {
        let stacks: [&[Layer]; 4] = [
            &[(0.6, 1.66, 0.5), (0.6, 3.6, 1.0), (0.6, 2.0, INF)],
            &[(0.05, 1.2, 0.1), (0.06, 1.9, 0.4), (2.4, 0.24, 0.6), (0.25, 1.8, INF)],
            &[(0.1, 0.9, 0.05), (2.6, 6.3, 0.15), (0.5, 8.4, INF)],
            &[(0.02, 0.05, 0.5), (0.1, 4.0, INF)],
        ];
        for (ior, cos) in [(1.0, 1.0), (1.0, 0.2), (1.4, 1.0), (1.4, 0.3)] {
            for layers in stacks {
                let (truth, _) = walked(layers, 0.0, ior, cos);
                let ours = albedo(layers, ior, cos);
                println!("index {ior} cosine {cos}: {truth:.4} walked, {ours:.4} diffused");
                assert!((ours / truth - 1.0).abs() < 0.12, "index {ior}, cosine {cos}, {layers:?}: {ours} {truth}");
                // Teeth: the same without its first layer, where that is not thin.
                let is_thin = (layers[0].0 + layers[0].1) * layers[0].2 < 0.2;
                let bare: Vec<Layer> = layers[1..].iter().map(|l| (l.0, l.1, l.2 - layers[0].2)).collect();
                assert!(is_thin || (albedo(&bare, ior, cos) / ours - 1.0).abs() > 0.015);
            }
        }
    }

    #[test]
    fn a_half_space_is_exact_and_layers_of_one_medium_are_one() {
        let medium = |end: f64| (0.3, 1.2, end);
        for ior in [1.0, 1.33, 1.5] {
            let exact = crate::optics::half_space::albedo_normal(0.8, ior);
            for layers in [&[medium(INF)][..], &[medium(0.4), medium(INF)], &[medium(1e-9), medium(2.0), medium(INF)]] {
                assert!((albedo(layers, ior, 1.0) - exact).abs() < 1e-9, "{ior}");
            }
            let two = [(0.1, 1.0, 0.3), (0.0, 2.0, 0.9), medium(INF)];
            let split = [(0.1, 1.0, 0.3), (0.0, 2.0, 0.5), (0.0, 2.0, 0.9), medium(INF)];
            assert!((albedo(&two, ior, 0.7) - albedo(&split, ior, 0.7)).abs() < 1e-9);
            assert!((albedo(&two, ior, 0.7) - albedo(&two[1..], ior, 0.7)).abs() > 1e-3);
        }
    }

    #[test]
    fn nothing_is_made_whatever_the_stack() {
        let cosines: Vec<f64> = (0..=16).map(|i| f64::from(i) / 16.0).collect();
        for ior in [1.0, 1.2, 1.5, 4.0] {
            for q in [0.0, 0.01, 0.2, 0.7, 1.0] {
                let corrections = correction(q, ior, &cosines);
                assert!(corrections.iter().all(|c| (0.2..=1.0).contains(c)), "{ior} {q}: {corrections:?}");
            }
        }
        for a in [0.0, 1e-9, 0.1, 1e6] {
            for s in [0.0, 1e-9, 0.5, 1e6] {
                for d in [0.0, 1e-9, 1.0, 1e6] {
                    for (q, returned) in [(0.001, 0.99), (0.3, 0.4), (1.0, 0.0)] {
                        let [q, returned] = on_top(a, s, d, 0.4, q, returned);
                        let rounded = 0.0..=1.0 + 1e-12;
                        assert!(rounded.contains(&q) && rounded.contains(&returned), "{a} {s} {d}: {q} {returned}");
                    }
                }
            }
        }
    }

    #[test]
    fn light_scattered_once_has_its_closed_form_and_that_of_walks() {
        let isotropic = |mu: f64| 0.5 * (1.0 - mu * (1.0 + 1.0 / mu).ln());
        for mu in [1e-3, 0.05, 0.3, 1.0] {
            let found = single(Phase::HenyeyGreenstein, 0.0, 1.0, 1.0, mu);
            assert!((found - isotropic(mu)).abs() < 1e-6, "{mu}: {found}");
        }
        let (_, once) = walked(&[(0.1, 0.9, INF)], 0.0, 1.4, 0.5);
        let found = 0.9 * single(Phase::HenyeyGreenstein, 0.0, 1.4, 1.4, 0.5);
        assert!((found - once).abs() < 5e-3, "{found} {once}");
        // What scatters forwards does not come back.
        let forward = single(Phase::Schlick, 0.8, 1.4, 1.4, 0.5);
        assert!(forward < 0.5 * found);
    }

    #[test]
    fn light_scattered_once_straight_back_leaves_where_it_came_from_and_none_that_goes_on() {
        for phase in [Phase::HenyeyGreenstein, Phase::Schlick] {
            for (ior, bend) in [(1.0, 1.0), (1.4, 1.4), (1.4, 1.0)] {
                for cos in [0.1, 0.5, 0.99, 1.0] {
                    // Half of it scatters again on its way out.
                    let straight = 0.5 * (1.0 - fresnel_dielectric(cos, ior));
                    for g in [0.9999, 1.0 - 1e-7] {
                        let [back, on] = [-g, g].map(|g| single(phase, phase.parameter(g), ior, bend, cos));
                        let bound = 20.0 * (1.0 - g).sqrt();
                        assert!((back - straight).abs() < bound, "{phase:?} {ior} {bend} {cos} {g}: {back} {straight}");
                        assert!((0.0..bound).contains(&on), "{phase:?} {ior} {bend} {cos} {g}: {on}");
                    }
                }
            }
        }
    }

    /// More than one event in a half space of single-scattering albedo `alpha` and mean cosine `g`: the share that comes back
    /// by diffusion, by one event and, of the first, by more.
    fn shared(alpha: f64, g: f64, ior: f64, cos: f64) -> [f64; 3] {
        let medium = [(1.0 - alpha, alpha * (1.0 - g), INF)];
        let (q, _) = diffused(&medium, ior, cos);
        let all = albedo(&medium, ior, cos);
        let white = single(Phase::HenyeyGreenstein, g, ior, ior, cos);
        [all, alpha * white, often(all, alpha * white, white, survival(q, ior, &[cos])[0])]
    }

    #[test]
    fn light_scattered_often_is_that_of_walks_where_one_event_is_more_than_all_of_diffusion() {
        let (mut ours, mut differences) = (0.0, 0.0);
        for (ior, cos) in [(1.0, 1.0), (1.0, 0.1), (1.4, 1.0), (1.4, 0.3)] {
            for g in [-0.5, 0.0, 0.5, 0.8] {
                for alpha in [0.5, 0.95] {
                    let (all, once) = walked(&[(1.0 - alpha, alpha, INF)], g, ior, cos);
                    let [by_diffusion, by_one, found] = shared(alpha, g, ior, cos);
                    let truth = all - once;
                    println!(
                        "index {ior} cosine {cos} g {g} albedo {alpha}: {truth:.4} walked, {found:.4} shared out, {:.4} left",
                        by_diffusion - by_one
                    );
                    // Light that grazes and goes on comes back in ways that no mean cosine tells.
                    let bound = if cos == 0.1 { 0.15 } else { 0.045 };
                    assert!(
                        (found - truth).abs() < bound,
                        "index {ior}, cosine {cos}, g {g}, {alpha}: {found} {truth}"
                    );
                    assert!(g != 0.0 || (found - truth).abs() < 0.01, "isotropic: {found} {truth}");
                    ours += (found - truth).abs();
                    differences += ((by_diffusion - by_one).max(0.0) - truth).abs();
                }
            }
        }
        println!("summed errors: {ours:.3}, of differences {differences:.3}");
        assert!(ours < differences);
        // One event is more than all of diffusion: their difference is no light.
        for (alpha, g, cos) in [(0.5, -0.9, 1.0), (0.5, 0.9, 0.02)] {
            let [all, once, found] = shared(alpha, g, 1.0, cos);
            assert!(all < 0.9 * once && found > 0.0, "{all} {once} {found}");
        }
    }

    #[test]
    fn light_scattered_often_is_a_share_of_all_light_whatever_the_stack() {
        let media = [(0.0, 1e-6), (1e-6, 1.0), (0.5, 0.0), (0.5, 0.5), (1e3, 1.0), (0.0, 1e3)];
        let phases = [
            (Phase::HenyeyGreenstein, -0.999999),
            (Phase::Schlick, -0.9999),
            (Phase::HenyeyGreenstein, -0.95),
            (Phase::HenyeyGreenstein, 0.0),
            (Phase::Schlick, 0.95),
        ];
        for (ior, (phase, g)) in [1.0, 1.4].into_iter().flat_map(|ior| phases.map(|of| (ior, of))) {
            let cosines = [0.0, 0.1, 0.5, 1.0];
            for cos in cosines {
                let white = single(phase, phase.parameter(g), ior, ior, cos);
                assert!((0.0..=0.5).contains(&white), "{ior} {phase:?} {g} {cos}: {white}");
                for (upper, lower) in media.iter().flat_map(|upper| media.map(|lower| (*upper, lower))) {
                    for thickness in [0.0, 1e-3, 1.0] {
                        let reduced = |(a, s): (f64, f64), end| (a, s * (1.0 - g), end);
                        let layers = [reduced(upper, thickness), reduced(lower, INF)];
                        let (q, diffused) = diffused(&layers, ior, cos.max(1e-4));
                        let all = diffused * correction(q, ior, &[cos])[0];
                        let lives = survival(q, ior, &[cos])[0];
                        assert!(lives > 0.0 && lives <= 1.0 + 1e-9, "{q} {ior} {cos}: {lives}");
                        for (a, s) in [upper, lower] {
                            let found = often(all, s / (a + s) * white, white, lives);
                            assert!(
                                (0.0..=all * (1.0 + 1e-12)).contains(&found),
                                "{layers:?} {ior} {g} {cos}: {found} of {all}"
                            );
                        }
                    }
                }
            }
        }
    }
}
