//! The surroundings: what they send to each vertex through the gaps that the objects leave, and what is mirrored of them.
//!
//! Rays in 256 directions say, once per rigid arrangement, where each vertex sees out; that is one bit per direction, 32
//! bytes a vertex, kept on disk. The light from the visible directions is then summed up on the device for whatever
//! normal a technique hands over, so that editing the sky, the material or the normals casts no ray. What deforms sees the
//! whole sky and hides none of it: `explain` says so.

use super::{Frame, Item, shape, tables};
use crate::geometry::bvh::Bvh;
use crate::geometry::mesh::Mesh;
use crate::geometry::visibility::{directions, visibility};
use crate::gpu::{Bind, Buffer, Compute, Format, Gpu, Images, Sampler, Shape};
use crate::image::Texture;
use crate::optics::microfacet;
use crate::problem::Problem;
use crate::scene::{LightKind, Sky, TextureMap};
use crate::store::{Bake, Key, Plan, Run, Slot, Step};
use glam::{DAffine3, DMat4, DVec3, Vec3};
use half::f16;
use rayon::prelude::*;
use serde::Serialize;
use std::f64::consts::PI;

/// Directions in which the sky is looked for.
const DIRECTIONS: usize = 256;

/// What a pass that looks at the sky needs: flags and bindings of `frame/sky.wgsl`.
pub(super) struct SkyBinds {
    pub flags: Vec<&'static str>,
    pub binds: Vec<(&'static str, Bind)>,
}

/// The surroundings of a scene, planned.
pub(super) struct Surroundings {
    radiance: DVec3,
    rotation: f64,
    image: Option<Slot<Texture>>,
    /// Whether objects are in its way.
    shadow: bool,
}

/// Where one vertex after another sees out: 8 words of 32 directions each.
#[derive(Serialize)]
struct SkyVisibility {
    mesh: Slot<Mesh>,
    world_from_object: DAffine3,
    occluders: Vec<(Slot<Mesh>, DAffine3)>,
}

impl Step for SkyVisibility {
    type Output = Vec<u32>;
    fn name(&self) -> &'static str {
        "sky.visibility"
    }
    fn about(&self) -> String {
        format!("where each vertex sees past {} thing(s), by {DIRECTIONS} rays", self.occluders.len())
    }
    fn run(&self, run: &Run) -> Result<Vec<u32>, Problem> {
        let meshes: Vec<_> = self.occluders.iter().map(|(mesh, at)| (run.get(*mesh), *at)).collect();
        let bvh = Bvh::new(&meshes.iter().map(|(mesh, at)| (mesh.as_ref(), *at)).collect::<Vec<_>>());
        let mesh = run.get(self.mesh).transformed(&self.world_from_object);
        visibility(&mesh.positions, &mesh.normals, &bvh, DIRECTIONS, &|share| run.tick(share))
    }
}

impl Bake for SkyVisibility {
    const CODE: &'static [&'static str] = &["src/geometry/", "src/frame/sky.rs"];
}

/// Texels around the horizon at which each of the directions has hundreds.
const FINE: u32 = 512;

/// The mean radiance of an image around each of the directions.
#[derive(Serialize)]
struct SkyCells {
    image: Slot<Texture>,
    rotation: f64,
}

