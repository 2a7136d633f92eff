//! The commands: what the words mean, one file each. [`answer`] makes words into what is to be printed.

mod bake;
mod bench;
mod cache;
mod check;
mod compare;
mod doctor;
mod explain;
mod help;
mod layers;
mod look;
mod media;
mod new;
mod preview;
mod progress;
mod reference;
mod render;
mod techniques;
mod watch;

use crate::problem::{Cause, Problem, Problems, counted};
use crate::session::{Options, Session};
use clap::{Parser, Subcommand};
use serde_json::{Value, json};
use std::ffi::OsString;
use std::io::{self, ErrorKind, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

#[derive(Parser)]
#[command(name = "diaphane", bin_name = "diaphane", version, about = help::ABOUT, long_about = None)]
#[command(help_template = help::TEMPLATE, before_help = help::FIRST_SESSION, after_help = help::EXIT, max_term_width = 100)]
struct Words {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    global: Global,
}

#[derive(clap::Args, Clone, Debug)]
#[command(next_help_heading = "Options of every command")]
struct Global {
    /// Print the same facts as JSON, for programs
    #[arg(long, global = true)]
    json: bool,
    /// Keep bakes in this folder, else in the one that DIAPHANE_CACHE names, else where this system keeps caches
    #[arg(long, global = true, value_name = "DIR")]
    cache_dir: Option<PathBuf>,
    /// Keep no bakes, and use none that were kept
    #[arg(long, global = true)]
    no_cache: bool,
    /// Draw with the adapter whose name contains this; `diaphane doctor` lists them
    #[arg(long, global = true, value_name = "NAME")]
    adapter: Option<String>,
    /// Put RON in place of what the scene says: objects.bunny.transform.scale=2
    #[arg(long, global = true, value_name = "PATH=RON")]
    set: Vec<String>,
}

#[derive(Subcommand)]
enum Command {
    New(new::New),
    Render(render::Render),
    Watch(watch::Watch),
    Check(check::Check),
    Explain(explain::Explain),
    Reference(Box<reference::Reference>),
    Techniques(techniques::Techniques),
    Preview(preview::Preview),
    Bake(bake::Bake),
    Compare(compare::Compare),
    Bench(bench::Bench),
    Layers(layers::Layers),
    #[command(subcommand)]
    Media(media::Media),
    #[command(subcommand)]
    Cache(cache::Cache),
    Doctor(doctor::Doctor),
}

/// What the program says, and with which status it ends.
pub struct Said {
    /// For stdout: text or JSON.
    pub facts: String,
    /// For stderr: warnings and errors.
    pub talk: String,
    pub status: u8,
}

impl Said {
    fn facts(facts: String) -> Said {
        Said { facts, talk: String::new(), status: 0 }
    }

    /// Nothing, since what there is to say was said while it happened.
    pub fn unfinished() -> Said {
        Said { facts: String::new(), talk: String::new(), status: Cause::Unfinished.exit_status() }
    }

    fn wrong(problems: &Problems, json: bool) -> Said {
        let all: Vec<_> = problems.0.iter().map(Problem::json).collect();
        let facts = if json { pretty(&json!({ "problems": all })) } else { String::new() };
        Said { facts, talk: problems.to_string(), status: problems.cause().exit_status() }
    }
}

fn pretty(json: &Value) -> String {
    format!("{json:#}\n")
}

/// What a command has to say: for people and for programs.
#[derive(Debug, Default)]
struct Answer {
    text: String,
    json: Value,
    warnings: Vec<Problem>,
    /// What was found to be wrong, beside the facts that show it. They decide the status.
    failures: Vec<Problem>,
}

impl Answer {
    fn new(text: impl Into<String>, json: Value) -> Answer {
        Answer { text: text.into(), json, warnings: Vec::new(), failures: Vec::new() }
    }

    fn warn(mut self, warnings: impl IntoIterator<Item = Problem>) -> Answer {
        self.warnings.extend(warnings);
        self
    }

    /// The warnings and failures among the facts too, for programs that do not read stderr.
    fn with_warnings(mut self) -> Answer {
        if let Value::Object(facts) = &mut self.json {
            facts.insert("warnings".into(), self.warnings.iter().map(Problem::json).collect());
            if !self.failures.is_empty() {
                facts.insert("problems".into(), self.failures.iter().map(Problem::json).collect());
            }
        }
        self
    }
}

/// Does what the words say. The first is the program's own name.
pub fn answer(words: impl IntoIterator<Item = OsString>) -> Said {
    let words: Vec<OsString> = words.into_iter().collect();
    let words = match Words::try_parse_from(&words) {
        Ok(words) => words,
        Err(error) => return help::complaint(&error, help::wants_json(&words)),
    };
    let json = words.global.json;
    match words.run() {
        Ok(answer) => {
            // Null: all there was to say was said as it happened.
            let facts = if json && !answer.json.is_null() { pretty(&answer.json) } else { answer.text };
            let failures = Problems(answer.failures);
            let status = if failures.0.is_empty() { 0 } else { failures.cause().exit_status() };
            Said { facts, talk: Problems([answer.warnings, failures.0].concat()).to_string(), status }
        }
        Err(problems) => Said::wrong(&blame(problems), json),
    }
}

/// Words on stdout. Whoever stops reading has read enough; a full disk is a failure.
pub fn print(text: &str) -> Result<(), Problem> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            let problem = Problem::new(Cause::Unfinished, format!("stdout cannot be written: {error}"))
                .hint("free some space, or let the output go elsewhere");
            writeln!(io::stderr(), "{problem}").ok(); // there is nowhere left to say that this failed too
            Err(problem)
        }
        _ => Ok(()),
    }
}

