//! OpenEXR: always linear, always float.

use std::io::Cursor;

use ::exr::error::Error;
use ::exr::meta::{BlockDescription, MetaData};
use ::exr::prelude::{
    Encoding, Image as Layers, Layer, LayerAttributes, ReadChannels as _, ReadLayers as _, ReadSpecificChannel as _,
    SpecificChannels, Text, Vec2, WritableImage as _, read,
};

use super::read::{MAX_BYTES, Refused, refuse_size};
use super::{Image, Texture};

/// What a byte of a file unpacks to at most: DEFLATE makes 1032 bytes of one, and PXR24 four of three.
const MAX_BYTES_PER_BYTE: u64 = 1376;
/// A block of a small file may be this large: that of a small picture in a large tile.
const USUAL_BLOCK: u64 = 8 << 20;

/// Reads R, G, B and A of the file's first layer, or Y in place of R, G and B.
pub(super) fn decode(bytes: &[u8]) -> Result<Texture, Refused> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(refused)?;
    for header in &meta.headers {
        let Vec2(width, height) = header.layer_size;
        refuse_size(width as u64, height as u64, bytes.len())?;
        let all = (width * height).saturating_mul(header.channels.bytes_per_pixel) as u64;
        if all > MAX_BYTES_PER_BYTE * bytes.len() as u64 {
            return Err(Refused::damaged(&format!("{} bytes cannot hold {all} bytes of pixels", bytes.len())));
        }
        // Blocks are unpacked whole, with all channels of the layer, wanted or not; a tile may be larger than the picture.
        let (across, down) = match header.blocks {
            BlockDescription::ScanLines => (width, header.compression.scan_lines_per_block()),
            BlockDescription::Tiles(tiles) => (tiles.tile_size.0, tiles.tile_size.1),
        };
        let unpacked = across.saturating_mul(down).saturating_mul(header.channels.bytes_per_pixel) as u64;
        let limit = USUAL_BLOCK.max(MAX_BYTES_PER_BYTE * bytes.len() as u64).min(MAX_BYTES);
        if unpacked > limit {
            return Err(Refused::new(
                format!("one block of its pixels unpacks to {unpacked} bytes; {limit} is the limit"),
                "save it with fewer channels, in smaller tiles or in scan lines",
            ));
        }
    }
    let layer = meta.headers.first().ok_or_else(|| Refused::new("it has no layer", "save it again"))?;
    if layer.deep {
        return Err(Refused::new("it holds deep pixels", "flatten it, and save one sample per pixel"));
    }
    let channels = &layer.channels.list;
    let has = |name: &str| channels.iter().any(|channel| channel.name == *name);
    let grey = !has("R") && !has("G") && !has("B") && has("Y");
    if !grey && !["R", "G", "B", "A"].iter().any(|name| has(name)) || has("RY") || has("BY") {
        let names: Vec<String> = channels.iter().take(8).map(|channel| channel.name.to_string()).collect();
        return Err(Refused::new(
            format!("its first layer has no channels R, G, B, A or Y alone; it has {}", names.join(", ")),
            "save the picture as RGB or RGBA in a single layer",
        ));
    }
    if channels.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
        return Err(Refused::new("its channels differ in resolution", "save every channel at full resolution"));
    }

    // A pixel that no block of a damaged file covers stays NaN, so that it is noticed.
    let file = read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .optional("R", 0.0_f32)
        .optional("G", 0.0_f32)
        .optional("B", 0.0_f32)
        .optional("A", 1.0_f32)
        .optional("Y", 0.0_f32)
        .collect_pixels(
            |Vec2(width, height), _| (width, vec![[f32::NAN; 4]; width * height]),
            move |(width, texels), Vec2(x, y), (r, g, b, a, luminance): (f32, f32, f32, f32, f32)| {
                let [r, g, b] = if grey { [luminance; 3] } else { [r, g, b] };
                texels[y * *width + x] = [r, g, b, a];
            },
        )
        .first_valid_layer()
        .all_attributes()
        // A panic in the pool's threads would end the process; here it is caught.
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(refused)?;
    let Vec2(width, height) = file.layer_data.size;
    Ok(Texture { width: width as u32, height: height as u32, texels: file.layer_data.channel_data.pixels.1 })
}

/// The lines of the standard attribute `comments`: pairs of key and value, as [`encode`] writes them.
pub(super) fn text(bytes: &[u8]) -> Result<Vec<(String, String)>, Refused> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(refused)?;
    let comments = meta.headers.first().and_then(|header| header.own_attributes.comments.clone());
    let comments = comments.map(|text| text.to_string()).unwrap_or_default();
    let pair = |line: &str| line.split_once(": ").map(|(key, value)| (key.to_string(), value.to_string()));
    Ok(comments.lines().filter_map(pair).collect())
}

fn refused(error: Error) -> Refused {
    match error {
        Error::NotSupported(what) => Refused::new(
            format!("it uses a part of OpenEXR that is not read here: {what}"),
            "save it flat, in one layer, with ZIP compression",
        ),
        Error::Invalid(what) => Refused::damaged(&what),
        Error::Io(what) => Refused::damaged(&what),
        Error::Aborted => Refused::damaged(&"reading stopped"),
    }
}

/// R, G and B as 32-bit floats, ZIP compressed; `text` in the standard attribute `comments`, one line a pair, since
/// attributes of our own would be written in a random order and equal images must be equal files.
pub(super) fn encode(image: &Image, text: &[(&str, &str)]) -> Result<Vec<u8>, Error> {
    let size = (image.width as usize, image.height as usize);
    let channels = SpecificChannels::rgb(|Vec2(x, y)| {
        let [r, g, b] = image.pixels[y * size.0 + x];
        (r, g, b)
    });
    let lines: Vec<String> = text.iter().map(|(key, value)| format!("{key}: {value}")).collect();
    let attributes = LayerAttributes {
        software_name: Some(Text::from("diaphane")),
        // UTF-8, as other programs write it; the checked constructors know Latin-1 alone.
        comments: (!lines.is_empty()).then(|| Text::from_slice_unchecked(lines.join("\n").as_bytes())),
        ..LayerAttributes::default()
    };
    let mut bytes = Cursor::new(Vec::new());
    Layers::from_layer(Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, channels))
        .write()
        .to_buffered(&mut bytes)?;
    Ok(bytes.into_inner())
}
