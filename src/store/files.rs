//! The one door through which bytes enter: every file is read here, and named by the hash of its content.
//!
//! Every path that was asked for is remembered, found or not, with what it held then: whoever follows the files
//! ([`Follow`](super::Follow)) knows all that a picture depends on, a file that is still missing included.

use super::key::Key;
use std::collections::BTreeMap;
use std::fs::Metadata;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, SystemTime};

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
    asked: Mutex<BTreeMap<PathBuf, Held>>,
}

impl Files {
    pub fn read(&self, path: &Path) -> io::Result<File> {
        let (held, file) = read(path);
        // Of a file that is saved between two reads, the first content stands: some of the picture is made of it, so the
        // picture is to be made again.
        self.noted().entry(path.to_path_buf()).or_insert(held);
        file
    }

    /// All paths that were asked for since the last call of [`Files::forget`], in order.
    pub fn asked(&self) -> Vec<PathBuf> {
        self.noted().keys().cloned().collect()
    }

    /// The same, with what each held when it was first read since.
    pub(super) fn held(&self) -> BTreeMap<PathBuf, Held> {
        self.noted().clone()
    }

    /// Begins the list of [`Files::asked`] anew: whoever reads a scene again wants to know what it depends on by now.
    pub fn forget(&self) {
        self.noted().clear();
    }

    fn noted(&self) -> MutexGuard<'_, BTreeMap<PathBuf, Held>> {
        self.asked.lock().expect("nobody panics while noting a path")
    }
}

/// What a path held at some time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    /// The name of its content; none of what cannot be read.
    pub key: Option<Key>,
    /// From before the content was read; none of what is not there.
    stamp: Option<Stamp>,
    /// Whether the stamp was old by then, so that a later write cannot have left the same one.
    settled: bool,
}

impl Held {
    /// What it holds now. It is read again unless its stamp proves that it holds the same.
    pub fn now(self, path: &Path) -> Held {
        match std::fs::metadata(path) {
            Ok(metadata) if self.settled && self.stamp == Some(Stamp::of(&metadata)) => self,
            _ => read(path).0,
        }
    }
}

/// What changes with a file's content, but for writes that follow too fast on each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stamp {
    length: u64,
    written: Option<SystemTime>,
    /// Which file it is, and when anything about it changed: a copy may keep the time and length of its original.
    #[cfg(unix)]
    inode: (u64, u64, i64, i64),
}

/// File systems keep time in steps of up to this.
const COARSEST: Duration = Duration::from_secs(2);

impl Stamp {
    fn of(metadata: &Metadata) -> Stamp {
        #[cfg(unix)]
        use std::os::unix::fs::MetadataExt;
        Stamp {
            length: metadata.len(),
            written: metadata.modified().ok(),
            #[cfg(unix)]
            inode: (metadata.dev(), metadata.ino(), metadata.ctime(), metadata.ctime_nsec()),
        }
    }

    /// The last change that it tells of.
    fn changed(&self) -> Option<SystemTime> {
        #[cfg(unix)]
        {
            let (.., seconds, _) = self.inode;
            let changed = SystemTime::UNIX_EPOCH + Duration::from_secs(u64::try_from(seconds).ok()?);
            Some(changed.max(self.written?))
        }
        #[cfg(not(unix))]
        self.written
    }
}

fn read(path: &Path) -> (Held, io::Result<File>) {
    let metadata = match std::fs::metadata(path) {
        Ok(metadata) => metadata,
        Err(error) => return (Held { key: None, stamp: None, settled: false }, Err(error)),
    };
    let stamp = Stamp::of(&metadata);
    let age = stamp.changed().and_then(|changed| SystemTime::now().duration_since(changed).ok());
    let file = content(path, &metadata).map(|bytes| {
        let key = Key::of_bytes(&bytes);
        File { path: path.to_path_buf(), bytes, key }
    });
    let key = file.as_ref().ok().map(|file| file.key);
    (Held { key, stamp: Some(stamp), settled: age.is_some_and(|age| age > COARSEST) }, file)
}

fn content(path: &Path, metadata: &Metadata) -> io::Result<Arc<[u8]>> {
    // A pipe or a device would wait for ever, and a folder gives an obscure error on some systems.
    if !metadata.is_file() {
        let what = if metadata.is_dir() { "it is a folder" } else { "it is not a regular file" };
        return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    }
    if metadata.len() > LARGEST {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, "it is larger than 4 GiB"));
    }
    Ok(std::fs::read(path)?.into())
}
