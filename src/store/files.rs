//! The one door through which bytes enter: every file is read here, and named by the hash of its content.
//!
//! Every path that was asked for is remembered, found or not, so that whoever watches the files knows all that a picture
//! depends on, a file that is still missing included.

use super::key::Key;
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// A file's content under its name. What is hashed is what is used: nobody reads the file a second time.
#[derive(Clone, Debug)]
pub struct File {
    pub path: PathBuf,
    pub bytes: Arc<[u8]>,
    pub key: Key,
}

/// Larger files are refused rather than read: no scene, mesh or image of use is larger.
const LARGEST: u64 = 4 << 30;

#[derive(Default)]
pub struct Files {
    asked: Mutex<BTreeSet<PathBuf>>,
}

impl Files {
    pub fn read(&self, path: &Path) -> io::Result<File> {
        self.asked.lock().expect("nobody panics while noting a path").insert(path.to_path_buf());
        let metadata = std::fs::metadata(path)?;
        // A pipe or a device would wait for ever, and a folder gives an obscure error on some systems.
        if !metadata.is_file() {
            let what = if metadata.is_dir() { "it is a folder" } else { "it is not a regular file" };
            return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
        }
        if metadata.len() > LARGEST {
            return Err(io::Error::new(io::ErrorKind::FileTooLarge, "it is larger than 4 GiB"));
        }
        let bytes: Arc<[u8]> = std::fs::read(path)?.into();
        let key = Key::of_bytes(&bytes);
        Ok(File { path: path.to_path_buf(), bytes, key })
    }

    /// All paths that were asked for since the last call of [`Files::forget`], in order.
    pub fn asked(&self) -> Vec<PathBuf> {
        self.asked.lock().expect("nobody panics while noting a path").iter().cloned().collect()
    }

    pub fn forget(&self) {
        self.asked.lock().expect("nobody panics while noting a path").clear();
    }
}
