//! The commands: what the words mean, one file each. A command returns what it has to say; `main` prints it.

mod bake;
mod cache;
mod check;
mod doctor;
mod explain;
mod media;
mod new;
mod progress;
mod render;
mod techniques;

use crate::problem::{Cause, Problem, Problems};
use crate::scene::Scene;
use crate::session::{Options, Session};
use clap::{Parser, Subcommand};
use serde_json::Value;
use std::path::PathBuf;

/// Renders translucent things from text files.
#[derive(Parser)]
#[command(name = "diaphane", version, about, long_about = None, disable_help_subcommand = true, max_term_width = 100)]
#[command(before_help = FIRST_SESSION)]
pub struct Words {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    global: Global,
}

/// What is said before the help, and when there are no words at all.
pub const FIRST_SESSION: &str = "\
Diaphane renders translucent things (skin, marble, jade, wax, milk, leaves) from text files,
and says what each way of rendering them costs.

A first session:
  diaphane new pebble                            write pebble.ron and pebble.material.ron
  diaphane render pebble.ron -o pebble.png       make a picture of it
  diaphane check pebble.ron                      say what is wrong with it, after an edit
  diaphane explain pebble.ron                    say what a picture takes, and what it does not
  diaphane techniques                            list the ways of making light go through things";

#[derive(clap::Args, Clone, Debug)]
struct Global {
    /// The same facts for programs
    #[arg(long, global = true)]
    json: bool,
    /// Where bakes are kept
    #[arg(long, global = true, value_name = "DIR", env = "DIAPHANE_CACHE")]
    cache_dir: Option<PathBuf>,
    /// Keep no bakes, and use none that were kept
    #[arg(long, global = true)]
    no_cache: bool,
    /// The adapter to draw with, by a part of its name
    #[arg(long, global = true, value_name = "NAME")]
    adapter: Option<String>,
    /// Put RON in place of what the scene says: `objects.bunny.transform.scale=2`
    #[arg(long, global = true, value_name = "PATH=RON")]
    set: Vec<String>,
}

#[derive(Subcommand)]
enum Command {
    New(new::New),
    Check(check::Check),
    Explain(explain::Explain),
    Render(render::Render),
    Bake(bake::Bake),
    #[command(subcommand)]
    Media(media::Media),
    Techniques(techniques::Techniques),
    #[command(subcommand)]
    Cache(cache::Cache),
    Doctor(doctor::Doctor),
}

/// What a command has to say: for people and for programs.
#[derive(Debug, Default)]
pub struct Answer {
    /// The facts, for stdout.
    pub text: String,
    pub json: Value,
    /// Talk, for stderr: warnings.
    pub talk: Vec<String>,
}

impl Answer {
    fn new(text: impl Into<String>, json: Value) -> Answer {
        Answer { text: text.into(), json, talk: Vec::new() }
    }

    fn warn(mut self, warnings: &[Problem]) -> Answer {
        self.talk.extend(warnings.iter().map(Problem::to_string));
        if let Value::Object(facts) = &mut self.json {
            facts.insert("warnings".into(), warnings.iter().map(Problem::json).collect());
        }
        self
    }
}

impl Words {
    pub fn wants_json(&self) -> bool {
        self.global.json
    }

    /// Does what the words say.
    pub fn run(self) -> Result<Answer, Problems> {
        let options = self.global.options()?;
        match self.command {
            None => Ok(Answer::new(
                format!("{FIRST_SESSION}\n\n`diaphane --help` lists the rest.\n"),
                serde_json::json!({ "version": env!("CARGO_PKG_VERSION") }),
            )),
            Some(Command::New(command)) => command.run(),
            Some(Command::Check(command)) => command.run(options),
            Some(Command::Explain(command)) => command.run(options),
            Some(Command::Render(command)) => command.run(options),
            Some(Command::Bake(command)) => command.run(options),
            Some(Command::Media(command)) => command.run(options),
            Some(Command::Techniques(command)) => command.run(),
            Some(Command::Cache(command)) => command.run(options),
            Some(Command::Doctor(command)) => command.run(options),
        }
    }
}

