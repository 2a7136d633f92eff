//! Bakes on disk: one file each, named by the bake's key, written aside and renamed.
//!
//! A file is a header (magic, format, lengths, checksum of all that follows and of the key), the name of the
//! step and the content. Whatever
//! does not fit its header is not a value: it is reported once, removed and made again. So nothing need be flushed to the
//! disk, and processes that share a folder need no lock: they write the same bytes under the same name.
//!
//! The folder keeps to a size: what was used longest ago goes first. A file's time of modification is when it was last
//! used.

use super::key::Key;
use crate::problem::{Cause, Problem, Severity};
use std::collections::HashSet;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, SystemTime};

const MAGIC: &[u8; 8] = b"diaphane";
const FORMAT: u32 = 2;
/// magic 8, format 4, length of the step's name 4, length of the content 8, checksum 32
const HEADER: usize = 56;

/// What the bakes of a folder may take together, bytes.
const USUAL_LIMIT: u64 = 4 << 30;
/// How files begin that are not yet bakes.
const ASIDE: &str = "writing-";
/// No bake takes so long to write: its writer was killed.
const ABANDONED: Duration = Duration::from_secs(3600);

/// A folder of bakes.
pub struct Disk {
    folder: PathBuf,
    limit: u64,
    seen: Mutex<Seen>,
}

/// What this process did to the folder.
#[derive(Default)]
struct Seen {
    /// Whether it was said that the folder cannot be written.
    complained: bool,
    reported: HashSet<Key>,
    used: HashSet<Key>,
    /// What the bakes take together, once something was written: listed once, then counted on. What other processes
    /// write meanwhile they count themselves.
    bytes: Option<u64>,
}

/// One bake on disk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    pub step: String,
    pub key: String,
    pub bytes: u64,
    pub path: PathBuf,
    /// When it was last written or read.
    pub used: SystemTime,
}

/// How many files were removed, and what remains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Swept {
    pub bakes: usize,
    /// Files that a killed process had not finished.
    pub abandoned: usize,
    pub bytes: u64,
    pub kept: usize,
    pub kept_bytes: u64,
}

impl Entry {
    /// Removes the file; that it is gone already is no error.
    pub fn remove(&self) -> io::Result<()> {
        remove(&self.path)
    }
}

impl Disk {
    pub fn new(folder: impl Into<PathBuf>) -> Disk {
        Disk { folder: folder.into(), limit: USUAL_LIMIT, seen: Mutex::default() }
    }

    /// With another limit of what all bakes take together, bytes.
    pub fn limit(self, limit: u64) -> Disk {
        Disk { limit, ..self }
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().expect("nobody panics while noting what was seen")
    }

    fn path(&self, key: &Key) -> PathBuf {
        let name = key.to_string();
        self.folder.join(&name[..2]).join(format!("{}.bake", &name[2..]))
    }

    pub(super) fn holds(&self, key: &Key) -> bool {
        self.path(key).is_file()
    }

