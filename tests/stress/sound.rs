//! Looks at every value that a plan's steps made: each number is one, and light is not negative.

use diaphane::geometry::mesh::Mesh;
use diaphane::gpu::{Buffer, Format, Gpu, Images};
use diaphane::image::Image;
use diaphane::reference::volume::Tracer;
use diaphane::store::{Key, Made, Plan, Store};
use half::f16;
use std::collections::HashSet;

/// Steps that make something else than light, by the beginning of their names: what they make may be negative.
const SIGNED: [(&str, &str); 14] = [
    ("geometry.", "positions and normals"),
    ("filtered_normals.", "normals"),
    ("frame.gbuffer", "positions"),
    ("frame.openness", "spherical harmonics of what is open"),
    ("frame.through", "a depth: where a ray leaves less where it enters"),
    ("profile.disk_means", "logarithms"),
    ("screen.sums", "places"),
    ("long_range.splats", "places and normals"),
    ("long_range.far", "which pixel a block's light is for and how often it counts, -1 for none, beside the light"),
    ("sky.light", "directions, beside the light from there"),
    ("sky.lamps", "directions, likewise"),
    ("layered.", "planes, and slopes of maps"),
    ("sky.harmonics", "spherical harmonics of light"),
    ("thickness.", "spherical harmonics"),
];

/// Steps whose halves stand for whatever is brighter, too: a sun in a sky's image.
const SATURATED: [&str; 2] = ["sky.image", "gpu.upload"];

/// Something that must not be: which step made it, where in its value, and what it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Flaw {
    pub step: String,
    pub place: String,
    pub what: String,
}

impl std::fmt::Display for Flaw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}, {}: {}", self.step, self.place, self.what)
    }
}

/// What is looked for in the numbers of one step.
struct Search {
    may_be_negative: bool,
    numbers: usize,
    /// The first number that must not be, and where.
    found: Option<(String, String)>,
}

impl Search {
    fn look(&mut self, value: f64, place: impl FnOnce() -> String) {
        self.numbers += 1;
        if self.found.is_none() && (!value.is_finite() || value < 0.0 && !self.may_be_negative) {
            self.found = Some((place(), format!("{value}")));
        }
    }
}

/// Looks at all that is there of a plan, in its order: the first flaw is where it began. Values in `known` were looked at
/// before. Tells how many numbers there were.
pub fn inspect(store: &Store, plan: &Plan, gpu: Option<&Gpu>, known: &mut HashSet<Key>) -> Result<usize, Flaw> {
    let mut numbers = 0;
    for made in store.made(plan) {
        // What was given is a file's content; what is sent to the device was looked at where it was made.
        if made.step.is_given() || known.contains(&made.step.key) {
            continue;
        }
        let search = search(&made, gpu)?;
        if let Some((place, what)) = search.found {
            return Err(Flaw { step: made.step.name.into(), place, what });
        }
        numbers += search.numbers;
        known.insert(made.step.key);
    }
    Ok(numbers)
}

fn search(made: &Made, gpu: Option<&Gpu>) -> Result<Search, Flaw> {
    let name = made.step.name;
    let flaw = |what: String| Flaw { step: name.into(), place: "the whole".into(), what };
    let gpu = || gpu.expect("what is on a device was made on one");
    let may_be_negative = SIGNED.iter().any(|(begins, _)| name.starts_with(begins));
    let mut search = Search { may_be_negative, numbers: 0, found: None };
    if let Some(images) = made.value::<Images>() {
        let read = images.floats(gpu(), |texel, value| {
            // Some devices keep a half that is too large as the largest one, others as infinity: it is wrong on all.
            let is_half = matches!(images.0[texel.image].shape.format, Format::Rgba16Float | Format::R16Float);
            let is_largest = is_half && value.abs() >= f16::MAX.to_f32() && !SATURATED.contains(&name);
            search.look(if is_largest { f64::INFINITY.copysign(value.into()) } else { value.into() }, || {
                texel.to_string()
            });
        });
        read.map_err(|problem| flaw(problem.to_string()))?;
    } else if let Some(buffer) = made.value::<Buffer>() {
        // Bytes as they are in a value that was looked at: words of bits among them.
        if name != "gpu.upload" {
            let place = |element: usize, word: usize| move || format!("vertex or element {element}, word {word}");
            let read = buffer.floats(gpu(), |element, word, v| search.look(v.into(), place(element, word)));
            read.map_err(|problem| flaw(problem.to_string()))?;
        }
    } else if let Some(image) = made.value::<Image>() {
        for (i, pixel) in image.pixels.iter().enumerate() {
            let place = || format!("pixel {}, {}", i % image.width as usize, i / image.width as usize);
            pixel.iter().for_each(|v| search.look((*v).into(), place));
        }
    } else if let Some(mesh) = made.value::<Mesh>() {
        for (what, vectors) in [("position", &mesh.positions), ("normal", &mesh.normals)] {
            for (i, v) in vectors.iter().enumerate() {
                v.to_array().iter().for_each(|v| search.look((*v).into(), || format!("{what} of vertex {i}")));
            }
        }
        // A normal without a direction is a NaN in the next step.
        if search.found.is_none()
            && let Some(i) = mesh.normals.iter().position(|n| (n.length() - 1.0).abs() > 1e-3)
        {
            search.found =
                Some((format!("normal of vertex {i}"), format!("its length is {}", mesh.normals[i].length())));
        }
    } else if !made.floats(&mut |place, value| search.look(value, || place.to_string())) {
        // The scene as rays see it: its meshes were looked at, and what is traced through it will be.
        if made.value::<Tracer>().is_none() {
            return Err(flaw(
                "a value of a type that the harness cannot look into: teach tests/stress/sound.rs".into(),
            ));
        }
    }
    Ok(search)
}
