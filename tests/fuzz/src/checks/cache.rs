//! Bakes on disk: what is used is what was written, to the last bit.

use super::{folder, memory};
use diaphane::geometry::mesh::Mesh;
use diaphane::problem::Problem;
use diaphane::reference::film::Film;
use diaphane::store::{Bake, Disk, Finished, Key, Origin, Plan, Run, Slot, Step, Store, Watch};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Mutex;

/// Makes something of every shape that bakes have.
#[derive(Serialize)]
struct Sample;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Value {
    meshes: Vec<Mesh>,
    film: Option<Film>,
    named: Vec<(String, f64)>,
    bits: Vec<u8>,
}

impl Step for Sample {
    type Output = Value;
    fn name(&self) -> &'static str {
        NAME
    }
    fn about(&self) -> String {
        "something of every shape".into()
    }
    fn run(&self, _: &Run) -> Result<Value, Problem> {
        Ok(made())
    }
}
impl Bake for Sample {
    const CODE: &'static [&'static str] = &["src/store/"];
}

fn made() -> Value {
    Value { named: vec![("made".into(), 0.5)], bits: vec![1, 2, 3], ..Value::default() }
}

const NAME: &str = "fuzz.sample";

fn plan() -> (Plan, Slot<Value>) {
    let mut plan = Plan::default();
    let slot = plan.bake(Sample);
    (plan, slot)
}

/// The file that holds `content`, as the header of a bake is described: magic, format, lengths, checksum.
fn whole(key: &Key, content: &[u8]) -> Vec<u8> {
    let (name, length) = (NAME.len() as u64, (content.len() as u64).to_le_bytes());
    let mut sum = blake3::Hasher::new();
    sum.update(key.as_bytes()).update(&name.to_le_bytes()).update(NAME.as_bytes()).update(content);
    let header = [b"diaphane", &2_u32.to_le_bytes()[..], &name.to_le_bytes()[..4], &length].concat();
    [&header, &sum.finalize().as_bytes()[..], NAME.as_bytes(), content].concat()
}

/// A whole file whose header puts the end of the name somewhere else, `by` bytes further on than it says.
fn shifted(mut file: Vec<u8>, by: i8) -> Vec<u8> {
    let name = (NAME.len() as u32).wrapping_add_signed(by.into());
    let length = (file.len() as u64).wrapping_sub(56 + u64::from(name));
    file[12..16].copy_from_slice(&name.to_le_bytes());
    file[16..24].copy_from_slice(&length.to_le_bytes());
    file
}

/// What is damaged in the header of a file mended, so that its content is looked at.
pub fn sign(file: &[u8]) -> Vec<u8> {
    whole(&plan().1.key(), file.get(56 + NAME.len()..).unwrap_or_default())
}

#[derive(Default)]
struct Log(Mutex<Vec<Origin>>, Mutex<Vec<Problem>>);
impl Watch for Log {
    fn finished(&self, finished: &Finished) {
        self.0.lock().expect("nobody panics while noting").push(finished.origin);
    }
    fn warn(&self, problem: &Problem) {
        self.1.lock().expect("nobody panics while noting").push(problem.clone());
    }
}

/// The value, where it came from, and what was said.
fn ask(folder: &Path) -> (Value, Origin, Vec<Problem>) {
    let (plan, slot) = plan();
    let log = Log::default();
    let mut store = Store::on_disk(Disk::new(folder));
    let value = store.get_with(&plan, slot, None, &log).expect("what cannot be read is made again");
    let origins = log.0.into_inner().expect("nobody panicked");
    assert_eq!(origins.len(), 1);
    (Value::clone(&value), origins[0], log.1.into_inner().expect("nobody panicked"))
}

pub fn check(bytes: &[u8]) {
    alone(bytes);
    if let Some(by) = bytes.last().filter(|by| **by != 0) {
        alone(&shifted(sign(bytes), *by as i8));
    }
}

fn alone(bytes: &[u8]) {
    let folder = folder();
    let key = plan().1.key();
    let name = key.to_string();
    let file = folder.path().join(&name[..2]).join(format!("{}.bake", &name[2..]));
    std::fs::create_dir_all(file.parent().expect("it lies in a folder")).expect("a folder can be made");
    std::fs::write(&file, bytes).expect("a file can be written");

    let is_whole = bytes.get(56 + NAME.len()..).is_some_and(|content| bytes == whole(&key, content));
    let disk = Disk::new(folder.path());
    let (count, broken) = disk.verify().expect("the folder can be listed");
    assert_eq!((count, broken.len()), (1, usize::from(!is_whole)), "{broken:?}");

    let ((value, origin, said), most) = memory::most(|| ask(folder.path()));
    // What is written in one byte takes up to the size of a pixel in memory; a list may be twice as long as it must.
    assert!(most <= (4 << 20) + 512 * bytes.len(), "{} bytes of file take {most} bytes of memory", bytes.len());
    assert!(origin == Origin::Ran || is_whole, "a damaged bake is used: {value:?}");
    // A whole one whose content is no value is silently made again.
    assert_eq!(said.len(), usize::from(!is_whole), "{said:?}");
    assert!(origin == Origin::Disk || value == made());
    // By now it is there, whatever was there before. NaN differs from itself, so what is printed is compared.
    let (again, origin, said) = ask(folder.path());
    assert!(origin == Origin::Disk && said.is_empty(), "what was made again is not kept: {said:?}");
    assert_eq!(format!("{again:?}"), format!("{value:?}"));
    let entries = disk.entries().expect("the folder can be listed");
    assert!(entries.len() == 1 && entries[0].key == name && entries[0].step == NAME);
}
