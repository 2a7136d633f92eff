use super::Answer;
use super::look::LookFlags;
use crate::problem::Problem;
use crate::session::Options;
use std::path::PathBuf;

/// Look at a scene in a window that follows every edit of its files
#[derive(clap::Args)]
#[cfg_attr(feature = "preview", command(after_long_help = crate::preview::WORDS))]
pub struct Preview {
    /// The scene's file
    scene: PathBuf,
    #[command(flatten)]
    look: LookFlags,
}

impl Preview {
    #[cfg(feature = "preview")]
    pub fn run(self, options: Options, json: bool) -> Result<Answer, Problem> {
        // A name that was mistyped is no scene that somebody is about to write.
        if let Err(error) = std::fs::metadata(&self.scene) {
            let at = crate::problem::At::file(&self.scene);
            return Err(Problem::files(format!("it cannot be read: {error}")).at(at).hint("name a scene's file"));
        }
        let size = self.look.size();
        let look = Box::new(move |scene: &crate::scene::Scene| self.look.look(scene));
        crate::preview::open(crate::preview::Asked { options, scene: self.scene, look, size, json })?;
        Ok(Answer::default())
    }

    #[cfg(not(feature = "preview"))]
    pub fn run(self, _: Options, _: bool) -> Result<Answer, Problem> {
        Err(Problem::new(crate::problem::Cause::Words, "this build of the program has no window")
            .hint("build it with one: `cargo build --release --features preview`; `diaphane render` makes pictures"))
    }
}
