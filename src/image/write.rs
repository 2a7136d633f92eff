//! An [`Image`] into bytes, and bytes into a file.

use std::fs;
use std::io::{self, Cursor, Write as _};
use std::path::Path;

use super::{Image, Tone, exr};
use crate::problem::{At, Cause, Problem};

/// The formats that are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 8 bits a channel, display-encoded.
    Png,
    /// 32-bit float, linear, before exposure.
    Exr,
}

impl Format {
    /// The one that the file's extension names.
    pub fn of(file: &Path) -> Result<Format, Problem> {
        let extension = file.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Format::Png),
            Some("exr") => Ok(Format::Exr),
            _ => Err(Problem::new(Cause::Words, "the name of an image to write ends in .png or .exr")
                .at(At::file(file))
                .hint("PNG is what a display shows, EXR is linear light")),
        }
    }
}

/// How radiance is shown, where the format stores what a display is sent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Display {
    pub tone: Tone,
    /// Radiance is multiplied by 2 to this power.
    pub exposure_ev: f32,
}

/// What stands for a pixel that is NaN or infinite: seen at once, and in no curve's range by accident.
const NOT_A_COLOUR: [u8; 3] = [255, 0, 255];

impl Image {
    /// The content of a file of that format. `text` are pairs of key and value that travel with the picture, as text
    /// chunks of a PNG or the comments of an EXR; a key is 1 to 79 Latin-1 characters long.
    ///
    /// EXR keeps NaN and infinities; PNG shows them magenta.
    pub fn encode(&self, format: Format, display: Display, text: &[(&str, &str)]) -> Result<Vec<u8>, Problem> {
        assert_eq!(self.pixels.len(), self.width as usize * self.height as usize, "an image is as large as its pixels");
        let failed = |why: &dyn std::fmt::Display| {
            Problem::new(
                Cause::Unfinished,
                format!("an image of {} x {} pixels cannot be written: {why}", self.width, self.height),
            )
        };
        match format {
            Format::Png => self.encode_png(display, text).map_err(|why| failed(&why)),
            Format::Exr => exr::encode(self, text).map_err(|why| failed(&why)),
        }
    }

    fn encode_png(&self, display: Display, text: &[(&str, &str)]) -> Result<Vec<u8>, png::EncodingError> {
        let levels: Vec<[u8; 3]> = self
            .pixels
            .iter()
            .map(|&pixel| match pixel.iter().all(|v| v.is_finite()) {
                true => display.tone.display(display.exposure_ev, pixel).map(|v| (v * 255.0).round() as u8),
                false => NOT_A_COLOUR,
            })
            .collect();

        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(Cursor::new(&mut bytes), self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        match display.tone {
            Tone::Clamp => encoder.set_source_gamma(png::ScaledFloat::new(1.0)),
            Tone::Srgb | Tone::Filmic => encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric),
        }
        for (key, value) in text {
            // Every reader knows tEXt, which is Latin-1; the rest of the world's scripts need iTXt.
            match value.is_ascii() {
                true => encoder.add_text_chunk(key.to_string(), value.to_string())?,
                false => encoder.add_itxt_chunk(key.to_string(), value.to_string())?,
            }
        }
        let mut writer = encoder.write_header()?;
        writer.write_image_data(levels.as_flattened())?;
        writer.finish()?;
        Ok(bytes)
    }
}

/// The text chunks that stand before the pixels of a PNG: ASCII ones first, then those in UTF-8.
pub fn png_text(bytes: &[u8], file: &Path) -> Result<Vec<(String, String)>, Problem> {
    let damaged = |why: &dyn std::fmt::Display| {
        Problem::files(format!("this is not a PNG, or a damaged one: {why}")).at(At::file(file))
    };
    let reader = png::Decoder::new(Cursor::new(bytes)).read_info().map_err(|why| damaged(&why))?;
    let info = reader.info();
    let mut text: Vec<_> =
        info.uncompressed_latin1_text.iter().map(|chunk| (chunk.keyword.clone(), chunk.text.clone())).collect();
    for chunk in &info.utf8_text {
        text.push((chunk.keyword.clone(), chunk.get_text().map_err(|why| damaged(&why))?));
    }
    Ok(text)
}

