//! Bakes on disk: one file each, named by the bake's key, written aside and renamed.
//!
//! A file is a header (magic, format, name of the step, length, checksum of key and content) and the content. Whatever
//! does not fit its header is not a value: it is reported once, removed and made again.

use super::key::Key;
use crate::problem::{Cause, Problem};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

const MAGIC: &[u8; 8] = b"diaphane";
const FORMAT: u32 = 1;
/// magic 8, format 4, length of the step's name 4, length of the content 8, checksum 32
const HEADER: usize = 56;

/// A folder of bakes.
pub struct Disk {
    folder: PathBuf,
    complained: AtomicBool,
}

/// One bake on disk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    pub step: String,
    pub key: String,
    pub bytes: u64,
    pub path: PathBuf,
}

impl Disk {
    pub fn new(folder: impl Into<PathBuf>) -> Disk {
        Disk { folder: folder.into(), complained: AtomicBool::new(false) }
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn path(&self, key: &Key) -> PathBuf {
        let name = key.to_string();
        self.folder.join(&name[..2]).join(format!("{}.bake", &name[2..]))
    }

    pub(super) fn holds(&self, key: &Key) -> bool {
        self.path(key).is_file()
    }

    /// The content that was stored under `key`. `Ok(None)`: there is none. `Err`: there is something else in its place.
    pub(super) fn read(&self, key: &Key) -> Result<Option<Vec<u8>>, Problem> {
        let path = self.path(key);
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            // A file in the folder's place holds no bakes either; writing says so.
            Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
                return Ok(None);
            }
            Err(error) => return Err(self.unreadable(&path, &error.to_string())),
        };
        match parse(&bytes, key) {
            Ok((_, content)) => Ok(Some(content.to_vec())),
            Err(why) => {
                self.remove(key);
                Err(self.unreadable(&path, why))
            }
        }
    }

    pub(super) fn remove(&self, key: &Key) {
        // Whether or not it can be removed, it is not used: the next write replaces it.
        std::fs::remove_file(self.path(key)).ok();
    }

    pub(super) fn unreadable(&self, path: &Path, why: &str) -> Problem {
        Problem::warning(format!("the bake {} could not be used: {why}", path.display()))
            .hint("it is made again; nothing else is lost")
    }

    /// Stores `content`; the file is whole or it is not there. A folder that cannot be written is reported once.
    pub(super) fn write(&self, step: &str, key: &Key, content: &[u8]) -> Result<(), Problem> {
        self.try_write(step, key, content).or_else(|error| {
            if self.complained.swap(true, Ordering::Relaxed) {
                return Ok(());
            }
            Err(Problem { severity: crate::problem::Severity::Warning, ..Problem::new(Cause::Unfinished, "") }
                .what(format!("bakes cannot be kept in {}: {error}", self.folder.display()))
                .hint("they stay in memory; name another folder with --cache-dir, or switch this off with --no-cache"))
        })
    }

    fn try_write(&self, step: &str, key: &Key, content: &[u8]) -> io::Result<()> {
        let path = self.path(key);
        let folder = path.parent().expect("a bake lies in a folder");
        std::fs::create_dir_all(folder)?;
        let mut file = tempfile::NamedTempFile::with_prefix_in("writing-", folder)?;
        let mut header = Vec::with_capacity(HEADER + step.len());
        header.extend_from_slice(MAGIC);
        header.extend_from_slice(&FORMAT.to_le_bytes());
        header.extend_from_slice(&(step.len() as u32).to_le_bytes());
        header.extend_from_slice(&(content.len() as u64).to_le_bytes());
        header.extend_from_slice(&checksum(key, step.as_bytes(), content));
        header.extend_from_slice(step.as_bytes());
        file.write_all(&header)?;
        file.write_all(content)?;
        file.persist(&path).map_err(|error| error.error)?;
        Ok(())
    }

    /// All bakes, in the order of their paths.
    pub fn entries(&self) -> io::Result<Vec<Entry>> {
        let mut found = Vec::new();
        let folders = match std::fs::read_dir(&self.folder) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(found),
            folders => folders?,
        };
        for folder in folders {
            let folder = folder?.path();
            if !folder.is_dir() {
                continue;
            }
            for file in std::fs::read_dir(&folder)? {
                let path = file?.path();
                if path.extension().is_none_or(|e| e != "bake") {
                    continue;
                }
                let stem = |p: &Path| p.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                let step = read_step_name(&path).unwrap_or_else(|| "(unreadable)".into());
                let bytes = path.metadata()?.len();
                found.push(Entry { step, key: stem(&folder) + &stem(&path), bytes, path });
            }
        }
        found.sort_by(|a, b| a.path.cmp(&b.path));
        Ok(found)
    }

    /// Removes every bake, and nothing else that may lie in the folder. Returns how many, and how many bytes.
    pub fn clear(&self) -> io::Result<(usize, u64)> {
        let entries = self.entries()?;
        for entry in &entries {
            std::fs::remove_file(&entry.path)?;
            if let Some(folder) = entry.path.parent() {
                std::fs::remove_dir(folder).ok(); // only when it is empty by now
            }
        }
        Ok((entries.len(), entries.iter().map(|e| e.bytes).sum()))
    }
}

impl Problem {
    fn what(mut self, what: String) -> Problem {
        self.what = what;
        self
    }
}

fn checksum(key: &Key, step: &[u8], content: &[u8]) -> [u8; 32] {
    *blake3::Hasher::new().update(key.as_bytes()).update(step).update(content).finalize().as_bytes()
}

/// The step's name and the content, or why the bytes are no bake of that key.
fn parse<'a>(bytes: &'a [u8], key: &Key) -> Result<(&'a [u8], &'a [u8]), &'static str> {
    let header = bytes.get(..HEADER).ok_or("it is cut short")?;
    if &header[..8] != MAGIC {
        return Err("it is not a bake");
    }
    if header[8..12] != FORMAT.to_le_bytes() {
        return Err("it was written by another version");
    }
    let name = u32::from_le_bytes(header[12..16].try_into().expect("4 bytes")) as usize;
    let length = u64::from_le_bytes(header[16..24].try_into().expect("8 bytes"));
    let (step, content) = bytes[HEADER..].split_at_checked(name).ok_or("it is cut short")?;
    if content.len() as u64 != length {
        return Err("its length is not what its header says");
    }
    if header[24..56] != checksum(key, step, content) {
        return Err("its checksum does not fit");
    }
    Ok((step, content))
}

fn read_step_name(path: &Path) -> Option<String> {
    use std::io::Read;
    let mut file = std::fs::File::open(path).ok()?;
    let mut header = [0; HEADER];
    file.read_exact(&mut header).ok()?;
    let length = u32::from_le_bytes(header[12..16].try_into().ok()?);
    if &header[..8] != MAGIC || length > 256 {
        return None;
    }
    let mut name = vec![0; length as usize];
    file.read_exact(&mut name).ok()?;
    String::from_utf8(name).ok()
}
