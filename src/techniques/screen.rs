//! Irradiance where the camera sees it, and light gathered from there: the screen part of [Maisch2020], for every
//! technique that has one.

use super::{Scattered, kernel};
use crate::frame::{Member, Surface};
use crate::gpu::{Bind, Blend, Buffer, Count, Dispatch, Dispatches, Format, Fullscreen, Images, Layer, Raster};
use crate::problem::{Problem, counted};
use crate::store::{Plan, Slot};
use crate::uniform;
use serde::Deserialize;
use serde::de::{Deserializer, Error};

/// How samples that stand for many pixels are weighted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum Brighten {
    /// By the surface that they cover.
    #[default]
    Area,
    /// By that and the square root of their layer, as the paper has it.
    Paper,
}

/// The sampling pattern: a square of (2 n + 1)² pixels, and layers of 4 (n_l - 1) cells around it, each n_l/(n_l - 2)
/// times as wide as the one inside [Maisch2020, eq. 7].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pattern {
    pub n: u32,
    pub n_l: u32,
    pub layers: u32,
    pub brighten: Brighten,
}

/// A whole number within bounds, both of which it may have.
pub fn within<'de, D: Deserializer<'de>, const LOW: u32, const HIGH: u32>(source: D) -> Result<u32, D::Error> {
    let value = u32::deserialize(source)?;
    match (LOW..=HIGH).contains(&value) {
        true => Ok(value),
        false => Err(D::Error::custom(format!("{value} is not allowed here: from {LOW} to {HIGH}"))),
    }
}

uniform! {
    struct Rise {
        level: u32,
        object: u32,
    }
}

uniform! {
    struct Level {
        offset: u32,
        width: u32,
        height: u32,
    }
}

uniform! {
    struct PatternUniform {
        object: u32,
        n: i32,
        n_l: i32,
        layers: i32,
        brighten: u32,
    }
}

/// Transmitted irradiance (rgb) and area of surface (a) of every pixel, `rgba32float`.
pub(super) fn entered(plan: &mut Plan, surface: &Surface) -> Result<Slot<Images>, Problem> {
    let mut flags = Vec::new();
    let mut binds =
        vec![("camera", surface.camera()), ("objects", surface.objects()), ("packed_map", surface.packed())];
    if let Some(lights) = surface.lights() {
        flags.push("LIGHTS");
        binds.push(("lights", lights));
    }
    if let Some(visibility) = surface.visibility(plan)? {
        flags.push("SHADOWS");
        binds.push(("visibility", visibility));
    }
    let mut environment = false;
    let mut draws = Vec::new();
    for member in surface.members() {
        let normals = surface.normals(plan, &member);
        let mut streams = vec![normals];
        if let Some(sky) = surface.environment(plan, &member, normals)? {
            environment = true;
            streams.push(sky);
        }
        draws.push(surface.draw(plan, &member, streams));
    }
    if environment {
        flags.push("ENVIRONMENT");
    }
    Ok(plan.add(Raster {
        name: "technique.entered",
        about: format!("what enters {} at each pixel", counted(draws.len(), "thing")),
        shader: surface.shader("techniques/entered.wgsl", &flags)?,
        size: surface.size(),
        targets: vec![(Format::Rgba32Float, Blend::Replace)],
        depth: surface.depth(),
        layers: vec![Layer::meshes(draws)],
        array: false,
        binds,
    }))
}

/// Squares of 2, 4, 8, … pixels, up to one that holds the picture.
fn levels((width, height): (u32, u32)) -> Vec<Level> {
    let mut offset = 0;
    let mut levels = Vec::new();
    for side in (1..).map(|level| 1u32 << level) {
        let level = Level { offset, width: width.div_ceil(side), height: height.div_ceil(side) };
        offset += level.width * level.height;
        levels.push(level);
        if side >= width.max(height) {
            break;
        }
    }
    levels
}

/// Light that reaches each of the member's pixels from the pixels around it, and from `far` blocks; on top of `before`.
pub(super) fn gather(
    plan: &mut Plan,
    surface: &Surface,
    member: &Member,
    entered: Slot<Images>,
    pattern: &Pattern,
    far: Option<Slot<Buffer>>,
    before: Option<Scattered>,
) -> Result<Option<Scattered>, Problem> {
    let Some(kernel) = kernel::binds(plan, surface, member.material) else {
        plan.skip(format!("light scattered by `{}`", member.name), "nothing in it scatters");
        return Ok(before);
    };
    let levels = levels(surface.size());
    let object = surface.place(member);
    let last = levels.last().expect("a picture has a pixel");
    let sums = plan.add(Dispatches {
        name: "screen.sums",
        about: format!("what is seen of `{}`, summed up over {}", member.name, counted(levels.len(), "size of square")),
        shader: surface.shader("techniques/screen_space/sums.wgsl", &[])?,
        output: ("sums", 32),
        count: Count::Known((last.offset + last.width * last.height) as u64),
        dispatches: (0..)
            .zip(&levels)
            .map(|(level, Level { width, height, .. })| Dispatch {
                count: (width * height) as u64,
                binds: vec![("rise", Bind::uniform(&Rise { level, object }))],
            })
            .collect(),
        binds: vec![
            ("levels", Bind::list(&levels)),
            ("position_map", surface.position()),
            ("entered_map", Bind::Texture(entered, 0)),
        ],
    });
    let mut flags = Vec::new();
    let mut binds = vec![
        ("camera", surface.camera()),
        ("objects", surface.objects()),
        ("position_map", surface.position()),
        ("packed_map", surface.packed()),
        ("entered_map", Bind::Texture(entered, 0)),
        ("levels", Bind::list(&levels)),
        ("sums", Bind::Buffer(sums)),
        ("pattern", Bind::uniform(&pattern.uniform(object))),
    ];
    binds.extend(kernel);
    if let Some(far) = far {
        flags.push("FAR_PART");
        binds.push(("blocks", Bind::Buffer(far)));
    }
    if let Some(before) = before {
        flags.push("ON_TOP");
        binds.push(("before", Bind::Texture(before, 0)));
    }
    Ok(Some(plan.add(Fullscreen {
        name: "screen.gather",
        about: format!("light that crossed `{}`", member.name),
        shader: surface.shader("techniques/screen_space/gather.wgsl", &flags)?,
        size: surface.size(),
        targets: vec![Format::Rgba32Float],
        binds,
    })))
}

/// A picture without light.
pub(super) fn dark(plan: &mut Plan, surface: &Surface) -> Result<Scattered, Problem> {
    Ok(plan.add(Fullscreen {
        name: "technique.dark",
        about: "no light".into(),
        shader: surface.shader("techniques/dark.wgsl", &[])?,
        size: surface.size(),
        targets: vec![Format::Rgba32Float],
        binds: Vec::new(),
    }))
}

impl Pattern {
    fn uniform(&self, object: u32) -> PatternUniform {
        PatternUniform {
            object,
            n: self.n as i32,
            n_l: self.n_l as i32,
            layers: self.layers as i32,
            brighten: (self.brighten == Brighten::Paper) as u32,
        }
    }
}
