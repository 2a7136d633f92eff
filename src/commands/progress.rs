//! What is seen of steps that run: a bar on a terminal, and a summary afterwards.

use super::counted;
use crate::problem::Problem;
use crate::store::{Finished, Key, Origin, Plan, PlannedStep, Watch};
use indicatif::{ProgressBar, ProgressStyle};
use std::collections::BTreeSet;
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::Duration;

pub struct Progress {
    bar: Mutex<Option<ProgressBar>>,
    finished: Mutex<Vec<Finished>>,
    warnings: Mutex<Vec<Problem>>,
    shown: bool,
}

impl Progress {
    pub fn new() -> Progress {
        Progress {
            bar: Mutex::default(),
            finished: Mutex::default(),
            warnings: Mutex::default(),
            shown: std::io::stderr().is_terminal(),
        }
    }

    /// A line on the terminal, if there is one.
    pub fn tell(&self, line: &str) {
        if self.shown {
            eprintln!("{line}");
        }
    }

    /// All that happened since this was last asked.
    pub fn take(&self) -> (Vec<Finished>, Vec<Problem>) {
        let finished = std::mem::take(&mut *self.finished.lock().expect("no panic while noting a step"));
        let warnings = std::mem::take(&mut *self.warnings.lock().expect("no panic while noting a warning"));
        (finished, warnings)
    }
}

/// How many values were made, and how many were there.
#[derive(Default)]
pub struct Made {
    pub bakes: usize,
    pub from_disk: usize,
    pub passes: usize,
}

impl Made {
    pub fn of(plan: &Plan, finished: &[Finished]) -> Made {
        let bakes: BTreeSet<Key> = plan.steps().iter().filter(|step| step.is_bake()).map(|step| step.key).collect();
        let mut made = Made::default();
        for step in finished {
            match (step.origin, bakes.contains(&step.key)) {
                (Origin::Ran, true) => made.bakes += 1,
                (Origin::Ran, false) => made.passes += 1,
                (Origin::Disk, _) => made.from_disk += 1,
                (Origin::Memory, _) => {}
            }
        }
        made
    }
}

/// `2 bakes from disk, 1 made, 31 passes drawn`
impl std::fmt::Display for Made {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let from_disk = counted(self.from_disk, "bake");
        write!(f, "{from_disk} from disk, {} made, {} drawn", self.bakes, counted_passes(self.passes))
    }
}

fn counted_passes(passes: usize) -> String {
    if passes == 1 { "1 pass".into() } else { format!("{passes} passes") }
}

pub fn seconds(time: Duration) -> String {
    match time.as_secs_f64() {
        s if s < 0.1 => format!("{:.1} ms", 1e3 * s),
        s => format!("{s:.2} s"),
    }
}

impl Watch for Progress {
    fn progress(&self, step: &PlannedStep, share: f64) {
        // Passes are over before a bar is read.
        if !self.shown || !step.is_bake() {
            return;
        }
        let mut bar = self.bar.lock().expect("no panic while drawing a bar");
        let bar = bar.get_or_insert_with(|| {
            let style = ProgressStyle::with_template("{msg:40!} {bar:30} {percent:>3} %  {eta:>4} left")
                .expect("the template is right");
            ProgressBar::new(1000).with_style(style).with_message(step.about.clone())
        });
        bar.set_position((1000.0 * share) as u64);
    }

    fn finished(&self, finished: &Finished) {
        if let Some(bar) = self.bar.lock().expect("no panic while drawing a bar").take() {
            bar.finish_and_clear();
        }
        self.finished.lock().expect("no panic while noting a step").push(finished.clone());
    }

    fn warn(&self, problem: &Problem) {
        // A bake that cannot be read is looked for whenever something asks for it.
        let mut warnings = self.warnings.lock().expect("no panic while noting a warning");
        if !warnings.contains(problem) {
            warnings.push(problem.clone());
        }
    }
}
