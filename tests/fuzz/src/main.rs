//! The fuzzer: libFuzzer around one of the checks. `DIAPHANE_FUZZ` says which, and `DIAPHANE_SEEDS` names a folder in
//! which it puts first inputs and a list of words before it begins. `tools/fuzz` knows the rest.
#![no_main]

mod checks;
mod mend;
mod seeds;

use checks::Check;
use libfuzzer_sys::{fuzz_mutator, fuzz_target};
use std::path::Path;
use std::sync::OnceLock;

#[global_allocator]
static MEMORY: checks::Counting = checks::Counting;

static CHOSEN: OnceLock<(String, Check)> = OnceLock::new();

fn choose() {
    let name = std::env::var("DIAPHANE_FUZZ").unwrap_or_default();
    let known = checks::TARGETS.map(|(name, _)| name).join(", ");
    let check = checks::target(&name).unwrap_or_else(|| panic!("DIAPHANE_FUZZ is none of {known}"));
    if let Some(folder) = std::env::var_os("DIAPHANE_SEEDS") {
        seeds::write(&name, Path::new(&folder));
    }
    CHOSEN.get_or_init(|| (name, check));
}

fuzz_target!(init: choose(), |bytes: &[u8]| {
    let (_, check) = CHOSEN.get().expect("it is chosen before it begins");
    check(bytes);
});

// What no mutation would ever get right, checksums, is made right after every second one.
fuzz_mutator!(|bytes: &mut [u8], size: usize, most: usize, seed: u32| {
    let (name, _) = CHOSEN.get().expect("it is chosen before it begins");
    let size = libfuzzer_sys::fuzzer_mutate(bytes, size, most);
    match seed % 2 {
        0 => mend::mend(name, bytes, size),
        _ => size,
    }
});
