use super::look::LookFlags;
use super::{Answer, counted};
use crate::problem::Problems;
use crate::render::{self, Look};
use crate::scene::Scene;
use crate::session::{Options, Session};
use crate::store::{Origin, Plan, PlannedStep, State};
use serde_json::json;
use std::path::PathBuf;

/// Say what a picture takes: each step, whether it would run, and what is left out and why; draws nothing
#[derive(clap::Args)]
pub struct Explain {
    /// The scene's file
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
        let steps: Vec<_> = plan
            .steps()
            .iter()
            .zip(&states)
            .map(|(step, state)| {
                let inputs = step.inputs.iter().map(|i| plan.steps()[*i as usize].key.to_string());
                json!({
                    "name": step.name,
                    "about": step.about,
                    "key": step.key.to_string(),
                    "state": Fate::of(step, *state).word(),
                    "inputs": inputs.collect::<Vec<_>>(),
                })
            })
            .collect();
        let text = format!("{}: {}", self.scene.display(), story(&scene, &look, &plan, &states));
        Ok(Answer::new(text, json!({ "steps": steps, "skipped": plan.skipped() })).warn(warnings))
    }
}

/// What would happen to a step.
#[derive(Clone, Copy, PartialEq)]
enum Fate {
    /// It was read with the scene.
    Read,
    OnDisk,
    /// Neither made nor read: what it leads to is on disk.
    Unneeded,
    Baked,
    Drawn,
}

impl Fate {
    fn of(step: &PlannedStep, state: State) -> Fate {
        match state.origin {
            Origin::Memory => Fate::Read,
            Origin::Disk => Fate::OnDisk,
            Origin::Ran if !state.needed => Fate::Unneeded,
            Origin::Ran if step.is_bake() => Fate::Baked,
            Origin::Ran => Fate::Drawn,
        }
    }

    /// For programs: `run` only where something would run.
    fn word(self) -> &'static str {
        match self {
            Fate::Read => "memory",
            Fate::OnDisk | Fate::Unneeded => "disk",
            Fate::Baked | Fate::Drawn => "run",
        }
    }

    fn tale(self) -> &'static str {
        match self {
            Fate::Read => "there",
            Fate::OnDisk => "on disk",
            Fate::Unneeded => "not needed",
            Fate::Baked => "is baked",
            Fate::Drawn => "is drawn",
        }
    }
}

/// The chapters in the order of light, and the steps that open them. Any other step belongs to the chapter that is open.
const CHAPTERS: [(&str, &[&str]); 7] = [
    ("The shapes", &["geometry."]),
    ("What the camera sees of them", &["frame.gbuffer"]),
    ("Which light reaches what", &["frame.shadow", "frame.visibility", "sky."]),
    ("Light that went in and came out again", &["technique.", "filtered_normals."]),
    (
        "Light that did not: mirrored, or straight through",
        &["gloss.", "frame.openness", "frame.gloss", "frame.through"],
    ),
    ("Light that is followed, path by path", &["reference.world"]),
    ("The picture", &["frame.compose", "frame.resolve", "frame.image", "reference.picture"]),
];

fn story(scene: &Scene, look: &Look, plan: &Plan, states: &[State]) -> String {
    let (width, height) = look.view.size;
    let fates: Vec<Fate> = plan.steps().iter().zip(states).map(|(step, state)| Fate::of(step, *state)).collect();
    let count = |fate: Fate| fates.iter().filter(|f| **f == fate).count();
    let mut text = format!(
        "{} and {}, {width} x {height} pixels{samples},\nrendered with {}.\n\n",
        counted(scene.objects.len(), "object"),
        counted(scene.lights.len(), "light"),
        look.technique.ron,
        samples = match look.view.antialias {
            1 => String::new(),
            n => format!(" of {n} x {n} samples"),
        },
    );
    text += &format!(
        "It takes {}: {} from disk, {} to be made, and {} drawn.\n",
        counted(fates.len(), "step"),
        counted(count(Fate::OnDisk), "bake"),
        if count(Fate::Baked) == 0 { "none".into() } else { count(Fate::Baked).to_string() },
        match count(Fate::Drawn) {
            1 => "1 pass to be".into(),
            passes => format!("{passes} passes to be"),
        },
    );

    // Chapters only go forwards, whatever the order of the steps within them.
    let mut next = 0;
    for (i, (step, fate)) in plan.steps().iter().zip(&fates).enumerate() {
        let opens = |(_, names): &(&str, &[&str])| names.iter().any(|name| step.name.starts_with(name));
        if let Some(chapter) = CHAPTERS.iter().skip(next).position(opens) {
            next += chapter + 1;
            text += &format!("\n{}\n", CHAPTERS[next - 1].0);
        }
        let from = places(&step.inputs);
        let from = if from.is_empty() { String::new() } else { format!(", from {from}") };
        let key = step.key.to_string();
        text += &format!("{:>5}  {}  {:<10}  {}{from}\n", i + 1, &key[..8], fate.tale(), step.about);
    }

    text += "\nLeft out\n";
    for skipped in plan.skipped() {
        text += &format!("       {}: {}\n", skipped.what, skipped.why);
    }
    if plan.skipped().is_empty() {
        text += "       nothing: the picture needs all that the scene has\n";
    }
    text
}

/// The numbers of steps, counted from 1: `2, 6-9 and 12`.
fn places(inputs: &[u32]) -> String {
    let mut sorted: Vec<u32> = inputs.iter().map(|input| input + 1).collect();
    sorted.sort();
    sorted.dedup();
    let runs: Vec<String> = sorted
        .chunk_by(|a, b| a + 1 == *b)
        .flat_map(|run| match run {
            [first, _, .., last] => vec![format!("{first}-{last}")],
            few => few.iter().map(u32::to_string).collect(),
        })
        .collect();
    match runs.as_slice() {
        [] => String::new(),
        [only] => only.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_places_of_inputs_are_told_once_and_in_order() {
        assert_eq!(places(&[]), "");
        assert_eq!(places(&[1, 1, 1]), "2");
        assert_eq!(places(&[11, 8, 5, 7, 6, 1, 11]), "2, 6-9 and 12");
        assert_eq!(places(&[0, 1]), "1 and 2");
    }
}
