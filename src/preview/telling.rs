//! What the window says to programs that listen: each thing once.

use super::screen::Screen;
use super::stage::Drawn;
use super::window::Preview;
use crate::problem::{Problem, Problems};
use crate::store::{Finished, Key, Origin};
use serde_json::{Value, json};

impl Preview {
    pub fn tell_picture(&mut self, screen: &Screen, drawn: &Drawn, made: &[Finished], whole: bool) {
        self.told_waiting &= !drawn.current;
        let texture = &drawn.picture.0[0];
        let Ok(levels) = screen.gpu.read_texture(texture) else { return }; // a lost device is noticed by the next frame
        let of = |origin: Origin| made.iter().filter(|step| step.origin == origin).count();
        self.channel.say(
            "drawn",
            json!({
                "picture": Key::of_bytes(&levels).to_string(),
                "width": texture.shape.width,
                "height": texture.shape.height,
                "current": drawn.current,
                "whole": whole,
                "steps": { "run": drawn.steps.ran, "reused": drawn.steps.reused, "unneeded": drawn.steps.unneeded },
                "traced": drawn.level.map(|level| json!({
                    "samples": level.samples,
                    "relative_standard_error": level.error.is_finite().then_some(level.error),
                    "refines": drawn.refines,
                })),
                "bakes": { "run": of(Origin::Ran), "disk": of(Origin::Disk) },
                "ms": 1e3 * drawn.time.as_secs_f64(),
            }),
        );
    }

    pub fn tell_waiting(&mut self) {
        if let Some(progress) = self.stage.progress()
            && !std::mem::replace(&mut self.told_waiting, true)
        {
            self.channel.say("baking", json!({ "about": progress.about }));
        }
    }

    pub fn problems(&self) -> Problems {
        Problems(self.stage.problems().0.into_iter().chain(self.refused.0.iter().cloned()).collect())
    }

    /// How things stand.
    pub fn tell_status(&self) {
        let subject = self.stage.subject();
        let chosen = self.panel.chosen.zip(subject).map(|(place, subject)| &subject.scene.objects[place].name);
        self.channel.say(
            "status",
            json!({
                "frames": self.frames,
                "problems": list(&self.problems()),
                "size": self.screen.as_ref().and_then(Screen::size),
                "baking": self.stage.progress().map(|progress| progress.about),
                "eye": self.viewing.camera.eye.to_array(),
                "target": self.viewing.camera.target.to_array(),
                "technique": subject.map(|subject| &subject.look.technique.ron),
                "time_s": subject.map(|subject| subject.look.view.time_s),
                "playing": self.playing.is_some(),
                "chosen": chosen,
                "panel": self.panel.shown,
            }),
        );
    }

    pub fn tell_problems(&mut self) {
        let problems = self.problems();
        if problems == self.told {
            return;
        }
        match problems.0.is_empty() {
            true => self.channel.say("mended", json!({})),
            false => self.channel.say("problem", json!({ "problems": list(&problems) })),
        }
        self.told = problems;
        self.redraw_soon();
    }
}

fn list(problems: &Problems) -> Value {
    problems.0.iter().map(Problem::json).collect()
}
