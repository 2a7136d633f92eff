//! Images: sizes are what was promised, and so is memory.

use super::{memory, panics, problems};
use diaphane::image::{Encoding, MAX_BYTES, MAX_SIDE, Texture, decode, exr_text};
use diaphane::problem::Problem;
use std::path::Path;

const FILE: &str = "in/fuzz.dat";
/// What a decoder may take for any file: its own tables.
const TABLES: usize = 16 << 20;
/// No format packs more pixels into a byte: one-bit PNG, deflated as far as it goes.
const PIXELS_PER_BYTE: usize = 8 * 1032;
/// A texel, and the integers that it was, twice.
const BYTES_PER_PIXEL: usize = 16 + 2 * 8;
/// The largest texture, and the pixels that it is made of.
const LARGEST: usize = 3 * MAX_BYTES as usize;

pub fn check(bytes: &[u8]) {
    let (read, most) = memory::most(|| read(bytes, Encoding::Linear));
    let allowed = LARGEST.min(TABLES + bytes.len() * PIXELS_PER_BYTE * BYTES_PER_PIXEL);
    assert!(most <= allowed, "{} bytes of file take {most} bytes of memory, more than {allowed}", bytes.len());
    match read {
        Ok(texture) => {
            sound(&texture);
            assert!(texture.texels.len() <= bytes.len() * PIXELS_PER_BYTE);
            let float = bytes.starts_with(b"#?") || bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]);
            let share = |v: &f32| (0.0..=1.0).contains(v);
            assert!(float || texture.texels.iter().flatten().all(share), "integers are from 0 to 1");
            if texture.texels.len() < 1 << 16 {
                let same = |a: &Texture, b: &Texture| {
                    let bits = |t: &Texture| t.texels.iter().flatten().map(|v| v.to_bits()).collect::<Vec<_>>();
                    (a.width, a.height, bits(a)) == (b.width, b.height, bits(b))
                };
                assert!(same(&texture, &self::read(bytes, Encoding::Linear).expect("it was read before")));
                // What is never a number in the one encoding is none in the other.
                sound(&self::read(bytes, Encoding::Srgb).expect("it was read as linear"));
            }
        }
        Err(problem) => refused(&problem),
    }
    let (text, most) = memory::most(|| exr_text(bytes, Path::new(FILE)));
    assert!(most <= TABLES + 64 * bytes.len(), "{} bytes of file take {most} bytes for their text", bytes.len());
    text.err().iter().for_each(refused);
}

fn read(bytes: &[u8], encoding: Encoding) -> Result<Texture, Problem> {
    panics::caught(|| decode(bytes, Path::new(FILE), encoding))
}

fn sound(texture: &Texture) {
    let (width, height) = (u64::from(texture.width), u64::from(texture.height));
    assert!((1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height), "{width} x {height}");
    assert_eq!(texture.texels.len() as u64, width * height);
    assert!(width * height * 16 <= MAX_BYTES);
    let finite = texture.texels.iter().flatten().all(|v| v.is_finite());
    let problems = texture.check(Path::new(FILE));
    assert_eq!(problems.iter().any(Problem::is_error), !finite);
    problems::warnings_sound(&problems, &[]);
}

fn refused(problem: &Problem) {
    problems::sound(problem, &[]);
    let at = problem.at.as_ref().expect("a file is named");
    assert!(at.file == Path::new(FILE) && at.line == 0 && problem.hint.is_some() && problem.is_error(), "{problem}");
}
