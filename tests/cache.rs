//! Bakes on disk survive whatever happens to files: what is read is what was written, or it is made again.

use assert_cmd::cargo::cargo_bin;
use diaphane::problem::Problem;
use diaphane::store::{Bake, Disk, Finished, Origin, Plan, Run, Slot, Step, Store, Watch};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Mutex;
use std::time::{Duration, SystemTime};

/// As many bytes as it says, all of them following from its seed.
#[derive(serde::Serialize)]
struct Noise {
    seed: u64,
    length: usize,
}
impl Noise {
    fn made(&self) -> Vec<u64> {
        (0..self.length as u64).map(|i| (self.seed + i).wrapping_mul(0x9E37_79B9_7F4A_7C15)).collect()
    }
}
impl Step for Noise {
    type Output = Vec<u64>;
    fn name(&self) -> &'static str {
        "test.noise"
    }
    fn about(&self) -> String {
        format!("noise {}", self.seed)
    }
    fn run(&self, _: &Run) -> Result<Vec<u64>, Problem> {
        Ok(self.made())
    }
}
impl Bake for Noise {
    const CODE: &'static [&'static str] = &["src/store/"];
}

#[derive(Default)]
struct Log(Mutex<Vec<Origin>>, Mutex<Vec<String>>);
impl Watch for Log {
    fn finished(&self, finished: &Finished) {
        self.0.lock().unwrap().push(finished.origin);
    }
    fn warn(&self, problem: &Problem) {
        self.1.lock().unwrap().push(problem.to_string());
    }
}

const LENGTHS: [usize; 4] = [0, 3, 40, 700];

type Noises = Vec<(Noise, Slot<Vec<u64>>)>;

fn noises() -> (Plan, Noises) {
    let mut plan = Plan::default();
    let noises = (0..).zip(LENGTHS).map(|(seed, length)| {
        let slot = plan.bake(Noise { seed, length });
        (Noise { seed, length }, slot)
    });
    let noises = noises.collect();
    (plan, noises)
}

/// Asks for everything; every value is right.
fn ask(disk: Disk) -> (Vec<Origin>, Vec<String>) {
    let (plan, noises) = noises();
    let log = Log::default();
    let mut store = Store::on_disk(disk);
    for (noise, slot) in noises {
        assert_eq!(*store.get_with(&plan, slot, None, &log).unwrap(), noise.made());
    }
    (log.0.into_inner().unwrap(), log.1.into_inner().unwrap())
}

fn paths(folder: &Path) -> Vec<PathBuf> {
    Disk::new(folder).entries().unwrap().into_iter().map(|entry| entry.path).collect()
}

#[test]
fn a_thousand_broken_files_never_give_a_wrong_value() {
    let folder = tempfile::tempdir().unwrap();
    ask(Disk::new(folder.path()));
    let files = paths(folder.path());
    let whole: Vec<Vec<u8>> = files.iter().map(|file| std::fs::read(file).unwrap()).collect();
    assert_eq!(ask(Disk::new(folder.path())), (vec![Origin::Disk; LENGTHS.len()], vec![]));
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let mut below = |end: usize| random.next_u64() as usize % end;
    for round in 0..1000 {
        let which = below(files.len());
        let mut bytes = whole[which].clone();
        let place = below(bytes.len());
        match round % 6 {
            0 => bytes[place] ^= 1 << below(8),
            1 => bytes.truncate(place),
            2 => bytes.extend((0..1 + below(100)).map(|_| 0)),
            3 => bytes = whole[(which + 1 + below(files.len() - 1)) % files.len()].clone(),
            4 => {
                let end = (place + 1 + below(64)).min(bytes.len());
                bytes[place..end].fill(0);
            }
            _ => bytes[8..12].copy_from_slice(&0u32.to_le_bytes()),
        }
        let changed = bytes != whole[which]; // zeros may stand where zeros stood
        std::fs::write(&files[which], &bytes).unwrap();
        let (_, broken) = Disk::new(folder.path()).verify().unwrap();
        let (origins, warnings) = ask(Disk::new(folder.path()));
        let made = origins.iter().filter(|origin| **origin == Origin::Ran).count();
        let expected = usize::from(changed);
        assert_eq!((broken.len(), made, warnings.len()), (expected, expected, expected), "round {round}: {warnings:?}");
        assert_eq!(std::fs::read(&files[which]).unwrap(), whole[which], "round {round}: it is mended");
    }
}

#[test]
fn a_bake_that_stays_broken_is_reported_once() {
    let folder = tempfile::tempdir().unwrap();
    ask(Disk::new(folder.path()));
    let (plan, noises) = noises();
    // A folder in a bake's place can be neither read nor replaced.
    for file in paths(folder.path()) {
        std::fs::remove_file(&file).unwrap();
        std::fs::create_dir_all(file.join("in-the-way")).unwrap();
    }
    let log = Log::default();
    let mut store = Store::on_disk(Disk::new(folder.path())).keep_plans(1);
    for _ in 0..3 {
        for (noise, slot) in &noises {
            assert_eq!(*store.get_with(&plan, *slot, None, &log).unwrap(), noise.made());
        }
        let mut other = Plan::default();
        let nothing = other.add(Nothing);
        store.get(&other, nothing).unwrap(); // another plan: what the first named is forgotten
    }
    let warnings = log.1.into_inner().unwrap();
    assert_eq!(warnings.iter().filter(|w| w.contains("could not be used")).count(), LENGTHS.len(), "{warnings:?}");
    assert_eq!(warnings.iter().filter(|w| w.contains("cannot be kept")).count(), 1, "{warnings:?}");
}

