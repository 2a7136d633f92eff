//! LongRange: light from what the camera sees is gathered on the screen, light from all else comes as splats of a coarse
//! mesh [Maisch2020].
//!
//! The screen part is that of `ScreenSpace`, with the same settings. The far part cuts the surface into about `splats`
//! patches, along the triangles of a decimated mesh; long triangles are halved until they are as short as the others. Each
//! patch has its middle, normal, area and the irradiance that enters it, shadows included, and sends its light as a disk
//! to one pixel of each 4 x 4. A cubic spline, kept from leaking over edges by depth, brings it to all of them, where
//! those of blocks that show little of the object count less.
//!
//! What counts where differs from the paper's criteria [eqs. 2, 3, 8], which lose what faces the camera but is hidden
//! or out of the picture, and count twice what is seen at a steep angle. Here points all over each patch are looked up in
//! the picture, and what is not seen of it counts: together the two parts have every piece of the surface once, from any
//! place. A patch that is seen in part sends its light as up to four disks, for what is not seen of it to the left, to the
//! right, above and below its middle: what is left around the picture, or beside it, is not put where the picture is. The
//! distance to a disk [eq. 9] is replaced as well: an even slab comes out right whether its patches are small or not, where
//! the paper's rule makes it several times too bright.
//!
//! - `splats` is about how many patches there are; more make shadows that are seen through the object sharper.
//! - `n`, `n_l`, `layers` and `brighten` are those of `ScreenSpace`.
//!
//! Claims: pictures close to a traced one at any scattering distance and for any lights, for meshes that deform as they
//! like: nothing is baked but which triangles make a patch.
//!
//! Costs: `ScreenSpace`, and `splats` samples for one pixel in sixteen, which is about as much again. Light is gathered once,
//! whatever the number of lights, but each brings its shadow maps and is looked up at each pixel and piece of a patch:
//! sixteen lamps around a knot (`scenes/long-range/lamps.ron`) cost two to four times as much as one with 96 x 72 pixels, and
//! a half more with 192 x 144: shadow maps do not grow with the picture.
//!
//! Fails where the profile does: light is taken to cross the inside of things as if they were flat and endless, so thin
//! parts come out too dark, and hollow ones glow. `scenes/long-range/back-lit.ron` shows it against `volume`. Shadows that
//! are seen through a thing are as coarse as its patches. Where one strand of a thing passes before another, cells of the
//! screen part hold both: `scenes/long-range/mixed.ron` comes out 5 % too dark, and `n_l: 8, layers: 24`, for three times the
//! samples there, takes a third of its relMSE away. Of figures of few pixels the edges are most of the error: that takes more
//! samples per pixel. So near to a surface that one patch fills the picture, it comes out a tenth too bright or too dark, at a
//! fiftieth of a ball's radius a fifth. Towards rims far light rises within few pixels, of which every fourth knows little:
//! single ones of a ball in white surroundings come out up to a quarter too bright there, or two thirds too dark.
//!
//! ```
//! use diaphane::scene::TechniqueText;
//! let text = TechniqueText::from_flag("--technique", "LongRange(layers: 8, splats: 4000)")?;
//! diaphane::techniques::read(&text)?;
//! # Ok::<(), diaphane::problem::Problem>(())
//! ```

mod patches;

use super::screen::{self, Brighten, Pattern, within};
use super::{Scattered, Technique, kernel};
use crate::frame::{Member, Surface};
use crate::gpu::{Bind, Buffer, Compute, Count, Dispatch, Dispatches};
use crate::problem::Problem;
use crate::store::{Plan, Slot};
use crate::uniform;
use patches::{Cut, LeafPoints, Patches, UploadAreas, UploadSpans};
use serde::Deserialize;

/// See the module.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LongRange {
    #[serde(deserialize_with = "within::<_, 16, 100_000>")]
    pub splats: u32,
    #[serde(deserialize_with = "within::<_, 1, 8>")]
    pub n: u32,
    #[serde(deserialize_with = "within::<_, 3, 16>")]
    pub n_l: u32,
    #[serde(deserialize_with = "within::<_, 0, 24>")]
    pub layers: u32,
    pub brighten: Brighten,
}

impl Default for LongRange {
    fn default() -> LongRange {
        LongRange { splats: 2000, n: 2, n_l: 5, layers: 12, brighten: Brighten::Area }
    }
}

uniform! {
    struct Whose {
        object: u32,
    }
}

impl Technique for LongRange {
    fn plan(&self, plan: &mut Plan, surface: &Surface) -> Result<Scattered, Problem> {
        let LongRange { splats, n, n_l, layers, brighten } = *self;
        let entered = screen::entered(plan, surface)?;
        let mut picture = None;
        for member in surface.members() {
            let mesh = surface.rest(plan, &member);
            let patches = plan.bake(Cut { mesh, wanted: splats });
            let far = far(plan, surface, &member, patches)?;
            let pattern = Pattern { n, n_l, layers, brighten };
            picture = screen::gather(plan, surface, &member, entered, &pattern, far, picture)?;
        }
        picture.map_or_else(|| screen::dark(plan, surface), Ok)
    }
}

/// What all patches send to one pixel of each block, and which pixel that is: 16 bytes a block. None when nothing scatters.
fn far(
    plan: &mut Plan,
    surface: &Surface,
    member: &Member,
    patches: Slot<Patches>,
) -> Result<Option<Slot<Buffer>>, Problem> {
    let Some(kernel) = kernel::binds(plan, surface, member.material) else { return Ok(None) };
    let whose = || ("whose", Bind::uniform(&Whose { object: surface.place(member) }));
    let (width, height) = surface.size();

    let points = plan.add(LeafPoints { mesh: member.mesh, patches });
    let irradiance = surface.irradiance(plan, member, points)?;
    let [positions, normals] = surface.points(plan, points);
    let areas = plan.add(UploadAreas { mesh: member.mesh, patches });
    let spans = plan.add(UploadSpans { patches });
    let splats = plan.add(Compute {
        name: "long_range.splats",
        about: format!("the light of each patch of `{}` that is not seen", member.name),
        shader: surface.shader("techniques/long_range/splats.wgsl", &[])?,
        output: ("splats", 96),
        over: spans,
        over_stride: 8,
        binds: vec![
            whose(),
            ("objects", surface.objects()),
            ("spans", Bind::Buffer(spans)),
            ("areas", Bind::Buffer(areas)),
            ("positions", Bind::Buffer(positions)),
            ("normals", Bind::Buffer(normals)),
            ("irradiance", Bind::Buffer(irradiance)),
            ("camera", surface.camera()),
            ("position_map", surface.position()),
            ("packed_map", surface.packed()),
        ],
    });

    let blocks = width.div_ceil(4) as u64 * height.div_ceil(4) as u64;
    let mut binds = vec![whose(), ("position_map", surface.position()), ("splats", Bind::Buffer(splats))];
    binds.extend(kernel);
    Ok(Some(plan.add(Dispatches {
        name: "long_range.far",
        about: format!("light from all patches of `{}` at every fourth pixel", member.name),
        shader: surface.shader("techniques/long_range/far.wgsl", &[])?,
        output: ("blocks", 16),
        count: Count::Known(blocks),
        // A workgroup each.
        dispatches: vec![Dispatch { count: 64 * blocks, binds: Vec::new() }],
        binds,
    })))
}
