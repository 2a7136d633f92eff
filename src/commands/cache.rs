use super::{Answer, counted};
use crate::problem::{Cause, Problem, Problems};
use crate::session::Options;
use crate::store::Disk;
use serde_json::json;
use std::collections::BTreeMap;

/// Look at the bakes that are kept, or remove them
#[derive(clap::Subcommand)]
pub enum Cache {
    /// Say how many there are, of what, and how large
    Stat,
    /// Remove them all; they are made again when they are needed
    Clear,
}

fn size(bytes: u64) -> String {
    match bytes as f64 {
        b if b < 1e3 => format!("{bytes} bytes"),
        b if b < 1e6 => format!("{:.1} kB", b / 1e3),
        b if b < 1e9 => format!("{:.1} MB", b / 1e6),
        b => format!("{:.1} GB", b / 1e9),
    }
}

impl Cache {
    pub fn run(self, options: Options) -> Result<Answer, Problems> {
        let disk = Disk::new(options.cache_folder());
        let folder = disk.folder().display().to_string();
        let failed = |error: std::io::Error| {
            Problem::new(Cause::Unfinished, format!("the bakes in {folder} cannot be reached: {error}"))
                .hint("name another folder with --cache-dir")
        };
        match self {
            Cache::Stat => {
                let mut kinds: BTreeMap<String, (usize, u64)> = BTreeMap::new();
                for entry in disk.entries().map_err(failed)? {
                    let kind = kinds.entry(entry.step).or_default();
                    *kind = (kind.0 + 1, kind.1 + entry.bytes);
                }
                let (count, bytes) = kinds.values().fold((0, 0), |sum, kind| (sum.0 + kind.0, sum.1 + kind.1));
                let mut text = format!("{folder}: {}, {}\n", counted(count, "bake"), size(bytes));
                for (step, (count, bytes)) in &kinds {
                    text += &format!("  {step:<30} {count:>5}  {:>10}\n", size(*bytes));
                }
                let steps: Vec<_> = kinds
                    .iter()
                    .map(|(step, (count, bytes))| json!({ "step": step, "count": count, "bytes": bytes }))
                    .collect();
                Ok(Answer::new(text, json!({ "folder": folder, "count": count, "bytes": bytes, "steps": steps })))
            }
            Cache::Clear => {
                let (count, bytes) = disk.clear().map_err(failed)?;
                let text = format!("{folder}: {} removed, {}\n", counted(count, "bake"), size(bytes));
                Ok(Answer::new(text, json!({ "folder": folder, "removed": count, "bytes": bytes })))
            }
        }
    }
}
