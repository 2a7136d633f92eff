//! On what and by which program it was measured: `machine.json`.

use crate::gpu::Gpu;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::process::Command;
use std::time::SystemTime;

/// Without these, times say nothing.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    pub adapter: String,
    pub driver: String,
    /// Whether the adapter computes on the CPU.
    pub is_software: bool,
    pub cpu: String,
    pub threads: usize,
    /// Of this program's sources, where they lie in a repository.
    pub commit: String,
    /// Whether the compiler was asked for fast code.
    pub is_optimised: bool,
    /// Year, month and day, UTC.
    pub date: String,
}

impl Machine {
    pub fn of(gpu: &Gpu) -> Machine {
        let adapter = &gpu.adapter;
        let changed = git(&["status", "--porcelain", "-uno"]).is_some_and(|said| !said.is_empty());
        let commit = git(&["rev-parse", "HEAD"]).unwrap_or_else(|| "unknown".into());
        let seconds = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |time| time.as_secs());
        let (year, month, day) = date(seconds / 86400);
        Machine {
            adapter: format!("{} ({:?}, {:?})", adapter.name, adapter.backend, adapter.device_type),
            driver: format!("{} {}", adapter.driver, adapter.driver_info).trim().to_string(),
            is_software: gpu.is_software(),
            cpu: cpu(),
            threads: std::thread::available_parallelism().map_or(0, usize::from),
            commit: if changed { commit + ", with changes" } else { commit },
            is_optimised: !cfg!(debug_assertions),
            date: format!("{year}-{month:02}-{day:02}"),
        }
    }

    /// Whether times of the two can be held against each other.
    pub fn times_as(&self, other: &Machine) -> bool {
        let of = |m: &Machine| (m.adapter.clone(), m.driver.clone(), m.cpu.clone(), m.threads, m.is_optimised);
        of(self) == of(other)
    }

    /// The adapter by name, and that it is none where it is none.
    pub fn drawn_on(&self) -> String {
        let software = if self.is_software { ", a software adapter: it draws on the CPU" } else { "" };
        let slow = if self.is_optimised { "" } else { "; a build without optimisation" };
        format!("{}{software}{slow}", self.adapter)
    }
}

/// What a program prints, if it ends well.
fn said(program: &str, words: &[&str]) -> Option<String> {
    let output = Command::new(program).args(words).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_string())
}

/// What git says of the sources of this program.
fn git(words: &[&str]) -> Option<String> {
    let root = env!("CARGO_MANIFEST_DIR");
    // Another repository may lie around a folder that has none of its own.
    Path::new(root).join(".git").exists().then(|| said("git", &[&["-C", root], words].concat()))?
}

fn cpu() -> String {
    let known = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = known.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": ").map(|(_, name)| name));
    name.map(str::to_string)
        .or_else(|| said("sysctl", &["-n", "machdep.cpu.brand_string"]))
        .or_else(|| std::env::var("PROCESSOR_IDENTIFIER").ok())
        .unwrap_or_else(|| "unknown".into())
}

/// Year, month and day of the n-th day since 1970, in years that begin in March, so that a leap day is the last.
fn date(day: u64) -> (u64, u64, u64) {
    let day = day + 719_468; // since the first of March of the year 0
    let (era, day) = (day / 146_097, day % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let day = day - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    (era * 400 + year + u64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::super::tests::machine;
    use super::*;

    #[test]
    fn days_have_their_dates_and_a_software_adapter_is_named_as_such() {
        assert_eq!(date(0), (1970, 1, 1));
        assert_eq!(date(19_782), (2024, 2, 29));
        assert_eq!(date(20_088), (2024, 12, 31));
        assert!(machine().drawn_on().contains("software"));
        assert!(!Machine { is_software: false, ..machine() }.drawn_on().contains("software"));
        let elsewhere = Machine { cpu: "another".into(), ..machine() };
        let later = Machine { date: "2025-01-01".into(), commit: "abc".into(), ..machine() };
        assert!(machine().times_as(&later) && !machine().times_as(&elsewhere));
    }
}
