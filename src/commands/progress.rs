//! What is seen of steps that run: a bar on a terminal, and a summary afterwards.

use crate::problem::Problem;
use crate::store::{Finished, Origin, PlannedStep, Watch};
use indicatif::{ProgressBar, ProgressStyle};
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

    /// All that happened since this was last asked.
    pub fn take(&self) -> (Vec<Finished>, Vec<Problem>) {
        let finished = std::mem::take(&mut *self.finished.lock().expect("no panic while noting a step"));
        let warnings = std::mem::take(&mut *self.warnings.lock().expect("no panic while noting a warning"));
        (finished, warnings)
    }
}

/// `5 bakes ran, 2 came from disk, 31 passes drawn`
pub fn summary(finished: &[Finished]) -> String {
    let ran = finished.iter().filter(|step| step.origin == Origin::Ran).count();
    let disk = finished.iter().filter(|step| step.origin == Origin::Disk).count();
    format!("{ran} steps ran, {disk} came from disk")
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
        self.warnings.lock().expect("no panic while noting a warning").push(problem.clone());
    }
}
