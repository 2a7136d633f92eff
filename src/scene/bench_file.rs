//! What the benchmark is to measure of a scene, as a file beside it says: `marble.bench.ron` of `marble.ron`.
//!
//! ```ron
//! Bench(
//!     version: 1,
//!     techniques: [Opaque(), FilteredNormals()],   // else every technique at its defaults
//!     size: (480, 270),                            // pixels; else the scene's
//!     repetitions: 10,                             // of each frame
//!     truths: [Volume, Bssrdf],                    // what errors are measured against
//!     max_error: 0.02, max_spp: 4096,              // when a truth is good enough; else as the scene's reference says
//! )
//! ```

use crate::problem::Problems;
use crate::scene::TechniqueText;
use crate::scene::fields::Raw;
use crate::scene::meaning::Judge;
use crate::scene::tree::Node;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename = "Bench", deny_unknown_fields)]
pub struct BenchFile {
    pub version: u32,
    #[serde(default)]
    pub techniques: Option<Vec<Raw>>,
    #[serde(default)]
    pub size: Option<(u32, u32)>,
    #[serde(default = "usual_repetitions")]
    pub repetitions: u32,
    #[serde(default = "all_truths")]
    pub truths: Vec<Truth>,
    #[serde(default)]
    pub max_error: Option<f64>,
    #[serde(default)]
    pub max_spp: Option<u32>,
}

/// What stands for the truth that errors are measured against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Truth {
    /// Light followed through the media.
    Volume,
    /// The material's diffusion profile, with nothing else approximated.
    Bssrdf,
}

fn usual_repetitions() -> u32 {
    10
}
fn all_truths() -> Vec<Truth> {
    vec![Truth::Volume, Truth::Bssrdf]
}

/// What to measure of a scene, and how well. None: as the scene has it.
#[derive(Clone, Debug, PartialEq)]
pub struct BenchSettings {
    /// None: every technique at its defaults.
    pub techniques: Option<Vec<TechniqueText>>,
    /// Pixels.
    pub size: Option<(u32, u32)>,
    /// How often each frame is measured, at least 1.
    pub repetitions: u32,
    /// At least one, each once.
    pub truths: Vec<Truth>,
    /// The relative standard error at which a truth is good enough.
    pub max_error: Option<f64>,
    /// The samples per pixel after which it is good enough in any case, at least 2.
    pub max_spp: Option<u32>,
}

impl Default for BenchSettings {
    fn default() -> BenchSettings {
        BenchSettings {
            techniques: None,
            size: None,
            repetitions: usual_repetitions(),
            truths: all_truths(),
            max_error: None,
            max_spp: None,
        }
    }
}

/// What `file` means, or all that is wrong with it.
pub fn build(file: &BenchFile, root: &Node) -> Result<BenchSettings, Problems> {
    let mut judge = Judge::new(root);
    let techniques = file.techniques.as_ref().map(|listed| techniques(listed.len(), &mut judge));
    if let Some((width, height)) = file.size {
        let range = "(width, height), each from 1 to 16384 pixels";
        judge.all("size", &[width.into(), height.into()], |v| (1.0..=16384.0).contains(&v), range);
    }
    judge.all("repetitions", &[file.repetitions.into()], |v| (1.0..=1000.0).contains(&v), "from 1 to 1000");
    if let Some(error) = file.max_error {
        judge.all("max_error", &[error], |v| v > 0.0, "a relative standard error above 0, like 0.02");
    }
    if let Some(samples) = file.max_spp {
        judge.all("max_spp", &[samples.into()], |v| v >= 2.0, "2 or more: a single sample does not say how sure it is");
    }
    if file.truths.is_empty() {
        judge.wrong("truths", "without a truth there is no error", "leave it out, or write [Volume], or [Bssrdf]");
    }
    for (i, truth) in file.truths.iter().enumerate() {
        if file.truths[..i].contains(truth) {
            judge.wrong(&format!("truths[{i}]"), format!("{truth:?} stands here twice"), "take one of them away");
        }
    }
    if !judge.problems.is_empty() {
        return Err(Problems(judge.problems));
    }
    let BenchFile { size, repetitions, max_error, max_spp, .. } = *file;
    Ok(BenchSettings { techniques, size, repetitions, truths: file.truths.clone(), max_error, max_spp })
}

