use super::{Answer, LookFlags};
use crate::problem::Problems;
use crate::render;
use crate::session::{Options, Session};
use crate::store::Origin;
use serde_json::json;
use std::path::PathBuf;

/// Say what a picture takes: each step, whether it would run, and what is left out and why; draws nothing
#[derive(clap::Args)]
pub struct Explain {
    scene: PathBuf,
    #[command(flatten)]
    look: LookFlags,
}

impl Explain {
    pub fn run(self, options: Options) -> Result<Answer, Problems> {
        let session = Session::new(options);
        let (scene, warnings) = session.scene(&self.scene)?;
        let look = self.look.look(&scene)?;
        let (plan, picture) = render::plan(&scene, &look, &session.shaders)?;
        let states = session.store.states(&plan, picture);
        let word = |origin: Origin| match origin {
            Origin::Ran => "run",
            Origin::Memory => "memory",
            Origin::Disk => "disk",
        };

        let (width, height) = look.view.size;
        let n = look.view.antialias;
        let mut text = format!(
            "{}: {} object(s), {} light(s), {width} x {height} pixels of {n} x {n} samples, {}.\n\n",
            self.scene.display(),
            scene.objects.len(),
            scene.lights.len(),
            look.technique.ron,
        );
        text += "  no.  what it takes                  so that there is                                        from\n";
        for (i, (step, state)) in plan.steps().iter().zip(&states).enumerate() {
            let tale = match (state.origin, state.needed) {
                (Origin::Memory, _) => "it was read with the scene".to_string(),
                (Origin::Disk, true) => "it is on disk".to_string(),
                (Origin::Disk, false) => "it is on disk, and nobody needs it".to_string(),
                (Origin::Ran, false) => "nobody needs it: what it leads to is on disk".to_string(),
                (Origin::Ran, true) if step.is_bake() => "it is baked and kept".to_string(),
                (Origin::Ran, true) => String::new(),
            };
            let from: Vec<String> = step.inputs.iter().map(|input| (input + 1).to_string()).collect();
            let from = if from.is_empty() { String::new() } else { format!("from {}", from.join(" ")) };
            let end = [from, tale].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("; ");
            text += &format!("{:>5}  {:<30} {:<54}  {end}\n", i + 1, step.name, step.about);
        }
        if !plan.skipped().is_empty() {
            text += "\nLeft out:\n";
            for skipped in plan.skipped() {
                text += &format!("  {}: {}\n", skipped.what, skipped.why);
            }
        }

        let steps: Vec<_> = plan
            .steps()
            .iter()
            .zip(&states)
            .map(|(step, state)| {
                json!({
                    "name": step.name,
                    "about": step.about,
                    "key": step.key.to_string(),
                    "state": word(state.origin),
                    "needed": state.needed,
                    "bake": step.is_bake(),
                    "inputs": step.inputs.iter().map(|i| plan.steps()[*i as usize].key.to_string()).collect::<Vec<_>>(),
                })
            })
            .collect();
        Ok(Answer::new(text, json!({ "steps": steps, "skipped": plan.skipped() })).warn(&warnings))
    }
}
