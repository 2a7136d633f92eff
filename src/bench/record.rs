//! The folder that samples are kept in, so that what was interrupted goes on where it was.
//!
//! `machine.json` says beside the machine what each row of `samples.csv` was measured of: the name of the scene's content,
//! the technique's steps, the truth that was asked for and the code. Rows of something else under the same words are
//! dropped before they are measured anew. Both files are written aside and renamed.

use super::machine::Machine;
use super::samples::{Sample, Samples, Subject};
use crate::image::write_file;
use crate::problem::{At, Cause, Problem};
use crate::store::Key;
use serde::{Deserialize, Serialize};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

pub struct Record {
    folder: PathBuf,
    pub machine: Machine,
    pub samples: Samples,
    measured: Vec<Measured>,
}

/// What stands in `machine.json`.
#[derive(Serialize, Deserialize)]
struct MachineFile {
    #[serde(flatten)]
    machine: Machine,
    measured: Vec<Measured>,
}

/// What a subject's rows are of.
#[derive(Clone, PartialEq, Serialize, Deserialize)]
struct Measured {
    scene: String,
    technique: String,
    settings: String,
    size: String,
    key: String,
}

impl Measured {
    fn is_of(&self, subject: &Subject) -> bool {
        [&self.scene, &self.technique, &self.settings, &self.size]
            == [&subject.scene, &subject.technique, &subject.settings, &subject.size]
    }
}

impl Record {
    /// What there is in `folder`, if anything, to be gone on with. What another machine measured is left alone.
    pub fn open(folder: &Path, machine: Machine) -> Result<Record, Problem> {
        let mut record =
            Record { folder: folder.to_path_buf(), machine, samples: Samples::default(), measured: Vec::new() };
        if let Some((samples, known)) = read(folder)? {
            if !known.machine.times_as(&record.machine) {
                let what = format!(
                    "{} holds what another machine measured: {}, {}",
                    folder.display(),
                    known.machine.drawn_on(),
                    known.machine.cpu
                );
                return Err(Problem::new(Cause::Words, what).hint("name another folder with -o, or remove this one"));
            }
            (record.samples, record.measured) = (samples, known.measured);
        }
        Ok(record)
    }

    /// From here on the subject's rows are of what `key` names; rows of anything else are dropped.
    pub fn begin(&mut self, subject: &Subject, key: Key) -> Result<(), Problem> {
        let key = key.to_string();
        if self.measured.iter().any(|measured| measured.is_of(subject) && measured.key == key) {
            return Ok(());
        }
        let before = self.samples.0.len();
        self.samples.0.retain(|sample| sample.subject != *subject);
        // Rows go before their name does: whoever is interrupted between the two measures again.
        if self.samples.0.len() < before {
            self.write_samples()?;
        }
        self.measured.retain(|measured| !measured.is_of(subject));
        let Subject { scene, technique, settings, size } = subject.clone();
        self.measured.push(Measured { scene, technique, settings, size, key });
        let file = MachineFile { machine: self.machine.clone(), measured: self.measured.clone() };
        let text = serde_json::to_string_pretty(&file).expect("a machine is made of texts and numbers");
        write_file(&self.folder.join(MACHINE), format!("{text}\n").as_bytes())
    }

    /// Keeps rows, all of them or none.
    pub fn add(&mut self, samples: impl IntoIterator<Item = Sample>) -> Result<(), Problem> {
        self.samples.0.extend(samples);
        self.write_samples()
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    fn write_samples(&self) -> Result<(), Problem> {
        write_file(&self.folder.join(SAMPLES), self.samples.csv().as_bytes())
    }
}

pub const SAMPLES: &str = "samples.csv";
pub const MACHINE: &str = "machine.json";

/// What an earlier run left in a folder: its samples, and what they were measured on.
pub fn earlier(folder: &Path) -> Result<(Samples, Machine), Problem> {
    let found = read(folder)?.map(|(samples, file)| (samples, file.machine));
    found.ok_or_else(|| {
        Problem::new(Cause::Words, format!("{} holds no {SAMPLES}", folder.display()))
            .hint("name the folder that an earlier `diaphane bench … -o DIR` wrote")
    })
}

fn read(folder: &Path) -> Result<Option<(Samples, MachineFile)>, Problem> {
    let text = |name: &str| {
        let path = folder.join(name);
        match std::fs::read_to_string(&path) {
            Ok(text) => Ok(Some(text)),
            Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(None),
            Err(error) => Err(Problem::files(format!("it cannot be read: {error}")).at(At::file(&path))),
        }
    };
    let wrong = |name: &str, what: String| {
        Problem::files(format!("this is not what the benchmark wrote: {what}"))
            .at(At::file(&folder.join(name)))
            .hint("name another folder, or remove the file; then it is measured anew")
    };
    let Some(samples) = text(SAMPLES)? else { return Ok(None) };
    let samples = Samples::read(&samples).map_err(|(line, what)| wrong(SAMPLES, format!("line {line}: {what}")))?;
    let machine = text(MACHINE)?.ok_or_else(|| wrong(SAMPLES, format!("there is no {MACHINE} beside it")))?;
    let machine = serde_json::from_str(&machine).map_err(|error| wrong(MACHINE, error.to_string()))?;
    Ok(Some((samples, machine)))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{machine, sample, subject};
    use super::*;

    #[test]
    fn what_was_measured_is_there_again_until_it_is_of_something_else() {
        let folder = tempfile::tempdir().unwrap();
        let open = || Record::open(folder.path(), machine()).unwrap();
        let (a, b) = (subject("Opaque", ""), subject("FilteredNormals", ""));
        let mut record = open();
        assert!(earlier(folder.path()).unwrap_err().what.contains("samples.csv"));
        for subject in [&a, &b] {
            record.begin(subject, Key::of(&1)).unwrap();
            record.add([sample(subject, "frame", 1, 2.0), sample(subject, "frame", 2, 3.0)]).unwrap();
        }
        let mut again = open();
        again.begin(&a, Key::of(&1)).unwrap();
        assert_eq!((again.samples.0.len(), &again.samples), (4, &record.samples));
        // The scene changed, say: a's rows are gone, b's stay.
        again.begin(&a, Key::of(&2)).unwrap();
        assert_eq!(again.samples.values(&a, "frame").count(), 0);
        assert_eq!(open().samples.values(&b, "frame").collect::<Vec<_>>(), [2.0, 3.0]);
        assert_eq!(earlier(folder.path()).unwrap().1, machine());

        let other = Machine { adapter: "another".into(), ..machine() };
        let refused = Record::open(folder.path(), other).err().unwrap();
        assert!(refused.what.contains("another machine measured") && refused.what.contains("software"));
        std::fs::remove_file(folder.path().join(MACHINE)).unwrap();
        assert!(Record::open(folder.path(), machine()).err().unwrap().what.contains("no machine.json"));
    }
}
