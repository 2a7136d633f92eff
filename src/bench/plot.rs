//! Time against error as SVG: one panel per truth, both axes logarithmic, with the Pareto front. Lower left is better.

use super::machine::Machine;
use super::statistics::pareto_front;
use super::summary::{Line, number};
use crate::scene::Truth;
use std::fmt::Write;

/// Of a panel, and where its axes lie in it, pixels.
const PANEL: (f64, f64) = (600.0, 430.0);
const LEFT: f64 = 74.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 58.0;
/// Of the title above the panels.
const TITLE: f64 = 52.0;
/// The text's size, and the width of a letter of it on average.
const TEXT: f64 = 12.0;
const LETTER: f64 = 6.6;

const FRONT: &str = "#1a5fb4";
const BEATEN: &str = "#77767b";

/// The plot of a scene.
pub fn svg(scene: &str, size: &str, truths: &[Truth], lines: &[Line], machine: &Machine) -> String {
    let (width, height) = (PANEL.0 * truths.len().max(1) as f64, TITLE + PANEL.1);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"{TEXT}\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    text(&mut out, (LEFT, 22.0), "start", "font-size=\"16\"", &format!("{scene}, {size}: time against error"));
    text(&mut out, (LEFT, 42.0), "start", "fill=\"#555\"", &format!("frames drawn on {}", machine.drawn_on()));
    for (i, &truth) in truths.iter().enumerate() {
        writeln!(out, "<g transform=\"translate({} {TITLE})\">", PANEL.0 * i as f64).expect(ANY);
        panel(&mut out, truth, lines);
        out += "</g>\n";
    }
    out + "</svg>\n"
}

const ANY: &str = "a text takes any line";

/// Text for XML.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn text(out: &mut String, (x, y): (f64, f64), anchor: &str, more: &str, words: &str) {
    let words = escaped(words);
    writeln!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" {more}>{words}</text>").expect(ANY);
}

fn panel(out: &mut String, truth: Truth, lines: &[Line]) {
    let middle = 0.5 * (LEFT + PANEL.0 - RIGHT);
    text(out, (middle, 20.0), "middle", "font-weight=\"bold\"", &format!("against the {}", truth.title()));
    let shown: Vec<(&Line, (f64, f64))> = lines.iter().filter_map(|line| Some((line, line.point(truth)?))).collect();
    if shown.is_empty() {
        return text(out, (middle, 0.5 * PANEL.1), "middle", "", "nothing was measured that has a logarithm");
    }
    let points: Vec<(f64, f64)> = shown.iter().map(|(_, point)| *point).collect();
    let times = shown.iter().filter_map(|(line, _)| line.frame).flat_map(|frame| [frame.low, frame.high]);
    let x = Axis::of(times.filter(|t| *t > 0.0).chain(points.iter().map(|p| p.0)), LEFT, PANEL.0 - RIGHT);
    let y = Axis::of(points.iter().map(|p| p.1), PANEL.1 - BOTTOM, TOP);
    frame(out, &x, &y);

    let front = pareto_front(&points);
    let path: Vec<String> =
        front.iter().map(|&i| format!("{:.1},{:.1}", x.at(points[i].0), y.at(points[i].1))).collect();
    writeln!(
        out,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{FRONT}\" stroke-dasharray=\"5 4\"/>",
        path.join(" ")
    )
    .expect(ANY);
    for (i, (line, point)) in shown.iter().enumerate() {
        let colour = if front.contains(&i) { FRONT } else { BEATEN };
        let (px, py) = (x.at(point.0), y.at(point.1));
        if let Some(frame) = line.frame.filter(|frame| frame.low > 0.0) {
            let (low, high) = (x.at(frame.low), x.at(frame.high));
            writeln!(out, "<path d=\"M{low:.1} {py:.1}H{high:.1}\" stroke=\"{colour}\"/>").expect(ANY);
        }
        let fill = if line.error(truth).is_some_and(|error| error.is_noise()) { "white" } else { colour };
        writeln!(
            out,
            "<circle cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"5\" fill=\"{fill}\" stroke=\"{colour}\" stroke-width=\"1.5\"/>"
        )
        .expect(ANY);
    }
    labels(out, truth, &shown, &x, &y);
}

fn frame(out: &mut String, x: &Axis, y: &Axis) {
    let (left, right, top, bottom) = (LEFT, PANEL.0 - RIGHT, TOP, PANEL.1 - BOTTOM);
    for tick in x.ticks() {
        let at = x.at(tick);
        writeln!(out, "<path d=\"M{at:.1} {top}V{bottom}\" stroke=\"#ddd\"/>").expect(ANY);
        text(out, (at, bottom + 18.0), "middle", "", &plain(tick));
    }
    for tick in y.ticks() {
        let at = y.at(tick);
        writeln!(out, "<path d=\"M{left} {at:.1}H{right}\" stroke=\"#ddd\"/>").expect(ANY);
        text(out, (left - 8.0, at + 4.0), "end", "", &plain(tick));
    }
    let (width, height) = (right - left, bottom - top);
    writeln!(
        out,
        "<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"black\"/>"
    )
    .expect(ANY);
    let middle = 0.5 * (left + right);
    text(out, (middle, bottom + 40.0), "middle", "", "time of a frame, ms: median and quartiles");
    let turn = format!("transform=\"rotate(-90 18 {0:.1})\"", 0.5 * (top + bottom));
    text(out, (18.0, 0.5 * (top + bottom)), "middle", &turn, "relMSE; open: ≤ noise");
}