    /// The content that was stored under `key`. `Ok(None)`: there is none, or it was reported before that there is
    /// something else in its place. `Err`: there is, and this is the report.
    pub(super) fn read(&self, key: &Key) -> Result<Option<Vec<u8>>, Problem> {
        let path = self.path(key);
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            // A file in the folder's place holds no bakes either; writing says so.
            Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => return Ok(None),
            Err(error) => return self.report(key, &error.to_string()),
        };
        match parse(&bytes, key.as_bytes()) {
            Ok((_, content)) => {
                if self.seen().used.insert(*key) {
                    touch(&path);
                }
                Ok(Some(content.to_vec()))
            }
            Err(why) => {
                // Whether or not it can be removed, it is not used: the next write replaces it.
                std::fs::remove_file(&path).ok();
                self.report(key, why)
            }
        }
    }

    fn report(&self, key: &Key, why: &str) -> Result<Option<Vec<u8>>, Problem> {
        if !self.seen().reported.insert(*key) {
            return Ok(None);
        }
        Err(Problem::warning(format!("the bake {} could not be used: {why}", self.path(key).display()))
            .hint("it is made again; nothing else is lost"))
    }

    /// Stores `content`; the file is whole or it is not there. A folder that cannot be written is reported once.
    pub(super) fn write(&self, step: &str, key: &Key, content: &[u8]) -> Result<(), Problem> {
        let written = match self.try_write(step, key, content) {
            // Another process may have removed the folder just now, because it was empty.
            Err(error) if error.kind() == ErrorKind::NotFound => self.try_write(step, key, content),
            written => written,
        };
        written.and_then(|bytes| self.keep_to_limit(bytes)).or_else(|error| {
            if std::mem::replace(&mut self.seen().complained, true) {
                return Ok(());
            }
            let what = format!("bakes cannot be kept in {}: {error}", self.folder.display());
            Err(Problem { severity: Severity::Warning, ..Problem::new(Cause::Unfinished, what) }
                .hint("they stay in memory; name another folder with --cache-dir, or switch this off with --no-cache"))
        })
    }

    /// Returns how long the file is.
    fn try_write(&self, step: &str, key: &Key, content: &[u8]) -> io::Result<u64> {
        let path = self.path(key);
        let folder = path.parent().expect("a bake lies in a folder");
        std::fs::create_dir_all(folder)?;
        let mut file = tempfile::NamedTempFile::with_prefix_in(ASIDE, folder)?;
        let mut header = Vec::with_capacity(HEADER + step.len());
        header.extend_from_slice(MAGIC);
        header.extend_from_slice(&FORMAT.to_le_bytes());
        header.extend_from_slice(&(step.len() as u32).to_le_bytes());
        header.extend_from_slice(&(content.len() as u64).to_le_bytes());
        header.extend_from_slice(&checksum(key.as_bytes(), step.as_bytes(), content));
        header.extend_from_slice(step.as_bytes());
        file.write_all(&header)?;
        file.write_all(content)?;
        file.persist(&path).map_err(|error| error.error)?;
        Ok((header.len() + content.len()) as u64)
    }

    /// Makes room when `more` bytes that were written just now are too many.
    fn keep_to_limit(&self, more: u64) -> io::Result<()> {
        let mut seen = self.seen();
        let bytes = match seen.bytes {
            Some(bytes) => bytes + more,
            None => self.entries()?.iter().map(|entry| entry.bytes).sum(),
        };
        seen.bytes = Some(bytes);
        if bytes > self.limit {
            // A tenth more than must go, so that the next write need not list the folder again.
            seen.bytes = Some(self.sweep(self.limit - self.limit / 10)?.kept_bytes);
        }
        Ok(())
    }

    /// All bakes, in the order of their paths.
    pub fn entries(&self) -> io::Result<Vec<Entry>> {
        let mut found = Vec::new();
        for path in self.files()? {
            let Some(key) = key_of(&path) else { continue };
            let Some((bytes, used)) = there(path.metadata().and_then(|m| Ok((m.len(), m.modified()?))))? else {
                continue;
            };
            let step = read_step_name(&path).unwrap_or_else(|| "(unreadable)".into());
            found.push(Entry { step, key: Key::from(key).to_string(), bytes, path, used });
        }
        Ok(found)
    }

    /// All files that may be ours, in order: those in folders whose name is two hexadecimal digits.
    fn files(&self) -> io::Result<Vec<PathBuf>> {
        let mut found = Vec::new();
        for folder in listed(&self.folder)? {
            let is_ours = name_of(&folder).is_some_and(|name| hex(name).is_some_and(|bytes| bytes.len() == 1));
            if is_ours && folder.is_dir() {
                found.extend(listed(&folder)?);
            }
        }
        found.sort();
        Ok(found)
    }

    /// Reads every bake. Returns how many there are, and those that cannot be used, with the reason.
    pub fn verify(&self) -> io::Result<(usize, Vec<(Entry, String)>)> {
        let entries = self.entries()?;
        let mut broken = Vec::new();
        let mut count = 0;
        for entry in entries {
            let key = key_of(&entry.path).expect("an entry's path is made of its key");
            let why = match there(std::fs::read(&entry.path)) {
                Ok(None) => continue,
                Ok(Some(bytes)) => parse(&bytes, &key).err().map(str::to_string),
                Err(error) => Some(error.to_string()),
            };
            count += 1;
            broken.extend(why.map(|why| (entry, why)));
        }
        Ok((count, broken))
    }

    /// Removes what killed processes left, and the bakes that were used longest ago, until the rest takes no more than
    /// `limit` bytes.
    pub fn sweep(&self, limit: u64) -> io::Result<Swept> {
        let mut swept = Swept::default();
        let now = SystemTime::now();
        for path in self.files()?.iter().filter(|path| name_of(path).is_some_and(|name| name.starts_with(ASIDE))) {
            let Some((bytes, written)) = there(path.metadata().and_then(|m| Ok((m.len(), m.modified()?))))? else {
                continue;
            };
            if now.duration_since(written).is_ok_and(|age| age > ABANDONED) {
                remove(path)?;
                swept.abandoned += 1;
                swept.bytes += bytes;
            }
        }
        let mut entries = self.entries()?;
        entries.sort_by(|a, b| (a.used, &a.path).cmp(&(b.used, &b.path)));
        swept.kept = entries.len();
        swept.kept_bytes = entries.iter().map(|entry| entry.bytes).sum();
        for entry in entries {
            if swept.kept_bytes <= limit {
                break;
            }
            entry.remove()?;
            swept.bakes += 1;
            swept.bytes += entry.bytes;
            swept.kept -= 1;
            swept.kept_bytes -= entry.bytes;
        }
        Ok(swept)
    }

    /// Removes every bake, and nothing else that may lie in the folder. Returns how many, and how many bytes.
    pub fn clear(&self) -> io::Result<(usize, u64)> {
        let entries = self.entries()?;
        entries.iter().try_for_each(Entry::remove)?;
        Ok((entries.len(), entries.iter().map(|entry| entry.bytes).sum()))
    }
}

