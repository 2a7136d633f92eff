use super::look::LookFlags;
use super::progress::{Made, Progress, seconds};
use super::{Answer, counted, session};
use crate::problem::{Cause, Problem, Problems, Severity};
use crate::render;
use crate::session::Options;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Make what a picture needs on disk, and no picture; needs no adapter
#[derive(clap::Args)]
pub struct Bake {
    /// The scene's file
    scene: PathBuf,
    #[command(flatten)]
    look: LookFlags,
}

impl Bake {
    pub fn run(self, options: Options) -> Result<Answer, Problems> {
        let started = Instant::now();
        let mut session = session(options);
        let (scene, mut warnings) = session.scene(&self.scene)?;
        let look = self.look.look(&scene)?;
        let (plan, _) = render::plan(&scene, &look, &session.shaders)?;
        let progress = Progress::new();
        session.store.bake(&plan, &progress)?;
        let (finished, told) = progress.take();
        // Who wants bakes on disk has got nothing when they cannot be kept.
        if let Some(failed) = told.iter().find(|problem| problem.cause == Cause::Unfinished) {
            let problem = Problem { severity: Severity::Error, ..failed.clone() };
            return Err(problem.hint("free some space, or name another folder with --cache-dir").into());
        }
        warnings.extend(told);
        let bakes = plan.steps().iter().filter(|step| step.is_bake()).count();
        let made = Made::of(&plan, &finished);
        let place = session.store.disk().map(|disk| disk.folder().display().to_string());
        let text = format!(
            "{}  {}: {} from disk, {} made  {}\n",
            place.as_deref().unwrap_or("(not kept: --no-cache)"),
            counted(bakes, "bake"),
            made.from_disk,
            made.bakes,
            seconds(started.elapsed()),
        );
        let facts = json!({
            "bakes": bakes,
            "from_disk": made.from_disk,
            "made": made.bakes,
            "folder": place,
            "seconds": started.elapsed().as_secs_f64(),
        });
        Ok(Answer::new(text, facts).warn(warnings))
    }
}