/// What is said when the program itself is wrong.
pub fn mistake(panic: &std::panic::PanicHookInfo) -> Problem {
    let what = panic.payload_as_str().unwrap_or("something that must not happen did");
    let place = panic.location().map(|at| format!(" ({}:{})", at.file(), at.line())).unwrap_or_default();
    Problem::new(Cause::Unfinished, format!("a mistake in the program: {what}{place}"))
        .hint("your files are as they were, and bakes that were finished are kept; please report this with the command")
}

/// What stands in a flag is wrong words, not a wrong file.
fn blame(Problems(mut problems): Problems) -> Problems {
    for problem in &mut problems {
        if problem
            .at
            .as_ref()
            .is_some_and(|at| ["--set", "--technique"].iter().any(|flag| at.file.as_os_str() == *flag))
        {
            problem.cause = Cause::Words;
        }
    }
    Problems(problems)
}

impl Words {
    fn run(self) -> Result<Answer, Problems> {
        let options = self.global.options()?;
        // What a command prints as it goes: with `--json`, nothing but the whole.
        let line = |text: &str| if self.global.json { Ok(()) } else { print(text) };
        let answer = match self.command {
            None => help::all(),
            Some(Command::New(command)) => command.run()?,
            Some(Command::Check(command)) => command.run(options)?,
            Some(Command::Explain(command)) => return command.run(options),
            Some(Command::Render(command)) => command.run(options, &line)?,
            Some(Command::Watch(command)) => command.run(options, self.global.json)?,
            Some(Command::Preview(command)) => return Ok(command.run(options, self.global.json)?),
            Some(Command::Bake(command)) => command.run(options)?,
            Some(Command::Reference(command)) => command.run(options)?,
            Some(Command::Compare(command)) => command.run(options)?,
            Some(Command::Bench(command)) => command.run(options)?,
            Some(Command::Layers(command)) => command.run()?,
            Some(Command::Media(command)) => command.run(options)?,
            Some(Command::Techniques(command)) => command.run()?,
            Some(Command::Cache(command)) => command.run(options)?,
            Some(Command::Doctor(command)) => command.run(options)?,
        };
        Ok(answer.with_warnings())
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
            cache_dir: self.cache_dir.clone().or_else(|| {
                let named = std::env::var_os("DIAPHANE_CACHE").filter(|folder| !folder.is_empty());
                named.map(PathBuf::from)
            }),
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
    when_interrupted(move || cancel.cancel());
    session
}

/// Has `stop` called when the user interrupts. Who asks twice does not want to wait for a step that looks up rarely.
fn when_interrupted(stop: impl Fn() + Send + 'static) {
    let asked = AtomicBool::new(false);
    let interrupted = move || {
        if asked.swap(true, Ordering::Relaxed) {
            std::process::exit(Cause::Unfinished.exit_status().into());
        }
        stop();
    };
    // A second handler cannot be set; the first serves.
    ctrlc::set_handler(interrupted).ok();
}