impl Step for SkyCells {
    type Output = Vec<Vec3>;
    fn name(&self) -> &'static str {
        "sky.cells"
    }
    fn about(&self) -> String {
        format!("the sky's mean radiance around {DIRECTIONS} directions")
    }
    fn run(&self, run: &Run) -> Result<Vec<Vec3>, Problem> {
        let image = run.get(self.image);
        let centres: Vec<Vec3> = directions(DIRECTIONS).iter().map(|d| d.as_vec3()).collect();
        // A coarse image has few texels around each direction: they are cut up, or a small sun in one of them would shine
        // too much or too little by the number of its neighbours.
        let parts = FINE.div_ceil(image.width);
        let (width, height) = (image.width * parts, image.height * parts);
        let rows: Vec<Vec<(DVec3, f64)>> = (0..height)
            .into_par_iter()
            .map(|y| {
                let mut sums = vec![(DVec3::ZERO, 0.0); DIRECTIONS];
                let theta = PI * (y as f64 + 0.5) / height as f64;
                for x in 0..width {
                    let direction = sky_direction(x, theta, width, self.rotation).as_vec3();
                    let nearest = (0..DIRECTIONS)
                        .max_by(|a, b| centres[*a].dot(direction).total_cmp(&centres[*b].dot(direction)))
                        .expect("there are directions");
                    let [r, g, b, _] = image.texels[(y / parts * image.width + x / parts) as usize];
                    sums[nearest].0 += theta.sin() * Vec3::new(r, g, b).as_dvec3();
                    sums[nearest].1 += theta.sin();
                }
                sums
            })
            .collect();
        run.tick(0.9)?;
        Ok((0..DIRECTIONS)
            .map(|k| {
                let sum: DVec3 = rows.iter().map(|row| row[k].0).sum();
                let weight: f64 = rows.iter().map(|row| row[k].1).sum();
                match weight > 0.0 {
                    true => (sum / weight).as_vec3(),
                    // The image is so low that its rows miss the direction: the nearest texel serves.
                    false => sample(&image, centres[k].as_dvec3(), self.rotation).as_vec3(),
                }
            })
            .collect())
    }
}

impl Bake for SkyCells {
    const CODE: &'static [&'static str] = &["src/geometry/visibility.rs", "src/frame/sky.rs"];
}

/// The direction of a texel's centre; `shaders/frame/sky.wgsl` has the inverse.
fn sky_direction(x: u32, theta: f64, width: u32, rotation: f64) -> DVec3 {
    let phi = 2.0 * PI * ((x as f64 + 0.5) / width as f64 - 0.5) + rotation;
    DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
}

/// The texel in a direction.
fn sample(image: &Texture, d: DVec3, rotation: f64) -> DVec3 {
    let u = (0.5 + (d.x.atan2(-d.z) - rotation) / (2.0 * PI)).rem_euclid(1.0);
    let v = d.y.clamp(-1.0, 1.0).acos() / PI;
    let x = ((u * image.width as f64) as u32).min(image.width - 1);
    let y = ((v * image.height as f64) as u32).min(image.height - 1);
    let [r, g, b, _] = image.texels[(y * image.width + x) as usize];
    Vec3::new(r, g, b).as_dvec3()
}

/// The directions with their light, on the device.
#[derive(Serialize)]
struct SkyLight {
    radiance: DVec3,
    cells: Option<Slot<Vec<Vec3>>>,
}

impl Step for SkyLight {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "sky.light"
    }
    fn about(&self) -> String {
        format!("light from {DIRECTIONS} directions, to the device")
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let cells = self.cells.map(|slot| run.get(slot));
        let solid_angle = 4.0 * PI / DIRECTIONS as f64;
        let table: Vec<tables::Direction> = directions(DIRECTIONS)
            .into_iter()
            .enumerate()
            .map(|(k, direction)| {
                let cell = cells.as_ref().map_or(DVec3::ONE, |cells| cells[k].as_dvec3());
                tables::Direction {
                    direction: direction.as_vec3(),
                    light: (solid_angle * cell * self.radiance).as_vec3(),
                }
            })
            .collect();
        let mut bytes = encase::StorageBuffer::new(Vec::new());
        bytes.write(&table).expect("a vector can grow");
        Ok(Buffer::new(run.host::<Gpu>(), &bytes.into_inner()))
    }
}

/// Words on the device.
#[derive(Serialize)]
struct UploadWords {
    words: Slot<Vec<u32>>,
}

impl Step for UploadWords {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        "visible directions to the device".into()
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        Ok(Buffer::new(run.host::<Gpu>(), bytemuck::cast_slice(run.get(self.words).as_slice())))
    }
}

