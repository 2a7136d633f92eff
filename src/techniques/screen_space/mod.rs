//! ScreenSpace: light is gathered from the pixels around each pixel, near ones one by one and far ones in squares
//! [Maisch2020, section 4].
//!
//! Each pixel stands for the piece of surface that it covers. What enters there, shadows and all, comes to every other pixel
//! of the same object by the material's profile, averaged over a disk as large as the piece. So nothing changes with zoom
//! or resolution but the noise of the grid. Around a square of (2 n + 1)² pixels lie layers of 4 (n_l - 1) cells, each layer
//! n_l/(n_l - 2) times as wide as the one inside [eq. 7]; a cell is read from sums over squares of about its size.
//!
//! - `layers` is how many there may be: 12 of the default pattern span 2,297 pixels. No more are taken than reach as far as
//!   all but 0.2 % of the light goes at the pixel's depth.
//! - `brighten: Area`, the default, takes the area of surface that is seen within each cell. `Paper` multiplies layer i by
//!   sqrt(i) as the paper does, which makes flat plates up to 2.5 times too bright.
//!
//! Claims: detail as fine as the pixels, at any scattering distance, for a number of samples that grows as its logarithm.
//!
//! Costs: one pass per object over all pixels, 25 + 16 per layer samples each, and a third of a pass for the sums. Lights
//! cost what they cost in any picture: the gathering does not know how many there are. One table per medium is baked, in
//! some 20 ms.
//!
//! Fails where light enters that the camera does not see: objects lit from behind stay dark, and what leaves the picture
//! takes its light along. `scenes/long-range/back-lit.ron` shows it. Where one part of an object stands before another,
//! cells hold both, and light leaks between them. A plate that is seen at 45 degrees comes out up to 2 % too bright, since a
//! disk stands for the ellipse that a pixel covers but for where two of them meet; pixels on a steeper slope than 1 in 10
//! send nothing.
//!
//! A spot of light smaller than a cell is spread over all of it: where the profile has fallen by ten, by three hundred and
//! by five thousand, 1.2, 2.7 and 4 times too much arrives at the defaults, 1, 1.4 and 1.5 times at `n_l: 8, layers: 24`,
//! for three times the samples, and what should at `n_l: 16, layers: 24`, which is seven times as many and spans 123 pixels.
//! Cells that lay where their light does would mend it for one lamp, but the light of two would no longer add up.
//!
//! ```
//! use diaphane::scene::TechniqueText;
//! let text = TechniqueText::from_flag("--technique", "ScreenSpace(n: 2, n_l: 5, layers: 12, brighten: Area)")?;
//! diaphane::techniques::read(&text)?;
//! # Ok::<(), diaphane::problem::Problem>(())
//! ```

use super::screen::{self, Brighten, Pattern, within};
use super::{Scattered, Technique};
use crate::frame::Surface;
use crate::problem::Problem;
use crate::store::Plan;
use serde::Deserialize;

/// See the module.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScreenSpace {
    #[serde(deserialize_with = "within::<_, 1, 8>")]
    pub n: u32,
    #[serde(deserialize_with = "within::<_, 3, 16>")]
    pub n_l: u32,
    #[serde(deserialize_with = "within::<_, 0, 24>")]
    pub layers: u32,
    pub brighten: Brighten,
}

impl Default for ScreenSpace {
    fn default() -> ScreenSpace {
        ScreenSpace { n: 2, n_l: 5, layers: 12, brighten: Brighten::Area }
    }
}

impl Technique for ScreenSpace {
    fn plan(&self, plan: &mut Plan, surface: &Surface) -> Result<Scattered, Problem> {
        let ScreenSpace { n, n_l, layers, brighten } = *self;
        let entered = screen::entered(plan, surface)?;
        let mut picture = None;
        for member in surface.members() {
            let pattern = Pattern { n, n_l, layers, brighten };
            picture = screen::gather(plan, surface, &member, entered, &pattern, None, picture)?;
        }
        picture.map_or_else(|| screen::dark(plan, surface), Ok)
    }
}