/// What an EXR says of itself, as [`Image::encode`] wrote it.
pub fn exr_text(bytes: &[u8], file: &Path) -> Result<Vec<(String, String)>, Problem> {
    exr::text(bytes).map_err(|refused| refused.problem(file))
}

/// Writes a file so that whoever looks finds the old content or the new, never a part: aside in the same folder, then
/// renamed. Folders that are missing are made. A link is followed, and a device or pipe is written to as it is.
pub fn write_file(file: &Path, bytes: &[u8]) -> Result<(), Problem> {
    replace(file, bytes).map_err(|why| {
        Problem::new(Cause::Unfinished, format!("it cannot be written: {why}")).at(At::file(file)).hint(
            "what the file held before is unchanged; free some space or choose another place, then run this again",
        )
    })
}

fn replace(file: &Path, bytes: &[u8]) -> io::Result<()> {
    // Renaming onto a link would replace the link, and onto /dev/null the device.
    let target = match fs::metadata(file) {
        Ok(found) if found.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        Ok(found) if !found.is_file() => return fs::OpenOptions::new().write(true).open(file)?.write_all(bytes),
        Ok(_) => fs::canonicalize(file)?,
        Err(_) => file.to_path_buf(),
    };
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    let mut aside = tempfile::Builder::new();
    aside.prefix(".diaphane-").suffix(".tmp");
    // A temporary file is private, and would stay so under its new name; the umask applies to this as to any new file.
    #[cfg(unix)]
    aside.permissions(<fs::Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
    let mut aside = aside.tempfile_in(folder)?;
    aside.write_all(bytes)?;
    aside.persist(&target).map_err(|failed| failed.error)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::{Encoding, decode, tone};
    use super::*;

    /// 16 x 16 colours from black to beyond white, no two alike.
    fn ramp() -> Image {
        let pixels = (0..256).map(|i| [i as f32 / 200.0, (i * 7 % 256) as f32 / 255.0, i as f32 * 1e-3]).collect();
        Image { width: 16, height: 16, pixels }
    }

    fn png(image: &Image, tone: Tone, exposure_ev: f32) -> Vec<u8> {
        image.encode(Format::Png, Display { tone, exposure_ev }, &[]).unwrap()
    }

    fn read(bytes: &[u8], encoding: Encoding) -> Image {
        decode(bytes, Path::new("test"), encoding).unwrap().image()
    }

    #[test]
    fn a_png_holds_what_the_curve_says_to_half_a_level() {
        let image = ramp();
        for tone in [Tone::Clamp, Tone::Srgb, Tone::Filmic] {
            let back = read(&png(&image, tone, 0.5), Encoding::Linear);
            for (stored, &pixel) in back.pixels.iter().zip(&image.pixels) {
                let wanted = tone.display(0.5, pixel);
                for c in 0..3 {
                    assert!((stored[c] - wanted[c]).abs() <= 0.5 / 255.0 + 1e-6, "{tone:?} {pixel:?}");
                }
            }
            assert_ne!(png(&image, tone, 0.5), png(&image, tone, 0.6));
        }
        // Read as sRGB, what was not cut comes back as the light that it was.
        let back = read(&png(&image, Tone::Srgb, 0.0), Encoding::Srgb);
        assert!((back.at(3, 2)[0] - image.at(3, 2)[0]).abs() < 0.004);
    }

    #[test]
    fn every_level_of_a_png_survives_reading_and_writing() {
        let levels = Image { width: 256, height: 1, pixels: (0..256).map(|i| [i as f32 / 255.0; 3]).collect() };
        let linear = png(&levels, Tone::Clamp, 0.0);
        assert_eq!(read(&linear, Encoding::Linear), levels);
        let srgb = png(&read(&linear, Encoding::Srgb), Tone::Srgb, 0.0);
        assert_eq!(read(&srgb, Encoding::Linear), levels);
        assert_eq!(read(&srgb, Encoding::Srgb).pixels[128], [tone::linear_from_srgb(128.0 / 255.0); 3]);
    }

    #[test]
    fn an_exr_holds_the_very_bits_before_exposure_and_equal_images_are_equal_files() {
        let mut image = ramp();
        image.pixels[5] = [f32::NAN, f32::INFINITY, -1e30];
        let display = Display { tone: Tone::Filmic, exposure_ev: 4.0 };
        let text = [("scene", "first light"), ("objet", "lapin doré"), ("seed", "1")];
        let bytes = image.encode(Format::Exr, display, &text).unwrap();
        let back = read(&bytes, Encoding::Srgb);
        let bits = |image: &Image| image.pixels.iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>();
        assert_eq!(bits(&back), bits(&image));
        assert_eq!((back.width, back.height), (16, 16));
        assert_eq!(image.encode(Format::Exr, Display::default(), &text).unwrap(), bytes);
        let comments = "scene: first light\nobjet: lapin doré\nseed: 1".as_bytes();
        assert!(bytes.windows(comments.len()).any(|part| part == comments));
    }

    #[test]
    fn text_travels_with_a_png() {
        let text = [("Software", "diaphane"), ("scene", "Scene(\n  version: 1,\n)"), ("title", "大理石のウサギ")];
        let bytes = ramp().encode(Format::Png, Display::default(), &text).unwrap();
        let back = png_text(&bytes, Path::new("a.png")).unwrap();
        assert_eq!(back.iter().map(|(k, v)| (k.as_str(), v.as_str())).collect::<Vec<_>>(), text);
        assert!(png_text(&bytes[..60], Path::new("a.png")).is_err());
        let unfit = ramp().encode(Format::Png, Display::default(), &[("", "no key")]).unwrap_err();
        assert_eq!(unfit.cause, Cause::Unfinished);
    }

    #[test]
    fn what_is_no_number_is_seen() {
        let mut image = Image::filled(2, 1, [0.0; 3]);
        image.pixels[1][2] = f32::NAN;
        for tone in [Tone::Clamp, Tone::Srgb, Tone::Filmic] {
            let back = read(&png(&image, tone, 0.0), Encoding::Linear);
            assert_eq!(back.pixels, [[0.0; 3], [1.0, 0.0, 1.0]]);
        }
        let empty = Image::default().encode(Format::Png, Display::default(), &[]).unwrap_err();
        assert!(empty.what.contains("0 x 0"), "{}", empty.what);
    }

    #[test]
    fn the_extension_names_the_format() {
        assert_eq!(Format::of(Path::new("a.b/c.PNG")), Ok(Format::Png));
        assert_eq!(Format::of(Path::new("c.exr")), Ok(Format::Exr));
        for wrong in ["c.jpg", "png", "", "c."] {
            assert_eq!(Format::of(Path::new(wrong)).unwrap_err().cause, Cause::Words, "{wrong}");
        }
    }

    #[test]
    fn a_file_is_replaced_whole_in_folders_made_for_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("new/deep/a.png");
        write_file(&file, b"first").unwrap();
        write_file(&file, b"second").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"second");
        assert_eq!(fs::read_dir(file.parent().unwrap()).unwrap().count(), 1, "nothing is left aside");

        let onto_folder = write_file(folder.path(), b"x").unwrap_err();
        assert_eq!(onto_folder.cause, Cause::Unfinished);
        let under_file = write_file(&file.join("b.png"), b"x").unwrap_err();
        assert_eq!(under_file.at.unwrap().file, file.join("b.png"));
        assert_eq!(fs::read(&file).unwrap(), b"second");
    }

    #[cfg(unix)]
    #[test]
    fn a_file_has_the_usual_permissions_and_links_and_devices_stay_what_they_are() {
        use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _, symlink};
        let folder = tempfile::tempdir().unwrap();
        let (plain, ours, link) = (folder.path().join("plain"), folder.path().join("a"), folder.path().join("link"));
        fs::write(&plain, b"").unwrap();
        write_file(&ours, b"old").unwrap();
        let mode = |file: &Path| fs::metadata(file).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));

        symlink(&ours, &link).unwrap();
        write_file(&link, b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&ours).unwrap(), b"new");

        write_file(Path::new("/dev/null"), b"gone").unwrap();
        assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    }

    /// /dev/full answers every write as a full disk does.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_work_that_could_not_finish() {
        let problem = write_file(Path::new("/dev/full"), b"x").unwrap_err();
        assert_eq!(problem.cause, Cause::Unfinished);
        assert!(problem.to_string().starts_with("/dev/full: error: it cannot be written: No space left"), "{problem}");
    }
}
