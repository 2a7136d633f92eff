//! Everything that makes pictures, over a grid of hard inputs: one test per input (rows) and technique or integrator
//! (columns), and a table of all at the end.
//!
//! After every picture all that its steps made is looked at, pass by pass and bake by bake: no NaN, no infinity, no
//! negative light. Then comes the law that the input has to keep: no more light than there is, the same picture at any
//! size, light that adds up. A failure names input, column, step, and pixel, vertex or place.
//!
//! A subset runs with all other tests; `tools/stress` runs everything, and writes the table to `tools/runs/stress.txt`.
//! `cargo test --test stress -- slivers` runs what has that in its name.

mod booth;
mod columns;
mod inputs;
mod known;
mod laws;
mod meshes;
mod sound;
mod stage;
mod table;
mod teeth;

use booth::Miss;
use libtest_mimic::{Arguments, Failed, Trial};
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;
use std::sync::{Arc, Mutex, PoisonError};
use table::{Cell, Cells, table};

fn main() -> ExitCode {
    std::env::set_current_dir(env!("CARGO_MANIFEST_DIR")).expect("the project's folder is there");
    // Where to write the table of the whole grid; without it, a part of the grid runs.
    let report = std::env::var_os("DIAPHANE_STRESS");
    let columns = columns::all();
    let mut inputs = inputs::all();
    inputs.retain(|input| input.often || report.is_some());
    let names: BTreeSet<&str> = inputs.iter().map(|input| input.name.as_str()).collect();
    assert_eq!(names.len(), inputs.len(), "an input's name stands twice");

    let cells: Arc<Mutex<Cells>> = Arc::default();
    let mut trials = teeth::trials();
    for (i, input) in inputs.iter().enumerate() {
        for (c, column) in columns.iter().enumerate() {
            let (input, column, cells) = (input.clone(), column.clone(), cells.clone());
            trials.push(Trial::test(format!("{}/{}", input.name, column.name), move || {
                let found = catch_unwind(AssertUnwindSafe(|| booth::judge(&input, &column)));
                let cell = cell_of(found, known::why(&input.name, &column.name));
                cells.lock().unwrap_or_else(PoisonError::into_inner).insert((i, c), cell.clone());
                match cell {
                    Cell::Failed(why) => Err(Failed::from(format!("{} with {}: {why}", input.name, column.name))),
                    _ => Ok(()),
                }
            }));
        }
    }
    let conclusion = libtest_mimic::run(&Arguments::from_args(), trials);
    let text = table(&inputs, &columns, &cells.lock().unwrap_or_else(PoisonError::into_inner));
    println!("{text}");
    if let Some(path) = report {
        std::fs::write(&path, &text).expect("the table can be written");
    }
    conclusion.exit_code()
}

/// What a trial comes to, given why it may fail.
fn cell_of(found: std::thread::Result<Result<String, Miss>>, known: Option<&str>) -> Cell {
    let failed = match found {
        Ok(Ok(_)) => None,
        Ok(Err(Miss::Refused(why))) => return Cell::Refused(why),
        Ok(Err(Miss::Flaw(flaw))) => Some(flaw.to_string()),
        Ok(Err(Miss::Law(what))) => Some(what),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().cloned();
            let text = text.or_else(|| panic.downcast_ref::<&str>().map(|text| text.to_string()));
            Some(format!("it panicked: {}", text.unwrap_or_default()))
        }
    };
    match (failed, known) {
        (None, None) => Cell::Kept,
        (None, Some(why)) => Cell::Failed(format!("it fails no more: take it out of known.rs, where it says: {why}")),
        (Some(_), Some(why)) => Cell::Known(why.to_string()),
        (Some(what), None) => Cell::Failed(what),
    }
}