/// An image on the device, as halves.
#[derive(Serialize)]
struct SkyImage {
    image: Slot<Texture>,
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
struct SkyBlurred {
    image: Slot<Texture>,
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
    const CODE: &'static [&'static str] = &["src/frame/sky.rs"];
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
struct UploadBlurred {
    texels: Slot<Vec<Vec3>>,
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

/// The glossy lobe's directional albedo at one index, over cosine (along x) and roughness (along y).
#[derive(Serialize)]
struct GlossAlbedo {
    eta: f64,
}

const ALBEDO_TABLE: usize = 32;

impl Step for GlossAlbedo {
    type Output = Vec<f32>;
    fn name(&self) -> &'static str {
        "gloss.albedo"
    }
    fn about(&self) -> String {
        format!("how much a boundary of index {} mirrors, by angle and roughness", self.eta)
    }
    fn run(&self, run: &Run) -> Result<Vec<f32>, Problem> {
        run.tick(0.0)?;
        let table = microfacet::directional_albedo_table(self.eta, ALBEDO_TABLE, ALBEDO_TABLE);
        Ok(table.into_iter().map(|v| v as f32).collect())
    }
}

impl Bake for GlossAlbedo {
    const CODE: &'static [&'static str] = &["src/optics/", "src/frame/sky.rs"];
}

/// One table per item, in their order; an item that mirrors nothing has zeros.
#[derive(Serialize)]
struct UploadAlbedos {
    tables: Vec<Option<Slot<Vec<f32>>>>,
}

impl Step for UploadAlbedos {
    type Output = Images;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        "the tables of gloss to the device".into()
    }
    fn run(&self, run: &Run) -> Result<Images, Problem> {
        let zeros = vec![f16::ZERO; ALBEDO_TABLE * ALBEDO_TABLE];
        let halves: Vec<f16> = self
            .tables
            .iter()
            .flat_map(|table| match table {
                Some(slot) => run.get(*slot).iter().map(|v| f16::from_f32(*v)).collect(),
                None => zeros.clone(),
            })
            .collect();
        let shape =
            Shape::array((ALBEDO_TABLE as u32, ALBEDO_TABLE as u32), self.tables.len() as u32, Format::R16Float);
        Ok(Images(vec![run.host::<Gpu>().texture_with(shape, bytemuck::cast_slice(&halves))]))
    }
}

fn texture_slot(plan: &mut Plan, map: &TextureMap) -> Slot<Texture> {
    plan.given("image.file", map.path.display().to_string(), Key::of(map), map.texture.clone())
}

