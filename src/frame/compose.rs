//! What follows the techniques: gloss, what passes through, the sum, and the picture.

use super::{Frame, Item, PACKED, POSITION, Part, Thing, tables};
use crate::gpu::{Bind, Blend, Depth, Format, Fullscreen, Gpu, Images, Layer, Raster, Shaders};
use crate::image::{Display, Image, Tone};
use crate::problem::Problem;
use crate::scene::Substance;
use crate::store::{Plan, Run, Slot, Step};
use serde::Serialize;

/// An optical depth through which less than 1e-8 of the light comes.
const THICK: f64 = 18.5;

impl Frame<'_> {
    /// One map from several that are 0 where another is not. None of none.
    pub(crate) fn merge(&self, plan: &mut Plan, maps: &[Slot<Images>]) -> Result<Option<Slot<Images>>, Problem> {
        let Some((first, rest)) = maps.split_first() else { return Ok(None) };
        let mut sum = *first;
        for map in rest {
            sum = plan.add(Fullscreen {
                name: "frame.merge",
                about: "two kinds of objects in one picture".into(),
                shader: self.shaders.load("frame/merge.wgsl", &[])?,
                size: self.view.sampled_size(),
                targets: vec![Format::Rgba32Float],
                binds: vec![("one", Bind::Texture(sum, 0)), ("other", Bind::Texture(*map, 0))],
            });
        }
        Ok(Some(sum))
    }

    /// The optical depth along each ray through what is thin enough to be seen through. None when nothing is.
    fn depth_through(&self, plan: &mut Plan) -> Result<Option<Slot<Images>>, Problem> {
        let mut clear = false;
        for item in self.items.iter().filter(|item| item.in_view) {
            let Some(Substance::Translucent(medium)) = self.material(item).map(|m| &m.medium) else { continue };
            let sigma_t = medium.sigma_t().min_element() * self.scene.mm_per_unit;
            let across = 2.0 * item.ball().1;
            // Thin places let light through even where the whole does not: ask for a hundredth of its size.
            let depth = 0.01 * sigma_t * across;
            match depth < THICK || !self.view.skip {
                true => clear = true,
                false => plan.skip(
                    format!("light straight through `{}`", item.name),
                    format!("a hundredth of it is {depth:.0} mean free paths thick"),
                ),
            }
        }
        if !clear {
            return Ok(None);
        }
        let draws = self.draws(plan, |item| matches!(item.thing, Thing::Object(_)), |_, _| Vec::new());
        Ok(Some(plan.add(Raster {
            name: "frame.through",
            about: "the optical depth along each ray".into(),
            shader: self.shaders.load("frame/unscattered.wgsl", &[])?,
            size: self.view.sampled_size(),
            targets: vec![(Format::Rgba16Float, Blend::Add)],
            depth: Depth::Off,
            layers: vec![Layer::meshes(draws)],
            array: false,
            binds: vec![("camera", self.camera_bind()), ("objects", self.objects_bind())],
        })))
    }

    /// The sum of the parts that the view shows, linear, at the sampled size.
    pub(crate) fn compose(
        &self,
        plan: &mut Plan,
        gbuffer: Slot<Images>,
        scattered: Option<Slot<Images>>,
        glossy: Option<Slot<Images>>,
    ) -> Result<Slot<Images>, Problem> {
        let mut flags = Vec::new();
        let mut binds = vec![
            ("camera", self.camera_bind()),
            ("objects", self.objects_bind()),
            ("position_map", Bind::Texture(gbuffer, POSITION)),
            ("packed_map", Bind::Texture(gbuffer, PACKED)),
        ];
        if let Some(scattered) = scattered {
            flags.push("SCATTERED");
            binds.push(("scattered", Bind::Texture(scattered, 0)));
        }
        if let Some(glossy) = glossy {
            flags.push("GLOSSY");
            binds.push(("glossy", Bind::Texture(glossy, 0)));
        }
        if self.view.part.has(Part::Unscattered) {
            flags.push("UNSCATTERED");
            if let Some(sky) = self.sky_binds(plan, false) {
                flags.extend(sky.flags);
                binds.extend(sky.binds);
                if let Some(through) = self.depth_through(plan)? {
                    flags.push("THROUGH");
                    binds.push(("depth_through", Bind::Texture(through, 0)));
                }
            }
        }
        Ok(plan.add(Fullscreen {
            name: "frame.compose",
            about: "the sum of scattered, glossy and unscattered light".into(),
            shader: self.shaders.load("frame/compose.wgsl", &flags)?,
            size: self.view.sampled_size(),
            targets: vec![Format::Rgba32Float],
            binds,
        }))
    }

    /// Samples become pixels: linear, on the device.
    pub(crate) fn resolve(&self, plan: &mut Plan, composed: Slot<Images>) -> Result<Slot<Images>, Problem> {
        let samples = self.view.antialias;
        Ok(match samples {
            1 => composed,
            _ => plan.add(Fullscreen {
                name: "frame.resolve",
                about: format!("the mean of {} samples per pixel", samples * samples),
                shader: self.shaders.load("frame/resolve.wgsl", &[])?,
                size: self.view.size,
                targets: vec![Format::Rgba32Float],
                binds: vec![
                    ("resolve", Bind::uniform(&tables::Resolve { samples })),
                    ("picture", Bind::Texture(composed, 0)),
                ],
            }),
        })
    }

    /// Which object is seen at the first pixel.
    pub(crate) fn seen(&self, plan: &mut Plan, gbuffer: Slot<Images>) -> Slot<Option<usize>> {
        let object = |item: &Item| match item.thing {
            Thing::Object(place) => Some(place),
            Thing::Light(_) => None,
        };
        plan.add(Seen { gbuffer, objects: self.items.iter().map(object).collect() })
    }
}

