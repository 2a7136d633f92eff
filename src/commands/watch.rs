//! `watch`: the picture is made again whenever the content of a file changes that it depends on.
//!
//! There is no other way of making it than at first: the files are read again, a plan is made, and the store is asked.
//! While a picture is made, another thread listens: what was overtaken by another edit is given up, and begun again with
//! what the files hold by then, so that the last save wins.

use super::look::LookFlags;
use super::progress::{Progress, seconds};
use super::render::{timings, write_picture};
use super::{Answer, blame, counted, print, when_interrupted};
use crate::image::{Format, Image};
use crate::problem::{Cause, Problem, Problems};
use crate::render::{self, Look};
use crate::scene::Scene;
use crate::session::{Options, Session};
use crate::store::{Follow, Origin, Plan, Slot};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Instant;

/// Make a picture again whenever a file changes that it depends on, until Ctrl-C
#[derive(clap::Args)]
pub struct Watch {
    /// The scene's file
    scene: PathBuf,
    /// Where to: .png (as a display shows it) or .exr (linear light)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    look: LookFlags,
    /// Print the time of every step
    #[arg(long)]
    timings: bool,
}

/// What the main thread, or the one that listens for it, is called for.
enum Call {
    /// Something may have changed.
    Look,
    /// The user has seen enough, and `interrupted` says so.
    Stop,
    /// There is nothing more to give up.
    Made,
}

struct Watching {
    words: Watch,
    json: bool,
    format: Format,
    session: Session,
    follow: Follow,
    caller: Sender<Call>,
    calls: Receiver<Call>,
    interrupted: Arc<AtomicBool>,
    /// What was changed since something was last said.
    changed: BTreeSet<PathBuf>,
    /// What was said of the scene last: it is not said again at every edit.
    warned: Vec<Problem>,
}

/// What there is to draw.
struct Wanted {
    scene: Scene,
    look: Look,
    plan: Plan,
    picture: Slot<Image>,
    warnings: Vec<Problem>,
}

/// How an attempt to make a picture ended.
enum Attempt {
    Said,
    /// Another edit came meanwhile, and nothing was said.
    Overtaken,
    Interrupted,
}

impl Watch {
    /// Ends well when it is interrupted while there is nothing to do.
    pub fn run(self, options: Options, json: bool) -> Result<Answer, Problems> {
        let format = Format::of(&self.output)?;
        let mut session = Session::new(options);
        session.timed = self.timings;
        // What no edit mends is told at once.
        session.gpu()?;
        let (caller, calls) = channel();
        let wake = caller.clone();
        let follow = Follow::new(move || _ = wake.send(Call::Look)); // unless this is just ending
        let interrupted = Arc::new(AtomicBool::new(false));
        let (cancel, stop, told) = (session.store.cancel.clone(), caller.clone(), interrupted.clone());
        when_interrupted(move || {
            told.store(true, Ordering::SeqCst);
            cancel.cancel();
            stop.send(Call::Stop).ok(); // unless this is just ending
        });
        let (changed, warned) = Default::default();
        let words = self;
        Watching { words, json, format, session, follow, caller, calls, interrupted, changed, warned }.run()
    }
}

impl Watching {
    fn run(mut self) -> Result<Answer, Problems> {
        let mut is_first = true;
        loop {
            match self.attempt(is_first)? {
                Attempt::Overtaken => continue,
                Attempt::Interrupted => {
                    let problem = Problem::new(Cause::Unfinished, "the picture was interrupted");
                    return Err(problem.hint("what was finished is kept, and the last picture stands").into());
                }
                Attempt::Said => {}
            }
            if std::mem::take(&mut is_first) {
                self.talk(&format!("following {}; Ctrl-C ends it", counted(self.session.files.asked().len(), "file")));
            }
            loop {
                // Who listened while the picture was made may have heard it already.
                if self.interrupted.load(Ordering::SeqCst) {
                    return Ok(Answer::default());
                }
                self.changed.extend(self.follow.changed());
                if let Some(warning) = self.follow.warning() {
                    self.talk(&warning.to_string());
                }
                if !self.changed.is_empty() {
                    break;
                }
                self.calls.recv().expect("this holds a caller itself");
            }
        }
    }

    /// Reads the files, makes the picture and says so, or says what is wrong.
    fn attempt(&mut self, is_first: bool) -> Result<Attempt, Problems> {
        let started = Instant::now();
        let wanted = self.wanted();
        // Shaders too are read by now, as far as the plan came.
        self.follow.depend_on(&self.session.files);
        let problems = match wanted {
            Ok(wanted) => {
                let progress = Progress::new();
                let (image, overtaken) = self.make(&wanted, &progress);
                match image {
                    Err(_) if self.interrupted.load(Ordering::SeqCst) => return Ok(Attempt::Interrupted),
                    Err(_) if overtaken => return Ok(self.overtaken()),
                    Err(problem) => problem.into(),
                    Ok(image) => {
                        match write_picture(&self.words.output, self.format, &wanted.scene, &wanted.look, &image) {
                            Ok(()) => return self.made(wanted, &progress, started),
                            Err(problem) => problem.into(),
                        }
                    }
                }
            }
            Err(problems) => problems,
        };
        // A file that was read while it was being written is no mistake by now.
        if !self.follow.changed().is_empty() {
            return Ok(self.overtaken());
        }
        let problems = blame(problems);
        // Words stay wrong whatever the files hold, but for those that name something in them.
        if is_first && problems.cause() == Cause::Words {
            return Err(problems);
        }
        self.broken(&problems)
    }

