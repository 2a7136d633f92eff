use ::exr::prelude::{
    Blocks, Compression, Encoding as ExrEncoding, Image as Layers, Layer, LayerAttributes, LineOrder, SpecificChannels,
    Vec2, WritableImage as _,
};
use std::sync::LazyLock;

use ::image::codecs::{hdr::HdrEncoder, jpeg::JpegEncoder};
use ::image::{ImageEncoder, Rgb};
use proptest::prelude::*;

use super::*;
use crate::image::{Channel, Display as Shown, Format, Image};

const SIDE: u32 = 24;

fn picture() -> Image {
    let pixels = (0..SIDE * SIDE).map(|i| [i as f32 / 600.0, (i % 17) as f32 / 16.0, 0.25]).collect();
    Image { width: SIDE, height: SIDE, pixels }
}

fn png() -> Vec<u8> {
    picture().encode(Format::Png, Shown::default(), &[("key", "value")]).unwrap()
}

fn exr(compression: Compression, blocks: Blocks) -> Vec<u8> {
    let image = picture();
    let channels = SpecificChannels::rgba(move |Vec2(x, y)| {
        let [r, g, b] = image.at(x as u32, y as u32);
        (r, g, b, 0.5_f32)
    });
    let encoding = ExrEncoding { compression, blocks, line_order: LineOrder::Increasing };
    let layer = Layer::new((SIDE as usize, SIDE as usize), LayerAttributes::default(), encoding, channels);
    let mut bytes = Cursor::new(Vec::new());
    Layers::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

fn jpeg() -> Vec<u8> {
    let mut bytes = Vec::new();
    let grey: Vec<u8> = (0..SIDE * SIDE * 3).map(|i| (i / 7) as u8).collect();
    JpegEncoder::new(&mut bytes).encode(&grey, SIDE, SIDE, ::image::ExtendedColorType::Rgb8).unwrap();
    bytes
}

fn hdr() -> Vec<u8> {
    let mut bytes = Vec::new();
    let pixels: Vec<_> = picture().pixels.into_iter().map(Rgb).collect();
    HdrEncoder::new(&mut bytes).encode(&pixels, SIDE as usize, SIDE as usize).unwrap();
    bytes
}

/// One of each kind, with the bytes of its end that no pixel needs.
static SAMPLES: LazyLock<[(&str, Vec<u8>, usize); 9]> = LazyLock::new(|| {
    let tiles = Blocks::Tiles(Vec2(16, 16));
    [
        ("png", png(), 12 + 6),
        ("jpeg", jpeg(), 0),
        ("hdr", hdr(), 0),
        ("exr zip", exr(Compression::ZIP16, Blocks::ScanLines), 0),
        ("exr piz", exr(Compression::PIZ, Blocks::ScanLines), 0),
        ("exr rle", exr(Compression::RLE, tiles), 0),
        ("exr plain", exr(Compression::Uncompressed, tiles), 0),
        ("exr pxr24", exr(Compression::PXR24, Blocks::ScanLines), 0),
        ("exr b44", exr(Compression::B44, tiles), 0),
    ]
});

fn read(bytes: &[u8]) -> Result<Texture, Problem> {
    decode(bytes, Path::new("in/a.dat"), Encoding::Linear)
}

fn refusal(bytes: &[u8]) -> String {
    read(bytes).expect_err("refused").to_string()
}

/// A grey or coloured PNG straight from the encoder.
fn png_of(color: ::image::ExtendedColorType, width: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    ::image::codecs::png::PngEncoder::new(&mut bytes).write_image(data, width, 1, color).unwrap();
    bytes
}

#[test]
fn each_format_is_told_by_its_content_and_gives_its_values() {
    for (name, bytes, _) in &*SAMPLES {
        let texture = read(bytes).unwrap_or_else(|problem| panic!("{name}: {problem}"));
        assert_eq!((texture.width, texture.height), (SIDE, SIDE), "{name}");
        assert_eq!(texture.texels.len() as u32, SIDE * SIDE, "{name}");
        assert_eq!(texture.texels[7][3], if name.starts_with("exr") { 0.5 } else { 1.0 }, "{name}");
        let tolerance = match *name {
            "png" | "jpeg" => continue,
            // One exponent for three 8-bit mantissas; 24 bits of 32.
            "hdr" => 1.0 / 128.0,
            "exr pxr24" => 1e-4,
            _ => 0.0,
        };
        for (got, wanted) in texture.image().pixels.iter().zip(&picture().pixels) {
            let brightest = wanted.iter().copied().fold(0.0, f32::max);
            for c in 0..3 {
                assert!((got[c] - wanted[c]).abs() <= tolerance * brightest, "{name}: {got:?} {wanted:?}");
            }
        }
    }
}

#[test]
fn radiance_has_two_signatures() {
    let bytes = hdr();
    let other = [b"#?RGBE".as_slice(), &bytes[b"#?RADIANCE".len()..]].concat();
    assert_eq!(read(&other).unwrap(), read(&bytes).unwrap());
}

#[test]
fn integers_of_every_width_reach_from_0_to_1_and_alpha_stays_linear() {
    use ::image::ExtendedColorType as Color;
    let srgb = |bytes: &[u8]| decode(bytes, Path::new("a"), Encoding::Srgb).unwrap().texels;
    let half = tone::linear_from_srgb(128.0 / 255.0);

    let grey = png_of(Color::L8, 3, &[0, 128, 255]);
    assert_eq!(read(&grey).unwrap().texels, [0.0, 128.0 / 255.0, 1.0].map(|v| [v, v, v, 1.0]));
    assert_eq!(srgb(&grey), [0.0, half, 1.0].map(|v| [v, v, v, 1.0]));

    let rgba = png_of(Color::Rgba8, 1, &[0, 128, 255, 128]);
    assert_eq!(srgb(&rgba), [[0.0, half, 1.0, 128.0 / 255.0]]);

    let wide: Vec<u8> = [0_u16, 1, 257, 65535].iter().flat_map(|v| v.to_ne_bytes()).collect();
    let wide = read(&png_of(Color::L16, 4, &wide)).unwrap().channel(Channel::R);
    assert_eq!(wide, [0.0, 1.0 / 65535.0, 257.0 / 65535.0, 1.0]);
}

#[test]
fn a_luminance_exr_is_grey_and_one_without_colours_says_what_it_has() {
    let single = |name: &str| {
        let channels = SpecificChannels::build().with_channel::<f32>(name).with_pixel_fn(|Vec2(x, _)| (x as f32,));
        let mut bytes = Cursor::new(Vec::new());
        Layers::from_channels((3, 1), channels).write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    };
    assert_eq!(read(&single("Y")).unwrap().texels, [0.0, 1.0, 2.0].map(|v| [v, v, v, 1.0]));
    assert_eq!(read(&single("G")).unwrap().texels[2], [0.0, 2.0, 0.0, 1.0]);
    let refusal = refusal(&single("normal.X"));
    assert!(refusal.contains("normal.X") && refusal.contains("RGBA"), "{refusal}");
}

/// Overwrites the width and height in a header, checksum included.
fn with_size(name: &str, bytes: &[u8], width: u32, height: u32) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let place = |needle: &[u8]| bytes.windows(needle.len()).position(|part| part == needle).unwrap() + needle.len();
    match name {
        "png" => {
            bytes[16..20].copy_from_slice(&width.to_be_bytes());
            bytes[20..24].copy_from_slice(&height.to_be_bytes());
            let crc = bytes[12..29].iter().fold(!0_u32, |crc, &byte| {
                (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
            });
            bytes[29..33].copy_from_slice(&(!crc).to_be_bytes());
        }
        "jpeg" => {
            let at = place(&[0xff, 0xc0]) + 3;
            bytes[at..at + 2].copy_from_slice(&(height as u16).to_be_bytes());
            bytes[at + 2..at + 4].copy_from_slice(&(width as u16).to_be_bytes());
        }
        "hdr" => {
            let end = place(format!("-Y {SIDE} +X {SIDE}\n").as_bytes());
            let rest = bytes.split_off(end);
            bytes.truncate(end - format!("-Y {SIDE} +X {SIDE}\n").len());
            bytes.extend(format!("-Y {height} +X {width}\n").bytes().chain(rest));
        }
        _ => {
            let at = place(b"dataWindow\0box2i\0\x10\0\0\0") + 8;
            bytes[at..at + 4].copy_from_slice(&(width as i32 - 1).to_le_bytes());
            bytes[at + 4..at + 8].copy_from_slice(&(height as i32 - 1).to_le_bytes());
        }
    }
    bytes
}

#[test]
fn a_huge_size_is_refused_with_both_numbers_before_memory_is_asked_for() {
    for (name, bytes, _) in &*SAMPLES {
        // 8 GB within the sides' limit, a side beyond it, and nothing at all. JPEG's own limit of a side is 65,535.
        let said = refusal(&with_size(name, bytes, 16_384, 16_384));
        assert!(said.contains("16384 x 16384") && said.contains("4294967296 bytes"), "{name}: {said}");
        assert!(said.contains("1073741824 bytes"), "{name}: {said}");
        let said = refusal(&with_size(name, bytes, 60_000, 2));
        assert!(said.contains("60000 x 2") && said.contains("at most 16384"), "{name}: {said}");
        assert!(read(&with_size(name, bytes, 0, 24)).is_err(), "{name}");
        if *name != "jpeg" {
            assert!(read(&with_size(name, bytes, u32::MAX / 2, u32::MAX / 2)).is_err(), "{name}");
        }
    }
}

#[test]
fn a_small_file_that_says_it_is_a_large_picture_is_refused() {
    for (name, bytes, _) in &*SAMPLES {
        let said = refusal(&with_size(name, bytes, 8192, 8192));
        assert!(said.contains("bytes cannot hold"), "{name}: {said}");
    }
    // As far as a format goes, nothing is refused that it can hold.
    let mut blank = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut blank, 2048, 2048);
    encoder.set_color(::png::ColorType::Grayscale);
    encoder.set_depth(::png::BitDepth::One);
    encoder.set_compression(::png::Compression::High);
    encoder.write_header().unwrap().write_image_data(&vec![0; 2048 * 2048 / 8]).unwrap();
    assert!(blank.len() < 4096, "{}", blank.len());
    read(&blank).unwrap();
}

