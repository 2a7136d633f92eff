//! The one door for bytes, and the names of values.

use std::collections::BTreeSet;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// The content hash of a value: 32 bytes of BLAKE3.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
pub struct Key([u8; 32]);

impl Key {
    pub fn of(bytes: &[u8]) -> Key {
        Key(*blake3::hash(bytes).as_bytes())
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|b| write!(f, "{b:02x}"))
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// A file as it was read.
#[derive(Clone, Debug)]
pub struct File {
    pub path: PathBuf,
    pub bytes: Arc<[u8]>,
    pub key: Key,
}

/// Reads files, and remembers which were asked for.
#[derive(Default)]
pub struct Files {
    asked: Mutex<BTreeSet<PathBuf>>,
}

impl Files {
    pub fn read(&self, path: &Path) -> std::io::Result<File> {
        self.asked.lock().unwrap().insert(path.to_path_buf());
        let bytes = std::fs::read(path)?;
        Ok(File { path: path.to_path_buf(), key: Key::of(&bytes), bytes: bytes.into() })
    }
}