/// The picture as a display is sent it, 8 bits a channel: the levels that [`Image::encode`] gives a PNG.
pub(crate) fn display(
    plan: &mut Plan,
    shaders: &Shaders,
    size: (u32, u32),
    picture: Slot<Images>,
    display: Display,
) -> Result<Slot<Images>, Problem> {
    let tone = match display.tone {
        Tone::Clamp => tables::CLAMP,
        Tone::Srgb => tables::SRGB,
        Tone::Filmic => tables::FILMIC,
    };
    Ok(plan.add(Fullscreen {
        name: "frame.display",
        about: format!("exposed by {:+} stops, through the curve {:?}", display.exposure_ev, display.tone),
        shader: shaders.load("frame/display.wgsl", &[])?,
        size,
        targets: vec![Format::Rgba8Unorm],
        binds: vec![
            ("display", Bind::uniform(&tables::Display { gain: display.exposure_ev.exp2(), tone })),
            ("picture", Bind::Texture(picture, 0)),
        ],
    }))
}

/// The picture, back from the device.
pub(crate) fn read_back(plan: &mut Plan, picture: Slot<Images>) -> Slot<Image> {
    plan.add(ReadBack { picture })
}

/// Which object stands at the first pixel of the G-buffer: its place in the scene.
#[derive(Serialize)]
struct Seen {
    gbuffer: Slot<Images>,
    /// For each thing that is drawn, the place of the object that it is.
    objects: Vec<Option<usize>>,
}

impl Step for Seen {
    type Output = Option<usize>;
    fn name(&self) -> &'static str {
        "frame.seen"
    }
    fn about(&self) -> String {
        "which object is seen".into()
    }
    fn run(&self, run: &Run) -> Result<Option<usize>, Problem> {
        let bytes = run.host::<Gpu>().read_texture(&run.get(self.gbuffer).0[POSITION])?;
        let w = f32::from_le_bytes(bytes[12..16].try_into().expect("a texel has four floats"));
        // 0 is the background.
        Ok((w as usize).checked_sub(1).and_then(|place| self.objects.get(place).copied().flatten()))
    }
}

/// From the device to an image.
#[derive(Serialize)]
struct ReadBack {
    picture: Slot<Images>,
}

impl Step for ReadBack {
    type Output = Image;
    fn name(&self) -> &'static str {
        "frame.image"
    }
    fn about(&self) -> String {
        "the picture, linear, back from the device".into()
    }
    fn run(&self, run: &Run) -> Result<Image, Problem> {
        let images = run.get(self.picture);
        let texture = &images.0[0];
        let bytes = run.host::<Gpu>().read_texture(texture)?;
        let pixels = bytes
            .chunks_exact(16)
            .map(|texel| {
                std::array::from_fn(|c| f32::from_le_bytes(texel[4 * c..4 * c + 4].try_into().expect("4 bytes")))
            })
            .collect();
        Ok(Image { width: texture.shape.width, height: texture.shape.height, pixels })
    }
}