/// Names beside the points, on the side where there is room, moved down until none covers another.
fn labels(out: &mut String, truth: Truth, shown: &[(&Line, (f64, f64))], x: &Axis, y: &Axis) {
    let mut order: Vec<usize> = (0..shown.len()).collect();
    order.sort_by(|&a, &b| y.at(shown[a].1.1).total_cmp(&y.at(shown[b].1.1)));
    let mut taken: Vec<[f64; 3]> = Vec::new();
    for i in order {
        let (line, point) = shown[i];
        let noise = if line.error(truth).is_some_and(|error| error.is_noise()) { ", ≤ noise" } else { "" };
        let words = format!("{}{noise}", line.words);
        let (px, mut py) = (x.at(point.0), y.at(point.1));
        let width = LETTER * words.chars().count() as f64;
        let is_right = px + 10.0 + width < PANEL.0 - RIGHT;
        let (from, to) = if is_right { (px + 10.0, px + 10.0 + width) } else { (px - 10.0 - width, px - 10.0) };
        while taken.iter().any(|[a, b, at]| *a < to && from < *b && (py - at).abs() < TEXT + 1.0) {
            py += 2.0;
        }
        taken.push([from, to, py]);
        let (at, anchor) = if is_right { (from, "start") } else { (to, "end") };
        text(out, (at, py + 4.0), anchor, "", &words);
    }
}

/// A logarithmic axis from one place, pixels, to another.
struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    /// With some room around the values, all above 0; there is at least one.
    fn of(values: impl IntoIterator<Item = f64>, from: f64, to: f64) -> Axis {
        let (mut low, mut high) = (f64::INFINITY, 0.0f64);
        values.into_iter().for_each(|value| (low, high) = (low.min(value), high.max(value)));
        let room = (high / low).powf(0.12).max(1.5);
        Axis { low: low / room, high: high * room, from, to }
    }

    fn at(&self, value: f64) -> f64 {
        self.from + (self.to - self.from) * (value / self.low).ln() / (self.high / self.low).ln()
    }

    /// Powers of ten, and what lies between them where there are few.
    fn ticks(&self) -> Vec<f64> {
        let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
        let ticks = |steps: &[f64]| -> Vec<f64> {
            let all = decades.clone().flat_map(|k| steps.iter().map(move |step| step * 10f64.powi(k)));
            all.filter(|tick| (self.low..=self.high).contains(tick)).collect()
        };
        let coarse = [ticks(&[1.0]), ticks(&[1.0, 2.0, 5.0])].into_iter().find(|ticks| ticks.len() >= 3);
        coarse.unwrap_or_else(|| ticks(&[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]))
    }
}

/// `0.02`, `5`, `1e-6`
fn plain(value: f64) -> String {
    match value {
        v if (1e-4..1e5).contains(&v) => format!("{}", (v * 1e6).round() / 1e6),
        v => number(v).replace(".00e", "e"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{is_well_formed, machine, samples};
    use super::*;

    #[test]
    fn the_plot_names_everybody_the_software_adapter_and_what_noise_hides() {
        let contenders = [("A", 10.0, 0.04, 1e-4), ("B", 20.0, 0.001, 1e-3), ("C", 22.0, 0.05, 1e-4)];
        let (_, lines) = samples(&contenders);
        let svg = svg("a <b>", "32x32", &[Truth::Volume, Truth::Bssrdf], &lines, &machine());
        assert!(svg.contains("a &lt;b&gt;, 32x32") && svg.contains("a software adapter"));
        assert!(svg.contains(">A()<") && svg.contains(">B(), ≤ noise<") && svg.contains(">C()<"));
        // One open marker; two of three on the front, and nothing against the other truth.
        assert_eq!((svg.matches("<circle").count(), svg.matches("r=\"5\" fill=\"white\"").count()), (3, 1));
        let front = svg.split("<polyline points=\"").nth(1).unwrap().split('"').next().unwrap();
        assert_eq!(front.split(' ').count(), 2);
        assert!(svg.contains("nothing was measured"));
        assert!(is_well_formed(&svg));
    }

    #[test]
    fn axes_have_round_numbers() {
        let ticks = |values: &[f64]| Axis::of(values.iter().copied(), 0.0, 100.0).ticks();
        assert_eq!(ticks(&[3.1]), [3.0, 4.0]);
        assert_eq!(ticks(&[0.9, 12.0]), [1.0, 2.0, 5.0, 10.0]);
        assert_eq!(ticks(&[1e-6, 1.0]).len(), 7);
        let axis = Axis::of([1.0, 100.0], 10.0, 110.0);
        assert!((axis.at(10.0) - 60.0).abs() < 1e-9 && axis.at(1.0) > 10.0 && axis.at(100.0) < 110.0);
        assert_eq!([0.02, 5.0, 1e-6, 10.0 * 0.1].map(plain), ["0.02", "5", "1e-6", "1"]);
    }

    #[test]
    fn labels_of_equal_points_do_not_cover_each_other() {
        let (_, lines) = samples(&[("A", 10.0, 0.04, 1e-4), ("B", 10.0, 0.04, 1e-4)]);
        let svg = svg("s", "1x1", &[Truth::Volume], &lines, &machine());
        let place = |name: &str| {
            let line = svg.lines().find(|line| line.contains(&format!(">{name}()<"))).unwrap();
            line.split("y=\"").nth(1).unwrap().split('"').next().unwrap().parse::<f64>().unwrap()
        };
        assert!((place("A") - place("B")).abs() >= TEXT);
    }
}
