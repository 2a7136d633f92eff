//! Image bytes into a [`Texture`]. The bytes may be anything: the format is told by content, sizes are refused before
//! memory is asked for, and no input panics, hangs or grows.

use std::fmt::Display;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use ::image::codecs::{hdr::HdrDecoder, jpeg::JpegDecoder, png::PngDecoder};
use ::image::{DynamicImage, ImageDecoder, ImageFormat, Limits};

use super::{Encoding, Texture, exr, tone};
use crate::problem::{At, Problem};

/// The longest side that is read, in pixels.
pub const MAX_SIDE: u64 = 16_384;
/// The most memory that a texture may take: 2^26 texels of 16 bytes, 1 GiB.
pub const MAX_BYTES: u64 = 1 << 30;
/// What a byte of a file unpacks to at most, in pixels. One-bit PNG goes furthest: DEFLATE makes 1032 bytes of one.
const MAX_PIXELS_PER_BYTE: u64 = 8 * 1032;

const BYTES_PER_TEXEL: u64 = size_of::<[f32; 4]>() as u64;

/// Reads a PNG, JPEG, Radiance HDR or OpenEXR file whose content is `bytes`. `file` is named in problems; its extension
/// does not matter. `encoding` says what the integers of PNG and JPEG stand for.
///
/// Values are returned as they are stored, NaN included: see [`Texture::check`].
pub fn decode(bytes: &[u8], file: &Path, encoding: Encoding) -> Result<Texture, Problem> {
    // The decoders are other people's, and some assert where they should refuse.
    let outcome = catch_unwind(AssertUnwindSafe(|| decode_trusting(bytes, encoding)));
    let refused = match outcome {
        Ok(Ok(texture)) => return Ok(texture),
        Ok(Err(refused)) => refused,
        Err(_) => Refused::damaged(&"its reader gave up"),
    };
    Err(refused.problem(file))
}

/// Why bytes are not an image: a [`Problem`] that does not know its file yet.
pub(super) struct Refused {
    what: String,
    hint: String,
}

impl Refused {
    pub(super) fn new(what: impl Into<String>, hint: impl Into<String>) -> Refused {
        Refused { what: what.into(), hint: hint.into() }
    }

    pub(super) fn problem(self, file: &Path) -> Problem {
        Problem::files(self.what).at(At::file(file)).hint(self.hint)
    }

    pub(super) fn damaged(why: &dyn Display) -> Refused {
        Refused::new(format!("the image is damaged or cut short: {why}"), "copy it or write it again")
    }
}

impl From<::image::ImageError> for Refused {
    fn from(error: ::image::ImageError) -> Refused {
        match error {
            ::image::ImageError::Unsupported(what) => {
                Refused::new(format!("this kind of image is not read: {what}"), "save it again as PNG or EXR")
            }
            other => Refused::damaged(&other),
        }
    }
}

/// Refuses an image without pixels, one that would take too much memory, and one that says more than its `length` bytes
/// can hold: a small file takes little memory, whatever it says.
pub(super) fn refuse_size(width: u64, height: u64, length: usize) -> Result<(), Refused> {
    if width == 0 || height == 0 {
        return Err(Refused::new(format!("the image is {width} x {height} pixels: empty"), "write it again"));
    }
    let bytes = width.saturating_mul(height).saturating_mul(BYTES_PER_TEXEL);
    if width > MAX_SIDE || height > MAX_SIDE || bytes > MAX_BYTES {
        return Err(Refused::new(
            format!("the image says that it is {width} x {height} pixels, which take {bytes} bytes"),
            format!(
                "at most {MAX_SIDE} pixels on a side and {MAX_BYTES} bytes are read ({BYTES_PER_TEXEL} a pixel): scale it \
                 down, or write it again if that is not its size"
            ),
        ));
    }
    if width * height > MAX_PIXELS_PER_BYTE * length as u64 {
        return Err(Refused::damaged(&format!("{length} bytes cannot hold {width} x {height} pixels")));
    }
    Ok(())
}

