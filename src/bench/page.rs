//! One page with everything on it, which needs no other file: plots, tables, sentences, pictures beside the truths, heat maps.

use super::Shown;
use super::errors::Traced;
use super::machine::Machine;
use super::plot::escaped;
use super::summary::{Line, bytes, milliseconds, number, sentences};
use crate::image::{Display, Format, Image, Tone};
use crate::problem::Problem;
use std::fmt::Write;

/// A scene's part of the page.
pub struct Chapter<'a> {
    pub name: &'a str,
    pub size: String,
    pub display: Display,
    pub truths: &'a [Traced],
    pub shown: &'a [Shown],
    /// In the order of `shown`.
    pub lines: &'a [Line],
    pub plot: &'a str,
}

const ANY: &str = "a text takes any line";

const STYLE: &str = "body{font:15px/1.5 sans-serif;max-width:1240px;margin:2em auto;padding:0 1em;color:#222}\
table{border-collapse:collapse;margin:1em 0}th,td{padding:.25em .8em;border-bottom:1px solid #ddd;text-align:right}\
th:first-child,td:first-child{text-align:left}figure{display:inline-block;margin:0 1em 1em 0;vertical-align:top}\
figcaption{font-size:13px;color:#555}img{display:block;image-rendering:pixelated}code{background:#f3f3f3}\
.note{background:#fff4d6;padding:.5em 1em}svg{max-width:100%;height:auto}";

/// The page of all chapters. The text of `index.html`.
pub fn html(chapters: &[Chapter], machine: &Machine) -> Result<String, Problem> {
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><title>Time against error</title>\
         <style>{STYLE}</style></head><body>\n<h1>Time against error</h1>\n"
    );
    let Machine { adapter, driver, cpu, threads, commit, date, .. } = machine;
    let about = escaped(&format!("{adapter}, {driver}; {cpu}, {threads} threads; commit {commit}; {date}."));
    writeln!(out, "<p>{about}</p>").expect(ANY);
    if machine.is_software {
        out += "<p class=\"note\">This is a software adapter: it draws on the CPU. Times compare techniques with each \
                other on this machine, and say nothing of a graphics card.</p>\n";
    }
    if !machine.is_optimised {
        out += "<p class=\"note\">The program was built without optimisation: do not quote its times.</p>\n";
    }
    out += "<p>Errors are those of the scattered part under direct light, over the pixels in which an object is seen, less \
            the truth's own variance. What is left below three of its standard errors is called “≤ noise”. A frame is what \
            is drawn anew when the camera and the lights move; bakes are made once. Times are medians, with the \
            quartiles.</p>\n";
    for chapter in chapters {
        self::chapter(&mut out, chapter)?;
    }
    Ok(out + "</body></html>\n")
}

fn chapter(out: &mut String, chapter: &Chapter) -> Result<(), Problem> {
    writeln!(out, "<h2>{}, {}</h2>\n{}", escaped(chapter.name), escaped(&chapter.size), chapter.plot).expect(ANY);
    for traced in chapter.truths {
        for sentence in sentences(chapter.lines, traced.truth) {
            writeln!(out, "<p>{}</p>", escaped(&sentence)).expect(ANY);
        }
    }
    table(out, chapter);
    let image = |image: &Image, display: Display| -> Result<String, Problem> {
        let png = image.encode(Format::Png, display, &[])?;
        let (width, height) = (image.width, image.height);
        let data = base64(&png);
        Ok(format!("<img width=\"{width}\" height=\"{height}\" alt=\"\" src=\"data:image/png;base64,{data}\"/>"))
    };
    let figure = |out: &mut String, image: String, caption: &str| {
        writeln!(out, "<figure>{image}<figcaption>{}</figcaption></figure>", escaped(caption)).expect(ANY);
    };
    out.push_str("<div>\n");
    for traced in chapter.truths {
        let error = traced.film.relative_standard_error(super::errors::PART);
        let caption = format!(
            "{}: {} samples per pixel, relative standard error {}",
            traced.truth.title(),
            traced.film.samples,
            number(error)
        );
        figure(out, image(&traced.picture, chapter.display)?, &caption);
    }
    out.push_str("</div>\n");
    let heat = Display { tone: Tone::Srgb, exposure_ev: 0.0 };
    for (shown, line) in chapter.shown.iter().zip(chapter.lines) {
        out.push_str("<div>\n");
        figure(out, image(&shown.picture, chapter.display)?, &line.words);
        for (traced, map) in chapter.truths.iter().zip(&shown.heat) {
            let error = line.error(traced.truth).map_or(String::new(), |error| format!("; relMSE {}", error.words()));
            let caption = format!("{}: relative error against the {}{error}", line.words, traced.truth.title());
            figure(out, image(map, heat)?, &caption);
        }
        out.push_str("</div>\n");
    }
    Ok(())
}

