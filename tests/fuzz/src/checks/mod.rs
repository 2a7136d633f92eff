//! What must hold of every reader, whatever bytes it is given. `tools/fuzz` looks for bytes that break it, and
//! `tests/kept.rs` gives it all that ever did.
//!
//! | target | what is read | what must hold of it, beside an answer in time and no panic |
//! |---|---|---|
//! | `image` | PNG, JPEG, Radiance HDR, OpenEXR | as many texels as it says; memory in proportion to the file |
//! | `obj` | Wavefront OBJ | indices in range, finite numbers, unit normals; written down it reads as the same |
//! | `cache` | a bake on disk | what is damaged is never used, and is made again |
//! | `scene` | a scene, and `--set` | numbers within their ranges; with its defaults written out it reads as the same |
//! | `material` | a material and its bases | the same |
//! | `bench` | what is to be measured, and `samples.csv` | the same |
//!
//! A problem names a place that is in the file, shows the line that stands there, and can be read.

mod bench;
mod cache;
mod image;
mod material;
mod memory;
mod obj;
mod panics;
mod problems;
mod scene;
mod shelf;

pub use cache::sign;
pub use memory::Counting;

/// Whoever breaks a law panics.
pub type Check = fn(&[u8]);

pub const TARGETS: [(&str, Check); 6] = [
    ("image", image::check),
    ("obj", obj::check),
    ("cache", cache::check),
    ("scene", scene::check),
    ("material", material::check),
    ("bench", bench::check),
];

/// The check of this name.
pub fn target(name: &str) -> Option<Check> {
    TARGETS.iter().find(|(known, _)| *known == name).map(|(_, check)| *check)
}

/// Parts two texts of one input.
pub const PART: &str = "\n//---\n";

/// The texts of an input, which go into several files.
fn parts(bytes: &[u8]) -> Vec<&[u8]> {
    let mut parts = Vec::new();
    let mut rest = bytes;
    while let Some(at) = rest.windows(PART.len()).position(|part| part == PART.as_bytes()) {
        parts.push(&rest[..at]);
        rest = &rest[at + PART.len()..];
    }
    parts.push(rest);
    parts
}

/// Where files are put to be read.
fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder can be made")
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane::problem::{At, Problem};
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::path::Path;

    fn fails(work: impl FnOnce()) -> bool {
        catch_unwind(AssertUnwindSafe(work)).is_err()
    }

    #[test]
    fn laws_fail_when_they_are_broken() {
        let (path, text) = (Path::new("a.ron"), b"one\r\ntwo".as_slice());
        let place = |line, column| At { column, ..At::in_line(path, line, "two", 0..3) };
        let sound = |at: At| problems::sound(&Problem::files("no").at(at), &[(path, text)]);
        sound(place(2, 1));
        assert!(fails(|| sound(place(3, 1))) && fails(|| sound(place(2, 5))) && fails(|| sound(place(1, 1))));
        assert!(fails(|| problems::sound(&Problem::files(""), &[])));
        assert!(fails(|| problems::all_sound(&diaphane::problem::Problems(vec![Problem::warning("no")]), &[])));

        shelf::finite(&("inf \" NaN", 1.0));
        assert!(fails(|| shelf::finite(&f64::INFINITY)) && fails(|| shelf::finite(&(1, f64::NAN))));

        let (_, most) = memory::most(|| vec![0_u8; 50 << 20].len());
        assert!(most >= 50 << 20);
        assert!(fails(|| panics::caught(|| assert!(fails(|| panic!("our own"))))));
    }
}