/// `None` for what another process removed meanwhile.
fn there<T>(result: io::Result<T>) -> io::Result<Option<T>> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

fn listed(folder: &Path) -> io::Result<Vec<PathBuf>> {
    match there(std::fs::read_dir(folder))? {
        Some(entries) => entries.map(|entry| Ok(entry?.path())).collect(),
        None => Ok(Vec::new()),
    }
}

/// Removes a file, and its folder when that was the last one.
fn remove(file: &Path) -> io::Result<()> {
    there(std::fs::remove_file(file))?;
    if let Some(folder) = file.parent() {
        std::fs::remove_dir(folder).ok(); // only when it is empty by now
    }
    Ok(())
}

/// Notes that a file is used now. Where that cannot be noted, only the order of eviction suffers.
fn touch(file: &Path) {
    let opened = std::fs::File::options().write(true).open(file);
    opened.and_then(|file| file.set_modified(SystemTime::now())).ok();
}

fn name_of(path: &Path) -> Option<&str> {
    path.file_name()?.to_str()
}

/// The key that a bake's path is made of.
fn key_of(path: &Path) -> Option<[u8; 32]> {
    let name = format!("{}{}", name_of(path.parent()?)?, name_of(path)?.strip_suffix(".bake")?);
    hex(&name)?.try_into().ok()
}

fn hex(text: &str) -> Option<Vec<u8>> {
    let digit = |c: &u8| match c {
        b'0'..=b'9' => Some(c - b'0'),
        b'a'..=b'f' => Some(c - b'a' + 10),
        _ => None,
    };
    let digits: Vec<u8> = text.as_bytes().iter().map(digit).collect::<Option<_>>()?;
    digits.chunks(2).map(|pair| Some(16 * pair[0] + pair.get(1)?)).collect()
}

fn checksum(key: &[u8; 32], step: &[u8], content: &[u8]) -> [u8; 32] {
    // With the name's length, or a byte at its end could as well be the content's first.
    let length = (step.len() as u64).to_le_bytes();
    *blake3::Hasher::new().update(key).update(&length).update(step).update(content).finalize().as_bytes()
}

/// The step's name and the content, or why the bytes are no bake of that key.
fn parse<'a>(bytes: &'a [u8], key: &[u8; 32]) -> Result<(&'a [u8], &'a [u8]), &'static str> {
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