#[derive(serde::Serialize)]
struct Nothing;
impl Step for Nothing {
    type Output = ();
    fn name(&self) -> &'static str {
        "test.nothing"
    }
    fn about(&self) -> String {
        "nothing".into()
    }
    fn run(&self, _: &Run) -> Result<(), Problem> {
        Ok(())
    }
}

/// Sets when a file was last used: so many minutes ago.
fn age(file: &Path, minutes: u64) {
    let then = SystemTime::now() - Duration::from_secs(60 * minutes);
    std::fs::File::options().write(true).open(file).unwrap().set_modified(then).unwrap();
}

#[test]
fn what_was_used_longest_ago_makes_room() {
    let folder = tempfile::tempdir().unwrap();
    let one = |disk: Disk, seed| {
        let mut plan = Plan::default();
        let slot = plan.bake(Noise { seed, length: 1000 });
        let log = Log::default();
        Store::on_disk(disk).get_with(&plan, slot, None, &log).unwrap();
        log.0.into_inner().unwrap()[0]
    };
    let disk = || Disk::new(folder.path());
    let mut seen = Vec::new();
    for seed in 1..=5 {
        one(disk(), seed);
        let new: Vec<_> = paths(folder.path()).into_iter().filter(|path| !seen.contains(path)).collect();
        age(&new[0], 100 - seed);
        seen.extend(new);
    }
    let total: u64 = disk().entries().unwrap().iter().map(|entry| entry.bytes).sum();
    assert_eq!(one(disk(), 1), Origin::Disk); // the oldest is used again
    assert_eq!(one(disk().limit(total), 6), Origin::Ran);
    let left = paths(folder.path());
    let stands: Vec<bool> = seen.iter().map(|path| left.contains(path)).collect();
    assert_eq!(stands, [true, false, false, true, true]);
    // A store that writes many bakes stays below its limit, whatever it counted.
    let mut plan = Plan::default();
    let slots: Vec<_> = (10..60).map(|seed| plan.bake(Noise { seed, length: 1000 })).collect();
    let mut store = Store::on_disk(disk().limit(total));
    for slot in slots {
        store.get(&plan, slot).unwrap();
        assert!(disk().entries().unwrap().iter().map(|entry| entry.bytes).sum::<u64>() <= total);
    }
}

#[test]
fn only_old_unfinished_files_and_nothing_foreign_is_swept() {
    let folder = tempfile::tempdir().unwrap();
    ask(Disk::new(folder.path()));
    let ours = paths(folder.path())[0].parent().unwrap().to_path_buf();
    let foreign = folder.path().join("pictures");
    std::fs::create_dir_all(&foreign).unwrap();
    let files =
        [ours.join("writing-old"), ours.join("writing-new"), foreign.join("writing-a-novel"), foreign.join("a.bake")];
    for file in &files {
        std::fs::write(file, "half").unwrap();
    }
    age(&files[0], 61);
    age(&files[2], 61);
    let swept = Disk::new(folder.path()).sweep(u64::MAX).unwrap();
    assert_eq!((swept.abandoned, swept.bakes, swept.kept), (1, 0, LENGTHS.len()));
    assert_eq!(files.each_ref().map(|file| file.exists()), [false, true, true, true]);
    Disk::new(folder.path()).clear().unwrap();
    assert_eq!(paths(folder.path()), Vec::<PathBuf>::new());
    assert!(files[2].exists() && files[3].exists());
}

/// A scene with several bakes that take a while, in a folder of its own.
fn scene() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let objects: String = (0..4)
        .map(|i| {
            let x = 3 * i;
            format!("(mesh: Sphere(radius: 1.{i}, subdivisions: 4), material: \"m.ron\", transform: (translate: ({x}, 0, 0))),")
        })
        .collect();
    std::fs::write(folder.path().join("s.ron"), format!("Scene(version: 1, mm_per_unit: 1.0, objects: [{objects}])"))
        .unwrap();
    let material = "Material(version: 1, medium: AlbedoMfp(albedo: (0.99, 0.98, 0.9), mfp: (0.5, 0.4, 0.3)), \
                    filter: Neighbours(sigma_tr: 2.0, radius: 0.5))";
    std::fs::write(folder.path().join("m.ron"), material).unwrap();
    folder
}

