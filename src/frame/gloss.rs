//! Light reflected at the boundaries, the same for every technique: GGX under lamps, and under the surroundings by its
//! directional albedo.

use super::upload::{self, Stream};
use super::{DEPTH, Frame, Item, PACKED, Part};
use crate::gpu::{Bind, Blend, Depth, Draw, Format, Gpu, Images, Layer, Raster, Sampler, Shape};
use crate::optics::microfacet;
use crate::problem::{Problem, counted};
use crate::store::{Bake, Plan, Run, Slot, Step};
use half::f16;
use serde::Serialize;

impl Frame<'_> {
    /// Light reflected at the boundaries, added once for every technique. None when nothing mirrors.
    pub(crate) fn gloss(&self, plan: &mut Plan, gbuffer: Slot<Images>) -> Result<Option<Slot<Images>>, Problem> {
        if !self.view.part.has(Part::Glossy) {
            plan.skip("gloss", "the picture shows another part");
            return Ok(None);
        }
        let mirrors = |item: &Item| self.material(item).is_some_and(|m| m.surface.ior != 1.0 || !self.view.skip);
        for item in self.items.iter().filter(|item| self.material(item).is_some() && !mirrors(item)) {
            plan.skip(format!("gloss of `{}`", item.name), "its index of refraction is 1");
        }
        let sky = self.sky_binds(plan, true);
        let lights = self.lights_bind();
        if lights.is_none() && sky.is_none() || !self.items.iter().any(|item| item.in_view && mirrors(item)) {
            return Ok(None);
        }
        let mut flags = Vec::new();
        let mut binds = vec![
            ("camera", self.camera_bind()),
            ("objects", self.objects_bind()),
            ("packed_map", Bind::Texture(gbuffer, PACKED)),
        ];
        if let Some(lights) = lights {
            flags.push("LIGHTS");
            binds.push(("lights", lights));
        }
        if let Some(visibility) = self.visibility(plan, gbuffer)? {
            flags.push("SHADOWS");
            binds.push(("visibility", Bind::Texture(visibility, 0)));
        }
        if let Some(sky) = sky {
            flags.extend(sky.flags);
            binds.extend(sky.binds);
            binds.push(("albedo_table", Bind::Texture(self.gloss_albedos(plan), 0)));
            binds.push(("linear", Bind::Sampler(Sampler::Linear)));
        }
        // Those whose sky is partly hidden bring how open it is with their vertices; the others do without.
        let mut open = Vec::new();
        let mut hidden = Vec::new();
        for (place, item) in self.items.iter().enumerate().filter(|(_, item)| item.in_view && mirrors(item)) {
            let openness = self.openness(plan, item)?;
            let mut streams = vec![upload::stream(plan, item.mesh, Stream::Positions)];
            streams.extend(openness);
            let draw =
                Draw { streams, indices: upload::stream(plan, item.mesh, Stream::Indices), instance: place as u32 };
            if openness.is_some() { hidden.push(draw) } else { open.push(draw) }
        }
        let mut made = Vec::new();
        for (draws, occluded) in [(hidden, true), (open, false)] {
            if draws.is_empty() {
                continue;
            }
            let mut flags = flags.clone();
            if occluded {
                flags.push("OCCLUDED");
            }
            made.push(plan.add(Raster {
                name: "frame.gloss",
                about: format!("light mirrored by {}", counted(draws.len(), "thing")),
                shader: self.shaders.load("frame/gloss.wgsl", &flags)?,
                size: self.view.sampled_size(),
                targets: vec![(Format::Rgba32Float, Blend::Replace)],
                depth: Depth::Equal(gbuffer, DEPTH),
                layers: vec![Layer::meshes(draws)],
                array: false,
                binds: binds.clone(),
            }));
        }
        self.merge(plan, &made)
    }

    /// How much each item's boundary mirrors, by angle and roughness.
    fn gloss_albedos(&self, plan: &mut Plan) -> Slot<Images> {
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
    const CODE: &'static [&'static str] = &["src/optics/", "src/frame/gloss.rs"];
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