fn decode_trusting(bytes: &[u8], encoding: Encoding) -> Result<Texture, Refused> {
    let source = Cursor::new(bytes);
    match ::image::guess_format(bytes) {
        Ok(ImageFormat::OpenExr) => exr::decode(bytes),
        // The size is checked as soon as the header is read; the decoder's own limits bound what it needs besides.
        Ok(ImageFormat::Png) => pixels(PngDecoder::with_limits(source, limits())?, encoding, bytes),
        Ok(ImageFormat::Jpeg) if !is_complete_jpeg(bytes) => Err(Refused::damaged(&"it has no end marker")),
        Ok(ImageFormat::Jpeg) => pixels(JpegDecoder::new(source)?, encoding, bytes),
        Ok(ImageFormat::Hdr) => pixels(HdrDecoder::new(source)?, Encoding::Linear, bytes),
        // The signature that Radiance itself writes today differs from the one that the strict reader insists on.
        Err(_) if bytes.starts_with(b"#?RGBE") => pixels(HdrDecoder::new_nonstrict(source)?, Encoding::Linear, bytes),
        Err(_) if bytes.is_empty() => Err(Refused::new("the file is empty", "write it again")),
        Ok(other) => Err(not_read(&format!("a {other:?} file"))),
        Err(_) => Err(not_read("no image known here")),
    }
}

fn not_read(what: &str) -> Refused {
    Refused::new(
        format!("this is {what}"),
        "PNG, JPEG, Radiance HDR and OpenEXR are read, told by content and not by name: save it as one of these",
    )
}

fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_BYTES);
    limits
}

/// What `decoder` makes of `bytes`.
fn pixels(decoder: impl ImageDecoder, encoding: Encoding, bytes: &[u8]) -> Result<Texture, Refused> {
    let (width, height) = decoder.dimensions();
    refuse_size(u64::from(width), u64::from(height), bytes.len())?;
    let texels = match DynamicImage::from_decoder(decoder)? {
        float @ (DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_)) => {
            float.into_rgba32f().pixels().map(|pixel| pixel.0).collect()
        }
        wide @ (DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_)) => linear(wide.into_rgba16().pixels().map(|pixel| pixel.0), u16::MAX, encoding),
        narrow => linear(narrow.into_rgba8().pixels().map(|pixel| pixel.0), u8::MAX, encoding),
    };
    Ok(Texture { width, height, texels })
}

/// Integers from 0 to `max` to linear values from 0 to 1, by a table of all levels.
fn linear<T: Copy + Into<u16>>(pixels: impl Iterator<Item = [T; 4]>, max: T, encoding: Encoding) -> Vec<[f32; 4]> {
    let max = max.into();
    let alpha = |level: u16| f32::from(level) / f32::from(max);
    let colour: Vec<f32> = (0..=max)
        .map(|level| match encoding {
            Encoding::Srgb => tone::linear_from_srgb(alpha(level)),
            Encoding::Linear => alpha(level),
        })
        .collect();
    pixels
        .map(|p| p.map(Into::into))
        .map(|[r, g, b, a]: [u16; 4]| {
            [colour[usize::from(r)], colour[usize::from(g)], colour[usize::from(b)], alpha(a)]
        })
        .collect()
}

/// Whether the picture's end marker is there. The decoder fills what is missing with grey and says nothing.
fn is_complete_jpeg(bytes: &[u8]) -> bool {
    // Segments up to the first scan state their length, so that a thumbnail's end marker within one is not mistaken.
    let mut at = 2;
    while let Some(&[0xff, marker]) = bytes.get(at..at + 2) {
        match (marker, bytes.get(at + 2..at + 4)) {
            (0xff, _) => at += 1,
            (0xda, _) => return bytes[at..].windows(2).any(|pair| pair == [0xff, 0xd9]),
            (_, Some(&[high, low])) => at += 2 + usize::from(u16::from_be_bytes([high, low])),
            (_, _) => return false,
        }
    }
    false
}

#[cfg(test)]
mod tests;