impl Global {
    fn options(&self) -> Result<Options, Problem> {
        let sets = self.set.iter().map(|set| {
            let (path, ron) = set.split_once('=').ok_or_else(|| {
                Problem::new(Cause::Words, format!("--set {set}: there is no `=`"))
                    .hint("write the path of a value and RON to put there: --set objects.bunny.transform.scale=2")
            })?;
            Ok((path.trim().to_string(), ron.trim().to_string()))
        });
        Ok(Options {
            cache_dir: self.cache_dir.clone(),
            no_cache: self.no_cache,
            adapter: self.adapter.clone(),
            sets: sets.collect::<Result<_, Problem>>()?,
        })
    }
}

/// A session that stops its work, and keeps what was done, when the user interrupts it.
fn session(options: Options) -> Session {
    let session = Session::new(options);
    let cancel = session.store.cancel.clone();
    // A second handler cannot be set; the first serves.
    ctrlc::set_handler(move || cancel.cancel()).ok();
    session
}

/// `--size 960x540`
fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parse = |side: &str| side.parse::<u32>().ok().filter(|side| (1..=16384).contains(side));
    text.split_once('x')
        .and_then(|(width, height)| Some((parse(width)?, parse(height)?)))
        .ok_or_else(|| "a size is WIDTHxHEIGHT in pixels, 1x1 to 16384x16384, as in 960x540".into())
}

/// How to look at a scene, as flags say it.
#[derive(clap::Args, Clone, Debug)]
struct LookFlags {
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// The technique, with its settings: 'FilteredNormals()'
    #[arg(long, value_name = "RON")]
    technique: Option<String>,
    /// One of the scene's bookmarks
    #[arg(long, value_name = "BOOKMARK")]
    camera: Option<String>,
    /// Scene time, seconds
    #[arg(long, value_name = "S")]
    time: Option<f64>,
    /// Which of its parts the picture shows
    #[arg(long, value_enum, default_value = "full")]
    part: PartFlag,
    /// Leave nothing out, even what cannot change the picture
    #[arg(long)]
    no_skip: bool,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum PartFlag {
    Full,
    /// Entered, scattered at least once, left
    Scattered,
    /// Reflected at the boundary
    Glossy,
    /// Passed through without scattering
    Unscattered,
}

impl LookFlags {
    fn look(&self, scene: &Scene) -> Result<crate::render::Look, Problem> {
        use crate::frame::Part;
        let mut look = crate::render::Look::of(scene);
        if let Some(size) = self.size {
            look.view.size = size;
        }
        if let Some(name) = &self.camera {
            look.view.camera = *scene.bookmarks.get(name).ok_or_else(|| {
                let names: Vec<&str> = scene.bookmarks.keys().map(String::as_str).collect();
                let problem = Problem::new(Cause::Words, format!("--camera: there is no bookmark `{name}`"));
                match (crate::problem::nearest(name, names.iter().copied()), names.is_empty()) {
                    (Some(near), _) => problem.hint(format!("did you mean `{near}`?")),
                    (None, true) => {
                        problem.hint("the scene has none: add bookmarks: { \"name\": (eye: …, target: …) }")
                    }
                    (None, false) => problem.hint(format!("there is `{}`", names.join("`, `"))),
                }
            })?;
        }
        if let Some(time) = self.time {
            if !time.is_finite() {
                return Err(Problem::new(Cause::Words, "--time is not a finite number").hint("seconds, as in 1.5"));
            }
            look.view.time_s = time;
        }
        if let Some(ron) = &self.technique {
            look.technique = crate::scene::TechniqueText::from_flag("--technique", ron)
                .and_then(|text| crate::techniques::read(&text).map(|_| text))
                .map_err(|problem| Problem { cause: Cause::Words, ..problem })?;
        }
        look.view.part = match self.part {
            PartFlag::Full => Part::Full,
            PartFlag::Scattered => Part::Scattered,
            PartFlag::Glossy => Part::Glossy,
            PartFlag::Unscattered => Part::Unscattered,
        };
        look.view.skip = !self.no_skip;
        Ok(look)
    }
}