    fn overtaken(&mut self) -> Attempt {
        self.changed.extend(self.follow.changed());
        Attempt::Overtaken
    }

    fn wanted(&self) -> Result<Wanted, Problems> {
        let (scene, warnings) = self.session.scene(&self.words.scene)?;
        let look = self.words.look.look(&scene)?;
        let (plan, picture) = render::plan(&scene, &look, &self.session.shaders)?;
        Ok(Wanted { scene, look, plan, picture, warnings })
    }

    /// The picture, and whether another edit came while it was made.
    fn make(&mut self, wanted: &Wanted, progress: &Progress) -> (Result<Arc<Image>, Problem>, bool) {
        let Watching { session, follow, calls, caller, interrupted, .. } = self;
        let cancel = session.store.cancel.clone();
        cancel.reset();
        if interrupted.load(Ordering::SeqCst) {
            cancel.cancel(); // the user was faster than the line above
        }
        std::thread::scope(|scope| {
            let listening = scope.spawn(move || {
                let mut overtaken = false;
                while !matches!(calls.recv(), Ok(Call::Made) | Err(_)) {
                    if !follow.changed().is_empty() {
                        cancel.cancel();
                        overtaken = true;
                    }
                }
                overtaken
            });
            let image = {
                let _made = Made(caller);
                session.picture(&wanted.scene, &wanted.look, &wanted.plan, wanted.picture, progress)
            };
            (image, listening.join().expect("listening cannot fail"))
        })
    }

    /// Says that there is a picture.
    fn made(&mut self, wanted: Wanted, progress: &Progress, started: Instant) -> Result<Attempt, Problems> {
        let (finished, told) = progress.take();
        let warnings: Vec<Problem> = wanted.warnings.into_iter().chain(told).collect();
        let time = started.elapsed();
        let (width, height) = wanted.look.view.size;
        let file = self.words.output.display().to_string();
        let steps = wanted.plan.steps().iter().filter(|step| !step.is_given()).count();
        let of = |origin: Origin| finished.iter().filter(|step| step.origin == origin).count();
        let (ran, from_disk) = (of(Origin::Ran), of(Origin::Disk));
        for warning in warnings.iter().filter(|warning| !self.warned.contains(warning)) {
            self.talk(&warning.to_string());
        }
        let list = self.list();
        let because = if list.is_empty() { String::new() } else { format!("{} changed: ", list.join(", ")) };
        self.talk(&format!(
            "{because}{file}  {width} x {height}  {}  {ran} of {} ran, {} from disk",
            seconds(time),
            counted(steps, "step"),
            counted(from_disk, "bake"),
        ));
        if self.words.timings {
            self.talk(timings(&finished).trim_end());
        }
        self.tell(json!({
            "event": "picture",
            "changed": list,
            "path": file,
            "width": width,
            "height": height,
            "seconds": time.as_secs_f64(),
            "steps": steps,
            "ran": ran,
            "from_disk": from_disk,
            "warnings": warnings.iter().map(Problem::json).collect::<Vec<_>>(),
        }))?;
        self.warned = warnings;
        Ok(Attempt::Said)
    }

    /// Says that there is none.
    fn broken(&mut self, problems: &Problems) -> Result<Attempt, Problems> {
        // The problems themselves are said to people in any case, as by every command.
        writeln!(io::stderr(), "{problems}").ok(); // there is no better place to complain
        if self.words.output.exists() {
            self.talk(&format!("{} stays as it was until this is mended", self.words.output.display()));
        }
        let all: Vec<_> = problems.0.iter().map(Problem::json).collect();
        self.tell(json!({ "event": "problem", "changed": self.list(), "problems": all }))?;
        Ok(Attempt::Said)
    }

    fn list(&self) -> Vec<String> {
        self.changed.iter().map(|path| path.display().to_string()).collect()
    }

    /// For people.
    fn talk(&self, line: &str) {
        if !self.json {
            writeln!(io::stderr(), "{line}").ok(); // there is no better place to complain
        }
    }

    /// For programs: one line. What was changed has been said by then.
    fn tell(&mut self, facts: Value) -> Result<(), Problem> {
        self.changed.clear();
        if self.json { print(&format!("{facts}\n")) } else { Ok(()) }
    }
}

/// Says that there is nothing more to give up, even when the making of a picture ends in a mistake of the program.
struct Made<'a>(&'a Sender<Call>);

impl Drop for Made<'_> {
    fn drop(&mut self) {
        self.0.send(Call::Made).ok(); // who listens holds the other end until then
    }
}