#[test]
fn a_file_cut_short_anywhere_is_refused() {
    for (name, bytes, spare) in &*SAMPLES {
        for length in 0..bytes.len() - spare {
            assert!(read(&bytes[..length]).is_err(), "{name} cut at {length} of {}", bytes.len());
        }
    }
}

#[test]
fn what_is_no_image_says_what_is_read_instead() {
    assert!(refusal(b"").starts_with("in/a.dat: error: the file is empty"));
    for other in [b"GIF89a".as_slice(), b"II*\0", b"v 0 0 0\nf 1 1 1\n", b"RIFF\0\0\0\0WEBP", &[0; 64]] {
        assert!(refusal(other).contains("PNG, JPEG, Radiance HDR and OpenEXR are read"));
    }
    assert!(refusal(b"GIF89a").contains("this is a Gif file"));
    // An upside-down Radiance file would be a wrong picture.
    let flipped = hdr().iter().map(|&b| b as char).collect::<String>().replace("-Y", "+Y");
    assert!(read(&flipped.chars().map(|c| c as u8).collect::<Vec<_>>()).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    /// Whatever comes, an answer comes, and it holds together.
    #[test]
    fn damaged_bytes_are_read_or_refused(
        sample in 0..9_usize,
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), any::<bool>()), 1..6),
    ) {
        let mut bytes = SAMPLES[sample].1.clone();
        let header = bytes.len().min(400);
        for (at, value, anywhere) in edits {
            let at = at.index(if anywhere { bytes.len() } else { header });
            bytes[at] = value;
        }
        if let Ok(texture) = read(&bytes) {
            prop_assert_eq!(texture.texels.len(), texture.width as usize * texture.height as usize);
            prop_assert!(texture.texels.len() as u64 * BYTES_PER_TEXEL <= MAX_BYTES);
        }
    }

    #[test]
    fn noise_after_a_signature_is_refused(sample in 0..4_usize, noise in prop::collection::vec(any::<u8>(), 0..600)) {
        prop_assert!(read(&[&SAMPLES[sample].1[..11], &noise].concat()).is_err());
    }
}
