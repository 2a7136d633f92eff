//! Where light comes from: lamps without extent, area lights, and the surroundings.

use super::random::Random;
use crate::image::Texture;
use crate::optics::Rgb;
use glam::{DVec2, DVec3, Vec3};
use serde::Serialize;
use std::f64::consts::PI;
use std::sync::Arc;

/// A light of the scene that shines.
#[derive(Clone, Debug, Serialize)]
pub struct Lamp {
    pub kind: Kind,
    /// Whether things are in its way.
    pub shadow: bool,
}

#[derive(Clone, Debug, Serialize)]
pub enum Kind {
    /// Irradiance on a plane that faces it.
    Directional {
        direction: DVec3,
        irradiance: Rgb,
    },
    Point {
        position: DVec3,
        intensity: Rgb,
    },
    Rect {
        center: DVec3,
        u: DVec3,
        v: DVec3,
        radiance: Rgb,
    },
}

/// Light from a lamp at a point: where from, how far away, and how much of it.
pub struct Ray {
    /// Towards the lamp.
    pub direction: DVec3,
    pub distance: f64,
    /// Irradiance on a plane that faces it; for a lamp with extent, radiance over the density of `direction`.
    pub irradiance: Rgb,
    /// The density of `direction`, 1/sr; none for a lamp without extent.
    pub density: Option<f64>,
}

impl Lamp {
    /// Light of a lamp without extent that reaches `p`; none for one with extent.
    pub fn ray(&self, p: DVec3) -> Option<Ray> {
        match self.kind {
            Kind::Directional { direction, irradiance } => {
                Some(Ray { direction: -direction, distance: f64::INFINITY, irradiance, density: None })
            }
            Kind::Point { position, intensity } => {
                let to = position - p;
                let irradiance = intensity / to.length_squared();
                Some(Ray { direction: to.normalize(), distance: to.length(), irradiance, density: None })
            }
            Kind::Rect { .. } => None,
        }
    }

    /// The direction from `p` to the lamp, or to the middle of one with extent.
    pub fn middle(&self, p: DVec3) -> DVec3 {
        match self.kind {
            Kind::Directional { direction, .. } => -direction,
            Kind::Point { position, .. } => (position - p).normalize(),
            Kind::Rect { center, .. } => (center - p).normalize(),
        }
    }

    /// Light that reaches `p`; none from the dark side of an area light.
    pub fn sample(&self, p: DVec3, random: &mut Random) -> Option<Ray> {
        let Kind::Rect { center, u, v, radiance } = self.kind else { return self.ray(p) };
        let (a, b) = random.pair();
        let to = center + (2.0 * a - 1.0) * u + (2.0 * b - 1.0) * v - p;
        let direction = to.normalize();
        let density = rect_density(u, v, to)?;
        Some(Ray { direction, distance: to.length(), irradiance: radiance / density, density: Some(density) })
    }

    /// For an area light that a ray meets at `to` from its start: its radiance, and the density of that direction in
    /// [`Lamp::sample`].
    pub fn radiance(&self, to: DVec3) -> Option<(Rgb, f64)> {
        match self.kind {
            Kind::Rect { u, v, radiance, .. } => Some((radiance, rect_density(u, v, to)?)),
            _ => None,
        }
    }

    /// Where a ray meets the area light if nothing is in its way: the vector there.
    pub fn meet(&self, origin: DVec3, direction: DVec3) -> Option<DVec3> {
        let Kind::Rect { center, u, v, .. } = self.kind else { return None };
        let normal = u.cross(v);
        let t = (center - origin).dot(normal) / direction.dot(normal);
        let at = origin + t * direction - center;
        let on = at.dot(u).abs() <= u.length_squared() && at.dot(v).abs() <= v.length_squared();
        (t > 0.0 && t.is_finite() && on).then_some(t * direction)
    }

    pub fn has_extent(&self) -> bool {
        matches!(self.kind, Kind::Rect { .. })
    }
}

/// 1/sr; none behind the light.
fn rect_density(u: DVec3, v: DVec3, to: DVec3) -> Option<f64> {
    let normal = u.cross(v);
    let cos = -to.dot(normal) / (to.length() * normal.length());
    (cos > 0.0).then(|| to.length_squared() / (4.0 * normal.length() * cos))
}