fn table(out: &mut String, chapter: &Chapter) {
    let mut head = String::from("<th>technique</th><th>frame</th><th>bake</th><th>memory</th>");
    for traced in chapter.truths {
        let title = traced.truth.title();
        for measure in ["relMSE", "its standard error", "DSSIM", "FLIP", "FLIP, 99 %", "bias"] {
            write!(head, "<th title=\"against the {title}\">{measure}<br/><small>{title}</small></th>").expect(ANY);
        }
    }
    writeln!(out, "<table><tr>{head}</tr>").expect(ANY);
    for line in chapter.lines {
        let or_none = |value: Option<String>| value.unwrap_or_else(|| "–".into());
        let mut cells = vec![
            or_none(line.frame.as_ref().map(milliseconds)),
            or_none(line.bake.map(|time| format!("{} ms", number(time)))),
            or_none(line.peak_memory.map(bytes)),
        ];
        for traced in chapter.truths {
            cells.extend(match line.error(traced.truth) {
                Some(error) => vec![
                    error.words(),
                    number(error.relmse_se),
                    number(error.dssim),
                    number(error.flip_mean),
                    number(error.flip_p99),
                    format!("{:+.1} %", 100.0 * error.bias),
                ],
                None => vec!["–".into(); 6],
            });
        }
        let cells: String = cells.iter().map(|cell| format!("<td>{}</td>", escaped(cell))).collect();
        writeln!(out, "<tr><td><code>{}</code></td>{cells}</tr>", escaped(&line.words)).expect(ANY);
    }
    out.push_str("</table>\n");
    let listed = |times: &[(String, f64)]| {
        let each: Vec<String> =
            times.iter().take(8).map(|(name, time)| format!("{name} {} ms", number(*time))).collect();
        each.join(", ")
    };
    for line in chapter.lines {
        let [passes, edits] = [&line.passes, &line.edits].map(|times| listed(times));
        for (what, times) in [("passes", passes), ("until an edit shows", edits)] {
            if !times.is_empty() {
                let (technique, words) = (escaped(&line.words), escaped(&format!(", {what}: {times}")));
                writeln!(out, "<p><small><code>{technique}</code>{words}</small></p>").expect(ANY);
            }
        }
    }
}

/// Bytes as text, with padding.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let bits = chunk.iter().chain([&0; 2]).take(3).fold(0u32, |bits, byte| bits << 8 | u32::from(*byte));
        for i in 0..4 {
            match i <= chunk.len() {
                true => text.push(char::from(LETTERS[(bits >> (18 - 6 * i)) as usize & 63])),
                false => text.push('='),
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::tests::{is_well_formed, machine, samples, subject};
    use super::*;
    use crate::reference::film::Film;
    use crate::scene::Truth;
    use std::sync::Arc;

    #[test]
    fn the_page_holds_everything_in_itself() {
        let mut pixel = crate::reference::film::Pixel::default();
        pixel.is_object = true;
        let film = Film { width: 2, height: 2, first: 0, step: 1, samples: 2, pixels: vec![pixel; 4] };
        let truths = [Truth::Volume, Truth::Bssrdf].map(|truth| Traced::new(truth, Arc::new(film.clone())));
        let (_, lines) = samples(&[("A<B>", 10.0, 0.04, 1e-3), ("C", 20.0, 1e-3, 1e-3)]);
        let picture = Arc::new(Image::filled(2, 2, [0.5; 3]));
        let of =
            |name| Shown { subject: subject(name, ""), picture: picture.clone(), heat: vec![(*picture).clone(); 2] };
        let shown = ["A<B>", "C"].map(of);
        let plot = super::super::plot::svg("s & t", "2 x 2", &[Truth::Volume], &lines, &machine());
        let (size, display) = ("2 x 2".to_string(), Display::default());
        let chapter =
            Chapter { name: "s & t", size, display, truths: &truths, shown: &shown, lines: &lines, plot: &plot };
        let html = html(&[chapter], &machine()).unwrap();
        assert!(is_well_formed(&html), "{html}");
        // Two truths, two pictures, two maps of each.
        assert_eq!(html.matches("src=\"data:image/png;base64,iVBOR").count(), 8);
        assert_eq!(html.matches(" src=").count(), 8, "nothing lies elsewhere");
        for words in ["software adapter", "s &amp; t", "A&lt;B&gt;()", "≤ noise (0.00300)", "-12.0 %", "<svg", "–"]
        {
            assert!(html.contains(words), "{words}");
        }
    }

    #[test]
    fn bytes_become_the_letters_that_browsers_read() {
        let of = |text: &str| base64(text.as_bytes());
        assert_eq!(["", "f", "fo", "foo", "foob"].map(of), ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg=="]);
        assert_eq!(base64(&[0xff, 0xef, 0xbe]), "/+++");
    }
}
