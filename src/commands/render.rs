use super::look::LookFlags;
use super::progress::{Made, Progress, seconds};
use super::{Answer, session};
use crate::image::{Display, Format, Image, write_file};
use crate::problem::{Cause, Problem, Problems};
use crate::render::Look;
use crate::scene::Scene;
use crate::session::{Options, Session};
use crate::store::{Finished, Key, Origin};
use glam::DQuat;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Make a picture, or a row of them
#[derive(clap::Args)]
pub struct Render {
    /// The scene's file
    scene: PathBuf,
    /// Where to: .png (as a display shows it) or .exr (linear light); of several pictures, %04d is the number
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    look: LookFlags,
    /// Make so many pictures, one after another in time
    #[arg(long, value_name = "N", conflicts_with = "turntable")]
    frames: Option<u32>,
    /// Pictures per second of scene time, for --frames
    #[arg(long, value_name = "N", default_value_t = 24.0)]
    fps: f64,
    /// Make so many pictures, once around what the camera looks at
    #[arg(long, value_name = "N")]
    turntable: Option<u32>,
    /// Print the time of every step
    #[arg(long)]
    timings: bool,
}

impl Render {
    /// `line` is told of each picture when it is there.
    pub fn run(self, options: Options, line: &dyn Fn(&str) -> Result<(), Problem>) -> Result<Answer, Problems> {
        let format = Format::of(&self.output)?;
        let words = |what: &str, hint: &str| Problems::from(Problem::new(Cause::Words, what).hint(hint));
        let count = self.frames.or(self.turntable);
        if count == Some(0) {
            return Err(words("no pictures are nothing to do", "ask for at least 1"));
        }
        if count.is_some() && numbered(&self.output, 0).is_none() {
            return Err(words(
                "several pictures cannot go to one file",
                "put the number's place into the name: -o out.%04d.png",
            ));
        }
        if !(self.fps.is_finite() && self.fps > 0.0) {
            return Err(words(&format!("--fps {}: time would stand still", self.fps), "a number above 0, as in 24"));
        }
        let mut session = session(options);
        session.timed = self.timings;
        let (scene, warnings) = session.scene(&self.scene)?;
        let look = self.look.look(&scene)?;
        let mut answer = Answer::new("", json!({ "images": [] })).warn(warnings);
        for frame in 0..count.unwrap_or(1) {
            let look = self.frame(&look, frame);
            let file = match count {
                Some(_) => numbered(&self.output, frame).expect("the name was looked at above"),
                None => self.output.clone(),
            };
            line(&self.picture(&mut session, &scene, &look, &file, format, &mut answer)?)?;
        }
        Ok(answer)
    }

    /// How the n-th frame is looked at.
    fn frame(&self, look: &Look, n: u32) -> Look {
        let mut look = look.clone();
        if self.frames.is_some() {
            look.view.time_s += n as f64 / self.fps;
        }
        if let Some(count) = self.turntable {
            let camera = &mut look.view.camera;
            let turn = DQuat::from_axis_angle(camera.up.normalize(), std::f64::consts::TAU * n as f64 / count as f64);
            camera.eye = camera.target + turn * (camera.eye - camera.target);
        }
        look
    }

    /// One picture and what there is to say of it.
    fn picture(
        &self,
        session: &mut Session,
        scene: &Scene,
        look: &Look,
        file: &Path,
        format: Format,
        answer: &mut Answer,
    ) -> Result<String, Problem> {
        let started = Instant::now();
        let progress = Progress::new();
        let (plan, image) = session.render(scene, look, &progress)?;
        write_picture(file, format, scene, look, &image)?;
        let (finished, warnings) = progress.take();
        answer.warnings.extend(warnings);
        let time = started.elapsed();
        let (width, height) = look.view.size;
        if let Some(Value::Array(images)) = answer.json.get_mut("images") {
            images.push(json!({
                "path": file.display().to_string(),
                "width": width,
                "height": height,
                "seconds": time.as_secs_f64(),
                "steps": finished.iter().map(facts).collect::<Vec<_>>(),
            }));
        }
        let made = Made::of(&plan, &finished);
        let timings = if self.timings { timings(&finished) } else { String::new() };
        Ok(format!("{}  {width} x {height}  {}  {made}\n{timings}", file.display(), seconds(time)))
    }
}

/// Writes a picture with what made it.
pub fn write_picture(file: &Path, format: Format, scene: &Scene, look: &Look, image: &Image) -> Result<(), Problem> {
    let display = Display { tone: scene.view.tone, exposure_ev: scene.view.exposure_ev as f32 };
    let text = [
        ("Software", concat!("diaphane ", env!("CARGO_PKG_VERSION"))),
        ("diaphane:scene", &Key::of(scene).to_string()),
        ("diaphane:technique", &look.technique.ron),
    ];
    write_file(file, &image.encode(format, display, &text)?)
}

fn facts(step: &Finished) -> Value {
    json!({
        "name": step.name,
        "about": step.about,
        "key": step.key.to_string(),
        "origin": match step.origin { Origin::Ran => "run", Origin::Memory => "memory", Origin::Disk => "disk" },
        "ms": 1e3 * step.time.as_secs_f64(),
    })
}

/// One line a step.
pub fn timings(finished: &[Finished]) -> String {
    let line = |step: &Finished| {
        let from = if step.origin == Origin::Disk { " (from disk)" } else { "" };
        format!("  {:>10.2} ms  {:<28} {}{from}\n", 1e3 * step.time.as_secs_f64(), step.name, step.about)
    };
    finished.iter().map(line).collect()
}

/// `out.%04d.png` for the n-th frame. More than nine digits hold no number that is counted to.
fn numbered(file: &Path, n: u32) -> Option<PathBuf> {
    let name = file.to_string_lossy();
    name.match_indices('%').find_map(|(start, _)| {
        let (width, rest) = name[start + 1..].split_once('d')?;
        let width: usize = match width {
            "" => 0,
            digits => digits.parse().ok().filter(|width| *width <= 9)?,
        };
        Some(format!("{}{n:0width$}{rest}", &name[..start]).into())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_numbered_as_printf_does() {
        let name = |pattern: &str| numbered(Path::new(pattern), 7).map(|p| p.display().to_string());
        assert_eq!(name("a/out.%04d.png").as_deref(), Some("a/out.0007.png"));
        assert_eq!(name("%d.exr").as_deref(), Some("7.exr"));
        assert_eq!(name("50%/out.%2d.png").as_deref(), Some("50%/out.07.png"));
        assert_eq!(name("out.%070000d.png"), None);
        assert_eq!(name("out.png"), None);
        assert_eq!(name("out.%xd.png"), None);
    }
}