/// The surroundings: an image around everything, or one colour.
pub struct Sky {
    pub scale: Rgb,
    pub image: Option<SkyImage>,
    pub shadow: bool,
}

pub struct SkyImage {
    texture: Arc<Texture>,
    /// Radians about y.
    rotation: f64,
    /// The running sum of each row's weight, and within each row of each texel's.
    rows: Vec<f64>,
    texels: Vec<f64>,
}

impl SkyImage {
    pub fn new(texture: Arc<Texture>, rotation: f64) -> SkyImage {
        let (width, height) = (texture.width as usize, texture.height as usize);
        let (mut rows, mut texels) = (Vec::with_capacity(height), Vec::with_capacity(width * height));
        let mut total = 0.0;
        for y in 0..height {
            let sin = (PI * (y as f64 + 0.5) / height as f64).sin();
            let mut row = 0.0;
            for x in 0..width {
                // Bilinear lookup spreads a texel over its neighbours: so does the weight, or bright edges would be rare.
                let near = |dx: usize, y: usize| texture.texels[y * width + (x + width + dx - 1) % width];
                let at = [y.saturating_sub(1), y, (y + 1).min(height - 1)];
                let sum: f32 = at
                    .iter()
                    .flat_map(|&y| (0..3).map(move |dx| (dx, y)))
                    .map(|(dx, y)| near(dx, y)[..3].iter().sum::<f32>())
                    .sum();
                row += sin * (sum as f64);
                texels.push(row);
            }
            total += row;
            rows.push(total);
        }
        SkyImage { texture, rotation, rows, texels }
    }

    /// Longitude and latitude as shares of the image; the centre is -z, +x lies to the right of it.
    fn uv(&self, d: DVec3) -> DVec2 {
        let turned = d.x.atan2(-d.z) + self.rotation;
        DVec2::new((0.5 + turned / (2.0 * PI)).rem_euclid(1.0), d.y.clamp(-1.0, 1.0).acos() / PI)
    }

    /// Bilinear, around in x, as the frame draws it.
    fn radiance(&self, d: DVec3) -> Rgb {
        let (width, height) = (self.texture.width as i64, self.texture.height as i64);
        let uv = self.uv(d);
        let (x, y) = (uv.x * width as f64 - 0.5, uv.y * height as f64 - 0.5);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let at = |dx: i64, dy: i64| {
            let x = (x.floor() as i64 + dx).rem_euclid(width);
            let y = (y.floor() as i64 + dy).clamp(0, height - 1);
            let [r, g, b, _] = self.texture.texels[(y * width + x) as usize];
            Vec3::new(r, g, b).as_dvec3()
        };
        (1.0 - fy) * ((1.0 - fx) * at(0, 0) + fx * at(1, 0)) + fy * ((1.0 - fx) * at(0, 1) + fx * at(1, 1))
    }

    fn density(&self, d: DVec3) -> f64 {
        let (width, height) = (self.texture.width as usize, self.texture.height as usize);
        let total = *self.rows.last().expect("an image has rows");
        if total == 0.0 {
            return 0.0;
        }
        let uv = self.uv(d);
        let x = ((uv.x * width as f64) as usize).min(width - 1);
        let y = ((uv.y * height as f64) as usize).min(height - 1);
        let row = &self.texels[y * width..(y + 1) * width];
        let weight = row[x] - if x > 0 { row[x - 1] } else { 0.0 };
        let sin = (PI * uv.y).sin();
        let texel = 2.0 * PI * PI * sin / (width * height) as f64;
        if texel == 0.0 { 0.0 } else { weight / total / texel }
    }

    fn sample(&self, random: &mut Random) -> Option<DVec3> {
        let (width, height) = (self.texture.width as usize, self.texture.height as usize);
        let total = *self.rows.last().expect("an image has rows");
        if total == 0.0 {
            return None;
        }
        let (in_all, in_row) = random.pair();
        let y = self.rows.partition_point(|sum| *sum <= in_all * total).min(height - 1);
        let row = &self.texels[y * width..(y + 1) * width];
        let x = row.partition_point(|sum| *sum <= in_row * row[width - 1]).min(width - 1);
        let (a, b) = random.pair();
        let theta = PI * (y as f64 + b) / height as f64;
        let phi = 2.0 * PI * ((x as f64 + a) / width as f64 - 0.5) - self.rotation;
        Some(DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos()))
    }
}