fn diaphane(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(cargo_bin!("diaphane"));
    command.current_dir(folder).args(words).args(["--cache-dir", "bakes"]);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn text(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

fn is_sound(folder: &Path) -> usize {
    let output = diaphane(folder, &["cache", "verify"]).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    paths(&folder.join("bakes")).len()
}

#[test]
fn a_killed_process_leaves_whole_bakes_and_loses_none() {
    let scene = scene();
    let folder = scene.path();
    let bakes = folder.join("bakes");
    let mut killed = 0;
    // One that had done all before it could be killed proves nothing.
    for _ in 0..40 {
        let before = paths(&bakes);
        let mut child = diaphane(folder, &["bake", "s.ron"]).spawn().unwrap();
        while paths(&bakes).len() == before.len() && child.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        child.kill().unwrap();
        let finished = child.wait().unwrap().success();
        is_sound(folder);
        let after = paths(&bakes);
        assert!(before.iter().all(|path| after.contains(path)), "a bake was lost");
        killed += usize::from(!finished);
        if killed == 4 {
            break;
        }
        if finished {
            Disk::new(&bakes).clear().unwrap();
        }
    }
    assert_eq!(killed, 4, "it was always too late");
    let before = paths(&bakes).len();
    let output = diaphane(folder, &["bake", "s.ron", "--json"]).output().unwrap();
    let facts: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&facts["from_disk"], output.stderr.len()), (&before.into(), 0), "what was kept is used: {facts}");
    assert_eq!(is_sound(folder) as u64, facts["bakes"].as_u64().unwrap());
}

#[test]
fn two_processes_share_a_folder() {
    let scene = scene();
    let both = [(); 2].map(|()| diaphane(scene.path(), &["bake", "s.ron"]).spawn().unwrap());
    for child in both {
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success() && output.stderr.is_empty(), "{}", text(&output));
    }
    let count = is_sound(scene.path());
    let output = diaphane(scene.path(), &["bake", "s.ron", "--json"]).output().unwrap();
    let facts: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(facts["made"], 0, "{facts}");
    assert!(count >= 4);
}

#[test]
fn broken_bakes_are_told_removed_and_collected_by_words() {
    let scene = scene();
    let bakes = scene.path().join("bakes");
    ask(Disk::new(&bakes));
    std::fs::write(&paths(&bakes)[0], "not a bake").unwrap();
    let run = |words: &[&str]| {
        let output = diaphane(scene.path(), words).output().unwrap();
        (output.status.code().unwrap(), text(&output))
    };
    let (status, said) = run(&["cache", "verify"]);
    assert!(status == 1 && said.contains("broken") && said.contains("made again"), "{status} {said}");
    assert_eq!(paths(&bakes).len(), LENGTHS.len(), "verify alone removes nothing");
    let (status, said) = run(&["cache", "verify", "--remove"]);
    assert!(status == 0 && said.contains("removed"), "{status} {said}");
    assert_eq!(is_sound(scene.path()), LENGTHS.len() - 1);
    assert_eq!(run(&["cache", "gc"]).0, 0);
    assert_eq!(paths(&bakes).len(), LENGTHS.len() - 1);
    assert_eq!(run(&["cache", "gc", "--max-size", "0"]).0, 0);
    assert_eq!(paths(&bakes).len(), 0);
    assert_eq!(run(&["cache", "gc", "--max-size", "lots"]).0, 2);
}

/// Where a folder cannot be made, nor by root.
#[test]
fn a_place_that_keeps_nothing_costs_one_warning_and_no_value() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "not a folder").unwrap();
    let mut places = vec![file.clone(), file.join("bakes")];
    places.extend(Path::new("/proc/version").exists().then(|| "/proc/bakes".into()));
    for place in places {
        let (origins, warnings) = ask(Disk::new(&place));
        assert_eq!(origins, [Origin::Ran; LENGTHS.len()], "{}", place.display());
        assert!(warnings.len() == 1 && warnings[0].contains("cannot be kept"), "{}: {warnings:?}", place.display());
    }
    assert_eq!(std::fs::read(&file).unwrap(), b"not a folder");
    // The same values where they can be kept, without a word.
    assert_eq!(ask(Disk::new(folder.path().join("bakes"))).1, Vec::<String>::new());
}

/// Where no file may grow beyond 512 bytes, writing fails in the middle, as on a full disk.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_no_half_bake() {
    let scene = scene();
    let binary = cargo_bin!("diaphane");
    let script = format!("trap '' XFSZ; ulimit -f 1; exec '{}' bake s.ron --cache-dir bakes", binary.display());
    let output = Command::new("sh").args(["-c", &script]).current_dir(scene.path()).output().unwrap();
    let said = text(&output);
    assert_eq!(output.status.code(), Some(5), "{said}");
    assert_eq!(said.matches("cannot be kept").count(), 1, "{said}");
    is_sound(scene.path());
    for folder in std::fs::read_dir(scene.path().join("bakes")).unwrap() {
        for file in std::fs::read_dir(folder.unwrap().path()).unwrap() {
            let name = file.unwrap().file_name();
            assert!(!name.to_string_lossy().starts_with("writing-"), "{name:?} was left");
        }
    }
}
