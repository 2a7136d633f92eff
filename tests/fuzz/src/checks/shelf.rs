//! Text files that name each other, in a folder with small ones of every kind to be named.

use super::{folder, memory, problems};
use diaphane::image::{Display, Format, Image};
use diaphane::problem::{Problem, Problems};
use diaphane::scene::{Kind, Reader};
use serde::Serialize;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// What a scene or a material may name.
const MATERIAL: &str = "Material(version: 1, surface: (roughness: 0.4), medium: Preset(\"skin1\"))";
const MESH: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\n\
                    f 1/1 3/2 2/3\nf 1/1 2/2 4/3\nf 1/1 4/2 3/3\nf 2/1 3/2 4/3\n";

/// A folder with files, the first of which is to be read.
pub struct Shelf<'a> {
    folder: TempDir,
    files: Vec<(PathBuf, &'a [u8])>,
    reader: Reader,
}

impl<'a> Shelf<'a> {
    pub fn of(files: &[(&str, &'a [u8])]) -> Shelf<'a> {
        let folder = folder();
        let put = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).expect("a file can be written");
            path
        };
        let grey = Image { width: 2, height: 1, pixels: vec![[0.5; 3], [0.25; 3]] };
        put("a.png", &grey.encode(Format::Png, Display::default(), &[]).expect("a picture can be written"));
        put("a.obj", MESH.as_bytes());
        put("a.ron", MATERIAL.as_bytes());
        let files = files.iter().map(|(name, bytes)| (put(name, bytes), *bytes)).collect();
        Shelf { folder, files, reader: Reader::new(Default::default()) }
    }

    pub fn first(&self) -> &Path {
        &self.files[0].0
    }

    /// What reading gives, when it is something; memory is in proportion, and what is said makes sense.
    pub fn read<T>(&self, read: impl FnOnce(&Reader, &Path) -> Result<(T, Vec<Problem>), Problems>) -> Option<T> {
        let files: Vec<(&Path, &[u8])> = self.files.iter().map(|(path, bytes)| (path.as_path(), *bytes)).collect();
        let length: usize = files.iter().map(|(_, bytes)| bytes.len()).sum();
        let (outcome, most) = memory::most(|| read(&self.reader, self.first()));
        // Every value knows its place, and each of a hundred problems the line that it stands in.
        assert!(most <= (8 << 20) + 4096 * length, "{length} bytes of files take {most} bytes of memory");
        match outcome {
            Ok((value, warnings)) => {
                assert!(!warnings.iter().any(Problem::is_error), "{warnings:?}");
                problems::warnings_sound(&warnings, &files);
                Some(value)
            }
            Err(refused) => {
                problems::all_sound(&refused, &files);
                None
            }
        }
    }

    /// Whether the first file can be told from others of another kind: one that says nothing fits several.
    pub fn says_its_kind(&self) -> bool {
        self.reader.kind_of(self.first()).is_ok()
    }

    pub fn is(&self, kind: Kind) {
        assert_eq!(self.reader.kind_of(self.first()).expect("it was read"), kind);
    }

    /// The first file with its defaults written out reads as the same, and has nothing to be written out any more.
    pub fn reads_again<T: PartialEq>(&self, value: &T, read: impl Fn(&Reader, &Path) -> Result<T, Problems>) {
        let text = self.reader.defaults(self.first()).unwrap_or_else(|all| panic!("it was read, but not now: {all}"));
        let path = self.folder.path().join("again.ron");
        std::fs::write(&path, &text).expect("a file can be written");
        let again = read(&self.reader, &path).unwrap_or_else(|all| panic!("{text}\nis not read again: {all}"));
        assert!(again == *value, "{text}\nis not the same");
        let twice = self.reader.defaults(&path).expect("it was read");
        assert_eq!(twice, text);
    }
}

/// That every number in a value is one. What is in quotation marks is not looked at.
pub fn finite(value: &impl Serialize) {
    let text = ron::to_string(value).expect("what is read can be written down");
    let (mut plain, mut quoted, mut escaped) = (String::new(), false, false);
    for letter in text.chars() {
        match (quoted, letter) {
            (true, _) if escaped => escaped = false,
            (true, '\\') => escaped = true,
            (_, '"') => quoted = !quoted,
            (true, _) => {}
            (false, letter) => plain.push(letter),
        }
    }
    let bad = plain.split(|c: char| !c.is_alphanumeric()).any(|word| matches!(word, "inf" | "NaN"));
    assert!(!bad, "a number is none: {text}");
}