impl Sky {
    pub fn radiance(&self, d: DVec3) -> Rgb {
        self.image.as_ref().map_or(self.scale, |image| self.scale * image.radiance(d))
    }

    /// The density of [`Sky::sample`]; 0 for an even sky, which nothing but the surface's own lobe need sample.
    pub fn density(&self, d: DVec3) -> f64 {
        self.image.as_ref().map_or(0.0, |image| image.density(d))
    }

    pub fn sample(&self, random: &mut Random) -> Option<Ray> {
        let direction = self.image.as_ref()?.sample(random)?;
        let density = self.density(direction);
        (density > 0.0).then(|| Ray {
            direction,
            distance: f64::INFINITY,
            irradiance: self.radiance(direction) / density,
            density: Some(density),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sky(f: impl Fn(u32, u32) -> f32) -> SkyImage {
        let texels = (0..8).flat_map(|y| (0..16).map(move |x| (x, y))).map(|(x, y)| [f(x, y), 0.5 * f(x, y), 0.0, 1.0]);
        SkyImage::new(Arc::new(Texture { width: 16, height: 8, texels: texels.collect() }), 0.4)
    }

    /// The integral of the sky by uniform directions and by its own samples.
    #[test]
    fn a_sky_is_sampled_by_its_brightness() {
        let image = sky(|x, y| if (x, y) == (3, 2) { 50.0 } else { 0.1 * y as f32 });
        let sky = Sky { scale: Rgb::ONE, image: Some(image), shadow: true };
        let mut random = Random::new(1, 1, 1);
        let n = 200_000;
        let (mut even, mut own, mut mass) = (Rgb::ZERO, Rgb::ZERO, 0.0);
        for _ in 0..n {
            let (z, phi) = (2.0 * random.unit() - 1.0, 2.0 * PI * random.unit());
            let d = DVec3::new((1.0 - z * z).sqrt() * phi.cos(), z, (1.0 - z * z).sqrt() * phi.sin());
            even += sky.radiance(d) * 4.0 * PI / n as f64;
            mass += sky.density(d) * 4.0 * PI / n as f64;
            own += sky.sample(&mut random).unwrap().irradiance / n as f64;
        }
        assert!((mass - 1.0).abs() < 0.02, "{mass}");
        assert!((own / even - 1.0).abs().max_element() < 0.1 || own.z == 0.0, "{own} {even}");
        assert!((own.x / even.x - 1.0).abs() < 0.03, "{own} {even}");
    }

    #[test]
    fn an_area_light_is_met_where_it_is_and_shines_to_one_side() {
        let kind = Kind::Rect { center: DVec3::Y, u: 0.5 * DVec3::Z, v: 0.5 * DVec3::X, radiance: Rgb::ONE };
        let up = Lamp { kind, shadow: true };
        // cross(z, x) = y: it shines upwards.
        assert!(up.sample(DVec3::ZERO, &mut Random::new(0, 0, 0)).is_none());
        let above = DVec3::new(0.2, 3.0, 0.0);
        let mut random = Random::new(0, 0, 1);
        let n = 20_000;
        // The irradiance of a square from straight above it, and by directions.
        let sum: f64 = (0..n)
            .filter_map(|_| up.sample(above, &mut random))
            .map(|ray| ray.irradiance.x * -ray.direction.y / n as f64)
            .sum();
        let mut by_directions = 0.0;
        for _ in 0..20 * n {
            let (z, phi) = (random.unit(), 2.0 * PI * random.unit());
            let d = DVec3::new((1.0 - z * z).sqrt() * phi.cos(), -z, (1.0 - z * z).sqrt() * phi.sin());
            by_directions += if up.meet(above, d).is_some() { z * 2.0 * PI / (20 * n) as f64 } else { 0.0 };
        }
        assert!((sum / by_directions - 1.0).abs() < 0.02, "{sum} {by_directions}");
    }
}
