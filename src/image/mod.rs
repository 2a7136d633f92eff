//! Pictures as numbers: linear Rec.709 radiance, 32-bit float, row 0 at the top.
//!
//! | file | what it holds |
//! |---|---|
//! | `mod.rs` | [`Image`], what is rendered, and [`Texture`], what is read from a file |
//! | [`read`](decode) | PNG, JPEG, Radiance HDR and OpenEXR bytes, none of them trusted, into a [`Texture`] |
//! | `exr` | the OpenEXR half of reading and writing |
//! | `write` | an [`Image`] into PNG or EXR, and bytes into a file that is either the old one or the new one |
//! | [`tone`] | from radiance to what a display is sent |
//!
//! Linear means that a file's numbers are proportional to light. EXR and HDR files are linear by definition; the integers
//! of PNG and JPEG are what their user says they are ([`Encoding`]): a photograph is sRGB, a depth map is linear. Colour
//! profiles, gamma chunks and camera orientation are not applied.

mod exr;
mod read;
pub mod tone;
mod write;

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::problem::{At, Problem};

pub use read::{MAX_BYTES, MAX_SIDE, decode};
pub use tone::Tone;
pub use write::{Display, Format, exr_text, png_text, write_file};

/// Linear Rec.709 radiance. `pixels[y * width + x]`, with y counted from the top.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Image {
    pub width: u32,
    pub height: u32,
    /// `width * height` of them.
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    pub fn filled(width: u32, height: u32, rgb: [f32; 3]) -> Image {
        Image { width, height, pixels: vec![rgb; width as usize * height as usize] }
    }

    pub fn at(&self, x: u32, y: u32) -> [f32; 3] {
        assert!(x < self.width, "x = {x} in an image {} wide", self.width);
        self.pixels[y as usize * self.width as usize + x as usize]
    }

    /// The pixels with a channel that is NaN or infinite: a defect of whatever made them, never to be averaged away.
    pub fn non_finite(&self) -> Option<NonFinite> {
        NonFinite::of(self.width, &self.pixels)
    }
}

/// Pixels that hold no number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NonFinite {
    pub count: usize,
    /// (x, y) of the first one, reading order.
    pub first: (u32, u32),
}

impl NonFinite {
    fn of<const N: usize>(width: u32, pixels: &[[f32; N]]) -> Option<NonFinite> {
        let mut bad = (0..pixels.len()).filter(|&i| pixels[i].iter().any(|v| !v.is_finite()));
        let first = bad.next()?;
        Some(NonFinite { count: 1 + bad.count(), first: position(width, first) })
    }
}

fn position(width: u32, index: usize) -> (u32, u32) {
    ((index % width as usize) as u32, (index / width as usize) as u32)
}

/// What the integers of a PNG or JPEG stand for. Alpha is linear always.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Encoding {
    Srgb,
    Linear,
}

/// One channel of a [`Texture`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Channel {
    #[default]
    R,
    G,
    B,
    A,
}

/// What a file holds: four linear channels. A grey file has its value in R, G and B; a file without alpha has 1 there.
/// Alpha is kept as stored, neither multiplied in nor divided out, since it may be anything: a layer's depth, say.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Texture {
    pub width: u32,
    pub height: u32,
    /// `width * height` of them, row 0 at the top.
    pub texels: Vec<[f32; 4]>,
}

impl Texture {
    /// The colours without alpha.
    pub fn image(&self) -> Image {
        let pixels = self.texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
        Image { width: self.width, height: self.height, pixels }
    }

    /// One value a texel, in the texels' order.
    pub fn channel(&self, channel: Channel) -> Vec<f32> {
        self.texels.iter().map(|texel| texel[channel as usize]).collect()
    }

    /// What makes these texels unfit to be light or a quantity: an error for NaN and infinities, a warning for negative
    /// values. `file` is where they came from.
    pub fn check(&self, file: &Path) -> Vec<Problem> {
        let mut problems = Vec::new();
        if let Some(NonFinite { count, first: (x, y) }) = NonFinite::of(self.width, &self.texels) {
            problems.push(
                Problem::files(format!(
                    "{count} of {} pixels are NaN or infinite, the first at x = {x}, y = {y} from the top left",
                    self.texels.len()
                ))
                .at(At::file(file))
                .hint("paint over them, or write the file again with the program that made it"),
            );
        }
        let lowest = |texel: &[f32; 4]| texel.iter().copied().fold(f32::INFINITY, f32::min);
        let negative = (0..self.texels.len()).filter(|&i| lowest(&self.texels[i]) < 0.0);
        let (count, worst) = negative.fold((0_usize, None), |(count, worst), i| {
            let value = lowest(&self.texels[i]);
            (count + 1, worst.filter(|&(_, old)| old <= value).or(Some((i, value))))
        });
        if let Some((i, value)) = worst {
            let (x, y) = position(self.width, i);
            problems.push(
                Problem::warning(format!(
                    "{count} of {} pixels are negative, the lowest {value} at x = {x}, y = {y} from the top left",
                    self.texels.len()
                ))
                .at(At::file(file))
                .hint("a sharpening filter or a colour conversion leaves such values; clip the file at 0"),
            );
        }
        problems
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(texels: Vec<[f32; 4]>) -> Texture {
        Texture { width: 2, height: texels.len() as u32 / 2, texels }
    }

    #[test]
    fn channels_and_colours_are_the_stored_ones() {
        let texture = texture(vec![[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0]]);
        assert_eq!(texture.image().at(1, 0), [5.0, 6.0, 7.0]);
        let channels = [Channel::R, Channel::G, Channel::B, Channel::A].map(|c| texture.channel(c));
        assert_eq!(channels, [[1.0, 5.0], [2.0, 6.0], [3.0, 7.0], [4.0, 8.0]]);
    }

    #[test]
    fn what_is_no_number_is_an_error_and_what_is_negative_a_warning() {
        let fine = [0.5, 0.0, 2.0, 1.0];
        assert_eq!(texture(vec![fine; 4]).check(Path::new("a.exr")), []);

        let mut texels = vec![fine; 6];
        texels[3][2] = f32::NAN;
        texels[5][3] = f32::INFINITY;
        texels[2][0] = -0.25;
        texels[4][1] = -2.0;
        let said: Vec<_> = texture(texels).check(Path::new("a.exr")).iter().map(|p| p.to_string()).collect();
        assert_eq!(said.len(), 2);
        assert!(said[0].starts_with("a.exr: error: 2 of 6 pixels are NaN or infinite, the first at x = 1, y = 1"));
        assert!(said[1].starts_with("a.exr: warning: 2 of 6 pixels are negative, the lowest -2 at x = 0, y = 2"));
    }

    #[test]
    fn an_image_counts_its_broken_pixels() {
        let mut image = Image::filled(3, 2, [1.0; 3]);
        assert_eq!(image.non_finite(), None);
        image.pixels[4] = [f32::NAN, f32::INFINITY, 0.0];
        assert_eq!(image.non_finite(), Some(NonFinite { count: 1, first: (1, 1) }));
    }
}
