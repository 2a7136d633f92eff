//! Bytes that once broke a reader never do again: every file of `tests/fuzz/kept/TARGET`, given to the check that it broke.
//! `tools/fuzz` looks for more.

#[path = "fuzz/src/checks/mod.rs"]
mod checks;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

#[global_allocator]
static MEMORY: checks::Counting = checks::Counting;

fn listed(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut found: Vec<PathBuf> = entries.map(|entry| entry.expect("it can be listed").path()).collect();
    found.sort();
    found
}

#[test]
fn what_broke_a_reader_once_does_not_again() {
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/kept");
    let mut wrong = Vec::new();
    let mut count = 0;
    for folder in listed(&kept) {
        let name = folder.file_name().expect("a folder has a name").to_string_lossy();
        let check = checks::target(&name).unwrap_or_else(|| panic!("{} belongs to no target", folder.display()));
        for file in listed(&folder) {
            let bytes = std::fs::read(&file).expect("a kept file can be read");
            count += 1;
            if catch_unwind(AssertUnwindSafe(|| check(&bytes))).is_err() {
                wrong.push(file);
            }
        }
    }
    assert!(count > 0, "what was kept is gone");
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Nobody damaged these.
#[test]
fn what_is_sound_breaks_nothing() {
    for (name, check) in checks::TARGETS {
        check(b"");
        check(name.as_bytes());
    }
    let target = |name| checks::target(name).expect("it is one");
    target("cache")(&checks::sign(&[0; 67 + 4]));
    let scene = "Scene(version: 1, mm_per_unit: 1.0, objects: [(mesh: File(\"a.obj\"), material: \"a.ron\")])";
    target("scene")(format!("{scene}{}view.size=(0, 1)", checks::PART).as_bytes());
    assert!(checks::target("tea").is_none());
}