impl Frame<'_> {
    /// The surroundings that are switched on and not black.
    pub(super) fn surroundings(&self, plan: &mut Plan) -> Option<Surroundings> {
        self.scene.lights.iter().filter(|light| light.enabled).find_map(|light| {
            let LightKind::Environment { sky, scale, rotation_deg } = &light.kind else { return None };
            let (radiance, image) = match sky {
                Sky::Constant(radiance) => (*radiance, None),
                Sky::Image(map) => (DVec3::ONE, Some(texture_slot(plan, map))),
            };
            (radiance * *scale != DVec3::ZERO || !self.view.skip).then(|| Surroundings {
                radiance: radiance * *scale,
                rotation: rotation_deg.to_radians(),
                image,
                shadow: light.shadow,
            })
        })
    }

    fn is_rigid(&self, item: &Item) -> bool {
        self.object(item).is_none_or(|object| object.deform.is_empty())
    }

    /// One bit per vertex and direction, or none where the sky counts as open.
    fn sky_visibility(&self, plan: &mut Plan, item: &Item, surroundings: &Surroundings) -> Option<Slot<Buffer>> {
        if !surroundings.shadow {
            plan.skip("shadows of the surroundings", "shadow: false");
            return None;
        }
        if !self.is_rigid(item) {
            plan.skip(
                format!("where `{}` sees the sky", item.name),
                "it deforms: it sees the whole sky, and hides none of it from others",
            );
            return None;
        }
        let occluders = self
            .items
            .iter()
            .filter(|other| self.is_rigid(other))
            .map(|other| (other.mesh, other.world_from_object))
            .collect();
        let words = plan.bake(SkyVisibility { mesh: item.mesh, world_from_object: item.world_from_object, occluders });
        Some(plan.add(UploadWords { words }))
    }

    fn sky_light(&self, plan: &mut Plan, surroundings: &Surroundings) -> Slot<Buffer> {
        let cells = surroundings.image.map(|image| plan.bake(SkyCells { image, rotation: surroundings.rotation }));
        plan.add(SkyLight { radiance: surroundings.radiance, cells })
    }

    /// The irradiance that enters at each vertex from the surroundings, for a normal each; 16 bytes a vertex.
    pub(super) fn sky_irradiance(
        &self,
        plan: &mut Plan,
        item: &Item,
        normals: Slot<Buffer>,
    ) -> Result<Option<Slot<Buffer>>, Problem> {
        let Some(surroundings) = self.surroundings(plan) else { return Ok(None) };
        let eta = self.material(item).map_or(1.0, |material| material.surface.ior);
        let rotation = DAffine3 { translation: DVec3::ZERO, ..item.world_from_object };
        let vertices = tables::Vertices {
            world_from_object: DMat4::from(rotation).as_mat4(),
            eta: eta as f32,
            words: (DIRECTIONS / 32) as u32,
        };
        let visible = self.sky_visibility(plan, item, &surroundings);
        let mut binds = vec![
            ("vertices", Bind::uniform(&vertices)),
            ("normals", Bind::Buffer(normals)),
            ("directions", Bind::Buffer(self.sky_light(plan, &surroundings))),
        ];
        let mut flags = Vec::new();
        if let Some(visible) = visible {
            flags.push("OCCLUDED");
            binds.push(("visible", Bind::Buffer(visible)));
        }
        Ok(Some(plan.add(Compute {
            name: "frame.environment",
            about: format!("what the surroundings send into each vertex of `{}`", item.name),
            shader: self.shaders.load("frame/environment.wgsl", &flags)?,
            output: ("irradiance", 16),
            over: normals,
            over_stride: 12,
            binds,
        })))
    }

    /// How open the sky is from each vertex, for reflections; none where it counts as open.
    pub(super) fn openness(&self, plan: &mut Plan, item: &Item) -> Result<Option<Slot<Buffer>>, Problem> {
        let Some(surroundings) = self.surroundings(plan) else { return Ok(None) };
        let Some(visible) = self.sky_visibility(plan, item, &surroundings) else { return Ok(None) };
        let over = shape::upload(plan, item.mesh, shape::Stream::Positions);
        let light = self.sky_light(plan, &surroundings);
        Ok(Some(plan.add(Compute {
            name: "frame.openness",
            about: format!("how open the sky is from each vertex of `{}`", item.name),
            shader: self.shaders.load("frame/openness.wgsl", &[])?,
            output: ("openness", 16),
            over,
            over_stride: 12,
            binds: vec![("directions", Bind::Buffer(light)), ("visible", Bind::Buffer(visible))],
        })))
    }

    /// For passes that look at the sky (`blurred`: as rough things mirror it).
    pub(super) fn sky_binds(&self, plan: &mut Plan, blurred: bool) -> Option<SkyBinds> {
        let surroundings = self.surroundings(plan)?;
        let sky = tables::Sky { radiance: surroundings.radiance.as_vec3(), rotation: surroundings.rotation as f32 };
        let mut flags = vec!["ENVIRONMENT"];
        let mut binds = vec![("sky", Bind::uniform(&sky))];
        if let Some(image) = surroundings.image {
            flags.push("SKY_IMAGE");
            binds.push(("sky_image", Bind::Texture(plan.add(SkyImage { image }), 0)));
            binds.push(("around", Bind::Sampler(Sampler::LinearAround)));
            if blurred {
                let texels = plan.bake(SkyBlurred { image });
                flags.push("SKY_BLURRED");
                binds.push(("sky_blurred", Bind::Texture(plan.add(UploadBlurred { texels }), 0)));
            }
        }
        Some(SkyBinds { flags, binds })
    }

    /// How much each item's boundary mirrors, by angle and roughness.
    pub(super) fn gloss_albedos(&self, plan: &mut Plan) -> Slot<Images> {
        let tables = self
            .items
            .iter()
            .map(|item| {
                let eta = self.material(item)?.surface.ior;
                (eta != 1.0).then(|| plan.bake(GlossAlbedo { eta }))
            })
            .collect();
        plan.add(UploadAlbedos { tables })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_finds_the_texel_that_it_came_from() {
        let (width, height) = (16, 8);
        let texels = (0..width * height).map(|i| [i as f32, 0.0, 0.0, 1.0]).collect();
        let image = Texture { width, height, texels };
        for y in 0..height {
            let theta = PI * (y as f64 + 0.5) / height as f64;
            for x in 0..width {
                for rotation in [0.0, 1.0, -2.5] {
                    let d = sky_direction(x, theta, width, rotation);
                    assert_eq!(sample(&image, d, rotation).x as u32, y * width + x);
                }
            }
        }
    }

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