fn techniques(count: usize, judge: &mut Judge<'_>) -> Vec<TechniqueText> {
    if count == 0 {
        judge.wrong("techniques", "there is no technique in it", "leave it out, and every technique is measured");
    }
    let mut found: Vec<TechniqueText> = Vec::new();
    for i in 0..count {
        let path = format!("techniques[{i}]");
        match TechniqueText::of(judge.node(&path), &path) {
            Ok(text) if found.contains(&text) => {
                judge.wrong(&path, format!("{} stands here twice", text.ron), "take one of them away")
            }
            Ok(text) => found.push(text),
            Err(problem) => judge.add(problem),
        }
    }
    found
}

/// The file with what it leaves to others, as far as it is known without the scene: `diaphane check --defaults`.
pub fn complete(file: &BenchFile, root: &Node) -> BenchFile {
    let mut file = file.clone();
    for (i, raw) in file.techniques.iter_mut().flatten().enumerate() {
        raw.0 = root.nearest(&format!("techniques[{i}]")).unwrapped().canonical();
    }
    file
}

/// What a settings file is called beside a scene's.
pub fn beside(scene: &std::path::Path) -> std::path::PathBuf {
    scene.with_extension("bench.ron")
}

#[cfg(test)]
mod tests {
    use crate::problem::Problems;
    use crate::scene::{BenchSettings, Reader, Truth};

    fn read(text: &str) -> Result<BenchSettings, Problems> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bench.ron");
        std::fs::write(&path, text).unwrap();
        Reader::new(Default::default()).bench(&path)
    }

    #[test]
    fn what_is_left_out_has_its_default_and_what_stands_there_is_kept() {
        assert_eq!(read("Bench(version: 1)").unwrap(), BenchSettings::default());
        let text = "Bench(version: 1, techniques: [LongRange( layers:8 ), Opaque], size: (64, 32), repetitions: 3, \
                    truths: [Bssrdf], max_error: 0.1, max_spp: 64)";
        let settings = read(text).unwrap();
        let techniques: Vec<String> = settings.techniques.unwrap().into_iter().map(|text| text.ron).collect();
        assert_eq!(techniques, ["LongRange(layers: 8)", "Opaque"]);
        assert_eq!((settings.size, settings.repetitions), (Some((64, 32)), 3));
        assert_eq!((settings.truths, settings.max_error, settings.max_spp), (vec![Truth::Bssrdf], Some(0.1), Some(64)));
    }

    #[test]
    fn a_mistake_is_told_at_its_place() {
        for (text, place, says) in [
            ("Bench(version: 1,\n repetition: 3)", (2, 2), "did you mean `repetitions`?"),
            ("Bench(version: 1,\n repetitions: 0)", (2, 15), "from 1 to 1000"),
            ("Bench(version: 1,\n size: (0, 4))", (2, 9), "1 to 16384"),
            ("Bench(version: 1, max_error: 0)", (1, 30), "above 0"),
            ("Bench(version: 1, max_error: NaN)", (1, 30), "not a finite number"),
            ("Bench(version: 1, max_spp: 1)", (1, 28), "2 or more"),
            ("Bench(version: 1, truths: [])", (1, 27), "no error"),
            ("Bench(version: 1, truths: [Volume,\n Volume])", (2, 2), "twice"),
            ("Bench(version: 1, truths: [Layered])", (1, 28), "Volume"),
            ("Bench(version: 1, techniques: [])", (1, 31), "no technique"),
            ("Bench(version: 1, techniques: [Opaque(),\n Opaque()])", (2, 2), "twice"),
            ("Bench(version: 1, techniques: [3])", (1, 32), "expected a technique"),
            ("Scene(version: 1)", (1, 1), "Bench( )"),
            ("Bench(version: 2)", (1, 16), "reads version 1"),
        ] {
            let problems = read(text).unwrap_err();
            let at = problems.0[0].at.as_ref().unwrap();
            assert_eq!((at.line, at.column), place, "{problems}");
            assert!(problems.to_string().contains(says), "{problems}");
        }
        assert_eq!(read("Bench(version: 1, repetitions: 0, max_spp: 0)").unwrap_err().0.len(), 2);
    }
}
