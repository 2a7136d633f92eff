use super::{Answer, counted};
use crate::problem::{At, Cause, Problem, Problems, Severity};
use crate::session::Options;
use crate::store::Disk;
use serde_json::json;
use std::collections::BTreeMap;

/// Look at the bakes that are kept, or remove them
#[derive(clap::Subcommand)]
pub enum Cache {
    /// Say how many there are, of what, and how large
    Stat,
    /// Read them all, and report those that are broken: with status 1, unless --remove put that right
    Verify {
        /// Remove what is broken; else it is made again when it is needed
        #[arg(long)]
        remove: bool,
    },
    /// Remove those that were used longest ago, and what interrupted programs left
    Gc {
        /// What all that stay may take together: 500MB, 2GiB
        #[arg(long, value_name = "SIZE", default_value = "4GiB", value_parser = parse_size)]
        max_size: u64,
    },
    /// Remove them all; they are made again when they are needed
    Clear,
}

/// `500MB`, `2GiB`, `1000`
fn parse_size(text: &str) -> Result<u64, String> {
    let wrong = || "a size is a number of bytes, kB, MB, GB, KiB, MiB or GiB, as in 2GiB".to_string();
    let split = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let unit: u64 = match unit.to_ascii_lowercase().as_str() {
        "" | "b" => 1,
        "kb" => 1000,
        "mb" => 1_000_000,
        "gb" => 1_000_000_000,
        "kib" => 1 << 10,
        "mib" => 1 << 20,
        "gib" => 1 << 30,
        _ => return Err(wrong()),
    };
    let bytes = number.trim().parse::<f64>().map_err(|_| wrong())? * unit as f64;
    if (0.0..1e18).contains(&bytes) { Ok(bytes as u64) } else { Err(wrong()) }
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
            Cache::Verify { remove } => {
                let (count, broken) = disk.verify().map_err(failed)?;
                let mut found = Vec::new();
                for (entry, why) in &broken {
                    if remove {
                        entry.remove().map_err(failed)?;
                    }
                    let hint = match remove {
                        true => "it was removed, and is made again when it is needed",
                        false => "it is made again when it is needed; --remove removes it now",
                    };
                    found.push(
                        Problem::files(format!("this bake is broken: {why}")).at(At::file(&entry.path)).hint(hint),
                    );
                }
                if !remove && !found.is_empty() {
                    return Err(Problems(found));
                }
                found.iter_mut().for_each(|problem| problem.severity = Severity::Warning);
                let text = format!("{folder}: {} read, {} broken\n", counted(count, "bake"), broken.len());
                Ok(Answer::new(text, json!({ "folder": folder, "count": count, "broken": broken.len() })).warn(found))
            }
            Cache::Gc { max_size } => {
                let swept = disk.sweep(max_size).map_err(failed)?;
                let text = format!(
                    "{folder}: {} and {} removed, {}; {} kept, {}\n",
                    counted(swept.bakes, "bake"),
                    counted(swept.abandoned, "unfinished file"),
                    size(swept.bytes),
                    counted(swept.kept, "bake"),
                    size(swept.kept_bytes),
                );
                let facts = json!({
                    "folder": folder,
                    "removed": swept.bakes,
                    "unfinished": swept.abandoned,
                    "bytes": swept.bytes,
                    "kept": swept.kept,
                    "kept_bytes": swept.kept_bytes,
                });
                Ok(Answer::new(text, facts))
            }
            Cache::Clear => {
                let (count, bytes) = disk.clear().map_err(failed)?;
                let text = format!("{folder}: {} removed, {}\n", counted(count, "bake"), size(bytes));
                Ok(Answer::new(text, json!({ "folder": folder, "removed": count, "bytes": bytes })))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_as_people_write_them() {
        assert_eq!(parse_size("2GiB"), Ok(2 << 30));
        assert_eq!(parse_size("1.5 kb"), Ok(1500));
        assert_eq!(parse_size("0"), Ok(0));
        for wrong in ["", "GiB", "-1", "NaN", "inf", "2 parsecs", "1e30"] {
            assert!(parse_size(wrong).is_err(), "{wrong}");
        }
    }
}
