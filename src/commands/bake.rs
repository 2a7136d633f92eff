use super::progress::{Progress, seconds, summary};
use super::{Answer, LookFlags, session};
use crate::problem::{Problem, Problems};
use crate::render;
use crate::session::Options;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Make what a picture needs on disk, and no picture; needs no adapter
#[derive(clap::Args)]
pub struct Bake {
    scene: PathBuf,
    #[command(flatten)]
    look: LookFlags,
}

impl Bake {
    pub fn run(self, options: Options) -> Result<Answer, Problems> {
        let started = Instant::now();
        let mut session = session(options);
        let (scene, warnings) = session.scene(&self.scene)?;
        let look = self.look.look(&scene)?;
        let (plan, _) = render::plan(&scene, &look, &session.shaders)?;
        let progress = Progress::new();
        session.store.bake(&plan, &progress)?;
        let (finished, told) = progress.take();
        let bakes = plan.steps().iter().filter(|step| step.is_bake()).count();
        let place = session.store.disk().map(|disk| disk.folder().display().to_string());
        let text = format!(
            "{}  {bakes} bakes  {}  {}\n",
            place.as_deref().unwrap_or("(not kept: --no-cache)"),
            seconds(started.elapsed()),
            summary(&finished),
        );
        let facts = json!({ "bakes": bakes, "folder": place, "seconds": started.elapsed().as_secs_f64() });
        let mut answer = Answer::new(text, facts).warn(&warnings);
        answer.talk.extend(told.iter().map(Problem::to_string));
        Ok(answer)
    }
}
