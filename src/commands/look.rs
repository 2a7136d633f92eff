//! How to look at a scene, as flags say it.

use crate::frame::Part;
use crate::problem::{Cause, Problem, Problems, nearest};
use crate::render::{self, Look};
use crate::scene::{Scene, TechniqueText};

#[derive(clap::Args, Clone, Debug)]
pub struct LookFlags {
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// The technique with its settings, for objects that name none: 'FilteredNormals()'
    #[arg(long, value_name = "RON")]
    technique: Option<String>,
    /// Look from one of the scene's bookmarks
    #[arg(long, value_name = "BOOKMARK")]
    camera: Option<String>,
    /// Scene time, seconds
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    time: Option<f64>,
    /// full, or one part: scattered (entered, scattered, left), glossy (reflected at the boundary) or unscattered
    /// (passed straight through)
    #[arg(long, value_enum, default_value = "full", hide_possible_values = true)]
    part: PartFlag,
    /// Leave nothing out, even what cannot change the picture
    #[arg(long)]
    no_skip: bool,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum PartFlag {
    Full,
    Scattered,
    Glossy,
    Unscattered,
}

/// `960x540`
pub(super) fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parse = |side: &str| side.parse::<u32>().ok().filter(|side| (1..=16384).contains(side));
    text.split_once('x')
        .and_then(|(width, height)| Some((parse(width)?, parse(height)?)))
        .ok_or_else(|| "a size is WIDTHxHEIGHT in pixels, 1x1 to 16384x16384, as in 960x540".into())
}

impl LookFlags {
    /// The size that was asked for.
    #[cfg(feature = "preview")]
    pub fn size(&self) -> Option<(u32, u32)> {
        self.size
    }

    /// The scene's own look, changed as the flags say, and possible with the scene's materials.
    pub fn look(&self, scene: &Scene) -> Result<Look, Problems> {
        let mut look = Look::of(scene);
        if let Some(size) = self.size {
            look.view.size = size;
        }
        if let Some(name) = &self.camera {
            look.view.camera = *scene.bookmarks.get(name).ok_or_else(|| {
                let names: Vec<&str> = scene.bookmarks.keys().map(String::as_str).collect();
                let near = nearest(name, names.iter().copied());
                let hint = match near {
                    Some(near) => format!("did you mean `{near}`?"),
                    None if names.is_empty() => {
                        "the scene has none: add bookmarks: { \"name\": (eye: …, target: …) }".into()
                    }
                    None => format!("the scene has `{}`", names.join("`, `")),
                };
                Problem::new(Cause::Words, format!("--camera: there is no bookmark `{name}`")).hint(hint)
            })?;
        }
        if let Some(time) = self.time {
            if !time.is_finite() {
                let problem = Problem::new(Cause::Words, "--time: this is not a finite number");
                return Err(problem.hint("seconds, as in 1.5").into());
            }
            look.view.time_s = time;
        }
        if let Some(ron) = &self.technique {
            look.technique = TechniqueText::from_flag("--technique", ron)?;
        }
        look.view.part = match self.part {
            PartFlag::Full => Part::Full,
            PartFlag::Scattered => Part::Scattered,
            PartFlag::Glossy => Part::Glossy,
            PartFlag::Unscattered => Part::Unscattered,
        };
        look.view.skip = !self.no_skip;
        render::check(scene, &look.technique)?;
        Ok(look)
    }
}
