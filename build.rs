//! Names every source file by its content, so that a bake's key can hold the code that computes it; and the versions of
//! the crates that do its arithmetic. Lists the shaders, which the program carries with it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A new version of one of these may change the last bits of a bake.
const NUMERICAL_CRATES: [&str; 7] = ["faer", "gauss-quad", "glam", "half", "obvhs", "sprs", "tobj"];

fn files_below(folder: &Path, extension: &str, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a source folder can be listed") {
        let path = entry.expect("a source folder can be listed").path();
        if path.is_dir() {
            files_below(&path, extension, found);
        } else if path.extension().is_some_and(|e| e == extension) {
            found.push(path);
        }
    }
}

fn main() {
    let root = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").unwrap());
    println!("cargo:rerun-if-changed=src");
    println!("cargo:rerun-if-changed=shaders");
    println!("cargo:rerun-if-changed=Cargo.lock");

    let mut text = String::from("pub(super) const FILES: &[(&str, [u8; 32])] = &[\n");
    let mut sources = Vec::new();
    files_below(&root.join("src"), "rs", &mut sources);
    sources.sort();
    for path in &sources {
        let name = path.strip_prefix(&root).unwrap().to_str().unwrap().replace('\\', "/");
        let hash = blake3::hash(&std::fs::read(path).unwrap());
        writeln!(text, "    ({name:?}, {:?}),", hash.as_bytes()).unwrap();
    }
    let lock = std::fs::read_to_string(root.join("Cargo.lock")).unwrap_or_default();
    let versions: Vec<String> = lock
        .split("[[package]]")
        .filter(|package| NUMERICAL_CRATES.iter().any(|c| package.contains(&format!("name = \"{c}\"\n"))))
        .map(|package| package.lines().take(3).collect::<Vec<_>>().join(" "))
        .collect();
    writeln!(text, "];\npub(super) const CRATES: &str = {:?};", versions.join(";")).unwrap();
    let out = PathBuf::from(std::env::var("OUT_DIR").unwrap());
    std::fs::write(out.join("code.rs"), text).unwrap();

    let mut shaders = Vec::new();
    files_below(&root.join("shaders"), "wgsl", &mut shaders);
    shaders.sort();
    let mut text = String::from("pub const EMBEDDED: &[(&str, &str)] = &[\n");
    for path in &shaders {
        let name = path.strip_prefix(root.join("shaders")).unwrap().to_str().unwrap().replace('\\', "/");
        writeln!(text, "    ({name:?}, include_str!({:?})),", path.to_str().unwrap()).unwrap();
    }
    text.push_str("];\n");
    std::fs::write(out.join("shaders.rs"), text).unwrap();
}
