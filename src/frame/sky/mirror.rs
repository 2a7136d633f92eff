//! The sky as smooth and rough things mirror it.

use super::{sample, sky_direction};
use crate::gpu::{Format, Gpu, Images, Shape};
use crate::image::Texture;
use crate::problem::Problem;
use crate::store::{Bake, Run, Slot, Step};
use glam::{DVec3, Vec3};
use half::f16;
use rayon::prelude::*;
use serde::Serialize;
use std::f64::consts::PI;

/// An image on the device, as halves.
#[derive(Serialize)]
pub(super) struct SkyImage {
    pub image: Slot<Texture>,
}

impl Step for SkyImage {
    type Output = Images;
    fn name(&self) -> &'static str {
        "sky.image"
    }
    fn about(&self) -> String {
        "the sky's image, to the device".into()
    }
    fn run(&self, run: &Run) -> Result<Images, Problem> {
        let image = run.get(self.image);
        let halves: Vec<[f16; 4]> = image.texels.iter().map(|texel| texel.map(half_of)).collect();
        let shape = Shape::flat((image.width, image.height), Format::Rgba16Float);
        Ok(Images(vec![run.host::<Gpu>().texture_with(shape, bytemuck::cast_slice(&halves))]))
    }
}

/// The brightest half stands in for what is brighter: a sun in a sky's image.
fn half_of(value: f32) -> f16 {
    f16::from_f32(value.min(f16::MAX.to_f32()))
}

/// The sky blurred by the lobes of five roughnesses, 0.2 to 1 [Karis2013]: 128 x 64 each.
#[derive(Serialize)]
pub(super) struct SkyBlurred {
    pub image: Slot<Texture>,
}

const BLURRED: (u32, u32) = (128, 64);

impl Step for SkyBlurred {
    type Output = Vec<Vec3>;
    fn name(&self) -> &'static str {
        "sky.blurred"
    }
    fn about(&self) -> String {
        "the sky as five roughnesses mirror it".into()
    }
    fn run(&self, run: &Run) -> Result<Vec<Vec3>, Problem> {
        let image = run.get(self.image);
        let mut all = Vec::new();
        for level in 1..=5u32 {
            let alpha = (0.2 * level as f64).powi(2);
            // A narrow lobe needs a fine image, a wide one few texels: noise comes from texels between samples.
            let small = shrunk(&image, 512 >> level);
            let texels: Vec<Vec3> = (0..BLURRED.0 * BLURRED.1)
                .into_par_iter()
                .map(|i| {
                    let theta = PI * ((i / BLURRED.0) as f64 + 0.5) / BLURRED.1 as f64;
                    lobe_mean(&small, sky_direction(i % BLURRED.0, theta, BLURRED.0, 0.0), alpha).as_vec3()
                })
                .collect();
            all.extend(texels);
            run.tick(level as f64 / 5.0)?;
        }
        Ok(all)
    }
}

impl Bake for SkyBlurred {
    const CODE: &'static [&'static str] = &["src/frame/sky/"];
}

/// The mean of the sky over a GGX lobe seen head on: 256 samples of its half vectors, weighted by the cosine.
fn lobe_mean(sky: &Texture, normal: DVec3, alpha: f64) -> DVec3 {
    let (a, b) = normal.any_orthonormal_pair();
    let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
    for i in 0..256u32 {
        let (u, v) = ((i as f64 + 0.5) / 256.0, i.reverse_bits() as f64 / 4294967296.0);
        let cos = ((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u)).sqrt();
        let sin = (1.0 - cos * cos).sqrt();
        let (sin_phi, cos_phi) = (2.0 * PI * v).sin_cos();
        let half = sin * cos_phi * a + sin * sin_phi * b + cos * normal;
        let direction = 2.0 * half.dot(normal) * half - normal;
        let w = direction.dot(normal);
        if w > 0.0 {
            sum += w * sample(sky, direction, 0.0);
            weight += w;
        }
    }
    sum / weight
}

/// An image of at most `width`, each texel the mean of what it covers, by solid angle along a row being constant.
fn shrunk(image: &Texture, width: u32) -> Texture {
    let width = width.min(image.width);
    let height = (width / 2).max(1).min(image.height);
    let range = |i: u32, to: u32, from: u32| {
        (i as u64 * from as u64 / to as u64)..((i as u64 + 1) * from as u64).div_ceil(to as u64)
    };
    let texels = (0..width * height)
        .into_par_iter()
        .map(|i| {
            let (mut sum, mut n) = ([0.0f64; 4], 0.0);
            for y in range(i / width, height, image.height) {
                for x in range(i % width, width, image.width) {
                    let texel = image.texels[(y * image.width as u64 + x) as usize];
                    sum = std::array::from_fn(|c| sum[c] + texel[c] as f64);
                    n += 1.0;
                }
            }
            sum.map(|v| (v / n) as f32)
        })
        .collect();
    Texture { width, height, texels }
}

#[derive(Serialize)]
pub(super) struct UploadBlurred {
    pub texels: Slot<Vec<Vec3>>,
}

impl Step for UploadBlurred {
    type Output = Images;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        "the blurred skies to the device".into()
    }
    fn run(&self, run: &Run) -> Result<Images, Problem> {
        let halves: Vec<[f16; 4]> =
            run.get(self.texels).iter().map(|t| [half_of(t.x), half_of(t.y), half_of(t.z), f16::ONE]).collect();
        let shape = Shape::array(BLURRED, 5, Format::Rgba16Float);
        Ok(Images(vec![run.host::<Gpu>().texture_with(shape, bytemuck::cast_slice(&halves))]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blurring_keeps_a_constant_and_halves_mirror_a_half_sky() {
        let sky = |f: fn(u32) -> f32| Texture {
            width: 64,
            height: 32,
            texels: (0..32).flat_map(|y| vec![[f(y), 1.0, 0.0, 1.0]; 64]).collect(),
        };
        let even = sky(|_| 3.0);
        assert!((lobe_mean(&even, DVec3::new(0.6, 0.8, 0.0), 0.5) - DVec3::new(3.0, 1.0, 0.0)).length() < 1e-6);
        let upper = sky(|y| (y < 16) as u32 as f32);
        assert!(lobe_mean(&upper, DVec3::Y, 0.04).x > 0.99);
        assert!((lobe_mean(&upper, DVec3::X, 0.3).x - 0.5).abs() < 0.05);
    }
}
