//! Every shader, in every shape that its flags give it, without a device.

use diaphane::gpu::{Shader, Shaders};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;

/// Flags that make no sense alone: the second is always there when the first is.
const IMPLIED: [(&str, &str); 2] = [("SKY_BLURRED", "SKY_IMAGE"), ("SKY_IMAGE", "ENVIRONMENT")];

/// More combinations than this are not tried one by one.
const MOST: usize = 1 << 10;

/// More loops than this in one entry point, and some drivers compile for minutes.
const LOOPS: usize = 9;

fn text_of(name: &str) -> String {
    std::fs::read_to_string(format!("shaders/{name}")).unwrap_or_else(|why| panic!("shaders/{name}: {why}"))
}

/// The flags that a shader and all that it includes ask for.
fn flags_of(name: &str, seen: &mut BTreeSet<String>) -> BTreeSet<String> {
    let mut flags = BTreeSet::new();
    if !seen.insert(name.to_string()) {
        return flags;
    }
    for line in text_of(name).lines() {
        match line.split_whitespace().collect::<Vec<_>>().as_slice() {
            ["#if", flag] => drop(flags.insert(flag.to_string())),
            ["#include", other] => flags.extend(flags_of(other.trim_matches('"'), seen)),
            _ => {}
        }
    }
    flags
}

/// Every set of flags that can occur.
fn combinations(flags: &BTreeSet<String>) -> Vec<Vec<&str>> {
    let flags: Vec<&str> = flags.iter().map(String::as_str).collect();
    assert!(1 << flags.len() <= MOST, "{} flags are too many to try all: {flags:?}", flags.len());
    (0..1usize << flags.len())
        .map(|bits| flags.iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1).map(|(_, flag)| *flag).collect())
        .filter(|set: &Vec<&str>| IMPLIED.iter().all(|(a, b)| !set.contains(a) || set.contains(b)))
        .collect()
}

/// Loops in a block, with those of every function that it calls, as an inlining compiler sees them.
fn loops(module: &naga::Module, block: &naga::Block) -> usize {
    block
        .iter()
        .map(|statement| match statement {
            naga::Statement::Block(inner) => loops(module, inner),
            naga::Statement::If { accept, reject, .. } => loops(module, accept) + loops(module, reject),
            naga::Statement::Switch { cases, .. } => cases.iter().map(|case| loops(module, &case.body)).sum(),
            naga::Statement::Loop { body, continuing, .. } => 1 + loops(module, body) + loops(module, continuing),
            naga::Statement::Call { function, .. } => loops(module, &module.functions[*function].body),
            _ => 0,
        })
        .sum()
}

fn most_loops(shader: &Shader) -> usize {
    shader.module.entry_points.iter().map(|entry| loops(&shader.module, &entry.function.body)).max().unwrap_or(0)
}

#[test]
fn every_shader_is_valid_with_every_set_of_flags() {
    let shaders = Shaders::new(Some("shaders".into()), Arc::default());
    let mut wrong = Vec::new();
    let mut tried = 0;
    for name in Shaders::names() {
        let flags = flags_of(name, &mut BTreeSet::new());
        for set in combinations(&flags) {
            tried += 1;
            match shaders.load(name, &set) {
                Err(problem) => wrong.push(format!("{name} {set:?}: {problem}")),
                Ok(shader) if most_loops(&shader) > LOOPS => {
                    wrong.push(format!("{name} {set:?}: {} loops in one entry point", most_loops(&shader)));
                }
                Ok(_) => {}
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
    assert!(tried > 50, "only {tried} shapes of shaders were tried: where are the flags?");
}

#[test]
fn a_wrong_shape_and_too_many_loops_are_noticed() {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("it can be written");
    write("flag.wgsl", "fn f() -> f32 {\n#if BROKEN\n return 1u;\n#else\n return 1.0;\n#endif\n}\n");
    let one = "fn one() -> i32 { var s = 0; for (var i = 0; i < 4; i++) { s += i; } return s; }\n";
    let calls = "  s += one();\n".repeat(LOOPS + 1);
    write("loops.wgsl", &format!("{one}@compute @workgroup_size(1) fn compute() {{ var s = 0;\n{calls}}}\n"));
    let shaders = Shaders::new(Some(folder.path().into()), Arc::default());
    assert!(shaders.load("flag.wgsl", &[]).is_ok() && shaders.load("flag.wgsl", &["BROKEN"]).is_err());
    assert_eq!(most_loops(&shaders.load("loops.wgsl", &[]).expect("it is valid")), LOOPS + 1);
}

#[test]
fn the_program_carries_the_shaders_of_the_folder() {
    let carried = Shaders::new(None, Arc::default());
    let folder = Shaders::new(Some("shaders".into()), Arc::default());
    let names: BTreeSet<&str> = Shaders::names().collect();
    for name in &names {
        let text = |shaders: &Shaders| shaders.load(name, &[]).unwrap_or_else(|p| panic!("{p}")).text.clone();
        assert_eq!(text(&carried), text(&folder), "{name}");
    }
}

#[test]
fn flags_that_the_program_asks_for_are_flags_of_some_shader() {
    // The code names flags as words in capitals; one that no shader knows would be silently ignored.
    let mut known = BTreeSet::new();
    for name in Shaders::names() {
        known.extend(flags_of(name, &mut BTreeSet::new()));
    }
    let mut asked: BTreeMap<String, String> = BTreeMap::new();
    let mut folders = vec![PathBuf::from("src/frame"), PathBuf::from("src/techniques")];
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).expect("the room is there").map(|entry| entry.expect("listed").path()) {
            let Ok(text) = std::fs::read_to_string(&path) else {
                folders.push(path);
                continue;
            };
            for word in text.split('"').skip(1).step_by(2) {
                // `env!("CARGO_…")` is no flag.
                let is_flag = word.len() > 3
                    && !word.starts_with("CARGO_")
                    && word.chars().all(|c| c.is_ascii_uppercase() || c == '_');
                if is_flag {
                    asked.insert(word.to_string(), path.display().to_string());
                }
            }
        }
    }
    assert!(asked.len() > 5, "flags are found: {asked:?}");
    for (flag, path) in &asked {
        assert!(known.contains(flag), "{path}: no shader knows the flag {flag}");
    }
    for flag in &known {
        assert!(asked.contains_key(flag), "nobody asks for the flag {flag}");
    }
}
