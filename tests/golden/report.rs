//! What failed, side by side with what was expected: one file that needs no other.

use diaphane::image::{Display, Format};
use diaphane::metric::{Unit, heat_map};
use std::path::{Path, PathBuf};

/// A picture that is not its golden.
pub struct Case {
    name: String,
    message: String,
    /// PNG files with their captions.
    pictures: Vec<(&'static str, Vec<u8>)>,
}

impl Case {
    /// `difference` is a FLIP map and its width and height.
    pub fn new(
        name: &str,
        message: &str,
        expected: Option<Vec<u8>>,
        actual: Vec<u8>,
        difference: Option<(&[f64], (u32, u32))>,
    ) -> Case {
        let mut pictures = Vec::new();
        pictures.extend(expected.map(|png| ("expected", png)));
        pictures.push(("actual", actual));
        pictures.extend(difference.map(|(map, (width, height))| {
            let map = heat_map(map, width, height, None, Unit::Plain);
            ("difference (FLIP)", map.encode(Format::Png, Display::default(), &[]).expect("a map can be encoded"))
        }));
        Case { name: name.to_string(), message: message.to_string(), pictures }
    }
}

/// Writes the report of what failed and says where it is, or removes the one of another time.
pub fn write(cases: &[Case]) {
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("it lies in the target folder");
    let folder: PathBuf = target.join("golden-report");
    if cases.is_empty() {
        std::fs::remove_dir_all(&folder).ok(); // it need not be there
        return;
    }
    std::fs::create_dir_all(&folder).expect("a folder can be made");
    let file = folder.join("index.html");
    std::fs::write(&file, page(cases)).expect("a report can be written");
    eprintln!("what failed is shown in {}", file.display());
}

fn page(cases: &[Case]) -> String {
    let mut html = String::from(
        "<!doctype html><meta charset=\"utf-8\"><title>Pictures that are not what they were</title>\n<style>\
         body{background:#333;color:#eee;font:15px sans-serif;margin:2em}\
         figure{display:inline-block;margin:0 1em 1em 0}img{image-rendering:pixelated;min-height:288px}</style>\n",
    );
    for case in cases {
        html += &format!("<h2>{}</h2>\n<p>{}</p>\n", escaped(&case.name), escaped(&case.message));
        for (caption, png) in &case.pictures {
            let data = base64(png);
            html += &format!(
                "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\"><figcaption>{caption}</figcaption></figure>\n"
            );
        }
    }
    html
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for part in bytes.chunks(3) {
        let group = (0..3).fold(0, |group, i| group << 8 | u32::from(*part.get(i).unwrap_or(&0)));
        for i in 0..4 {
            let digit = DIGITS[(group >> (18 - 6 * i)) as usize & 63];
            text.push(if i <= part.len() { char::from(digit) } else { '=' });
        }
    }
    text
}
