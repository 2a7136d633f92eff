//! What is looked at, and how its picture comes to be: planned for every frame, made only when it is new.
//!
//! Knows no window. What needs no device is made by the [`Worker`]; until it is there the last subject that was drawn
//! stays in view, and is drawn from wherever the camera is.

use super::Subject;
use super::worker::{News, Tell, Worker};
use crate::gpu::{Gpu, Images, Shaders};
use crate::image::{Display, Image};
use crate::problem::{Problem, Problems};
use crate::reference::TRACE;
use crate::reference::film::Level;
use crate::render::{self, Exposure, Look, Shown, Traced};
use crate::scene::Camera;
use crate::session::Options;
use crate::store::{Disk, Finished, Key, Origin, Plan, Skipped, Slot, Store, Watch};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// How many of the last plans the worker keeps in memory, so that undoing an edit is instant.
const UNDO: usize = 12;

pub struct Stage {
    pub shaders: Shaders,
    options: Options,
    store: Store,
    worker: Worker,
    /// What the files hold, as far as they were ever sound.
    wanted: Option<Subject>,
    /// What was drawn last.
    drawn: Option<Subject>,
    /// What is wrong with the files as they are.
    files: Problems,
    /// What is wrong with making the picture of what is wanted.
    making: Option<Problem>,
    /// What the worker could not make.
    failed: Option<(Vec<Key>, Problem)>,
    /// The first paths that were asked for while things moved.
    on_its_way: Option<(Subject, Viewing)>,
}

/// Where from, how large and how bright.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewing {
    pub camera: Camera,
    pub size: (u32, u32),
    pub display: Display,
    /// Whether it will be another one soon.
    pub moving: bool,
}

/// A picture, and how it came to be.
pub struct Drawn {
    pub picture: Arc<Images>,
    pub key: Key,
    /// Whether it shows what is wanted, and not what was wanted before.
    pub current: bool,
    pub steps: Steps,
    pub finished: Vec<Finished>,
    pub skipped: Vec<Skipped>,
    pub time: Duration,
    /// How far it is, if it is traced.
    pub level: Option<Level>,
    /// Whether a better one is on its way.
    pub refines: bool,
}

impl Drawn {
    /// What such a picture costs: of a traced one, a path for each pixel. None: nobody knows, since it was there.
    pub fn cost(&self, made: &[Finished]) -> Option<Duration> {
        let ran = |step: &&Finished| step.origin == Origin::Ran;
        match self.level {
            None => self.finished.iter().find(ran).map(|_| self.time),
            Some(Level { samples: 1, .. }) => {
                made.iter().filter(ran).find(|step| step.name == TRACE).map(|step| step.time)
            }
            Some(_) => None,
        }
    }
}

/// How many steps of a plan were made for a picture, were there, and were not even looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steps {
    pub ran: usize,
    pub reused: usize,
    pub unneeded: usize,
}

/// A picture, and the steps that the worker can make a better one with; None: it waits for the worker.
type Tried = Option<(Drawn, Option<(Plan, Vec<u32>)>)>;

impl Stage {
    pub fn new(options: Options, shaders: Shaders, tell: Tell) -> Stage {
        let worker = Worker::start(store(&options).keep_plans(UNDO), tell);
        Stage {
            shaders,
            store: store(&options),
            options,
            worker,
            wanted: None,
            drawn: None,
            files: Problems::default(),
            making: None,
            failed: None,
            on_its_way: None,
        }
    }

    pub fn subject(&self) -> Option<&Subject> {
        self.wanted.as_ref()
    }

    /// From now on this is to be seen.
    pub fn want(&mut self, subject: Subject) {
        self.wanted = Some(subject);
    }

    /// What reading the files brought. Shaders are looked at anew with them.
    pub fn read(&mut self, problems: Problems) {
        self.shaders.look_again();
        self.files = problems;
    }

    /// All that is wrong at the moment.
    pub fn problems(&self) -> Problems {
        Problems(self.files.0.iter().chain(&self.making).cloned().collect())
    }

    /// What the worker is at.
    pub fn progress(&self) -> Option<super::worker::Progress> {
        self.worker.progress()
    }

    /// Takes over what the worker has to say.
    pub fn hear(&mut self, news: News) -> Vec<Finished> {
        match news {
            News::Made(plan, values, finished) => {
                self.failed = None;
                self.store.adopt(&plan, values);
                return finished;
            }
            News::Failed(keys, problem) => self.failed = Some((keys, problem)),
            News::Read(_) | News::Progress => {}
        }
        Vec::new()
    }

    /// The device is another one: whatever lived on the old one is forgotten. What the worker made it still has.
    pub fn forget_device(&mut self) {
        self.store = store(&self.options);
    }

    /// The newest picture that can be had without waiting for the worker. None: there is none, and the last one stands.
    pub fn draw(&mut self, gpu: &Gpu, viewing: &Viewing) -> Option<Drawn> {
        let wanted = self.wanted.clone()?;
        self.making = None;
        // While things move, paths that are on their way are finished first, or none ever would be.
        let on_its_way = self.on_its_way.take().filter(|(subject, _)| viewing.moving && subject.same(&wanted));
        let from = on_its_way.map_or(*viewing, |(_, earlier)| earlier);
        match self.try_draw(&wanted, gpu, &from, true) {
            Ok(Some((mut drawn, better))) => {
                drawn.current = from == *viewing;
                match better.filter(|_| drawn.current).map(|(plan, places)| self.ask(plan, places)) {
                    Some(Ok(())) => drawn.refines = true,
                    Some(Err(problem)) => self.making = Some(problem),
                    None => self.worker.rest(),
                }
                self.drawn = Some(wanted);
                return Some(drawn);
            }
            Ok(None) => {}
            Err(problem) => self.making = Some(problem),
        }
        // A shader that is wrong is wrong for every subject; its problem is told once.
        let last = self.drawn.clone().filter(|drawn| !drawn.same(&wanted))?;
        match self.try_draw(&last, gpu, viewing, false) {
            Ok(Some((drawn, _))) => Some(drawn),
            _ => None,
        }
    }

    fn try_draw(&mut self, subject: &Subject, gpu: &Gpu, viewing: &Viewing, is_wanted: bool) -> Result<Tried, Problem> {
        let started = Instant::now();
        let Shown { plan, picture, traced } = self.plan(subject, gpu, viewing)?;
        // A shader that is wrong was replaced by its last good self.
        self.making = self.making.take().or(self.shaders.trouble());
        let missing = match &traced {
            Some(traced) => self.missing(&plan, traced.now),
            None => self.store.missing_without_host(&plan, picture),
        };
        if !missing.is_empty() {
            if is_wanted {
                self.ask(plan, missing)?;
                self.on_its_way = (traced.is_some() && viewing.moving).then(|| (subject.clone(), *viewing));
            }
            return Ok(None);
        }
        let steps = self.steps(&plan, picture);
        let log = Log::default();
        let images = self.store.get_with(&plan, picture, Some(gpu), &log)?;
        // Only now is the time that it took known, and whether the device is still there.
        gpu.wait()?;
        gpu.check("the picture")?;
        let time = started.elapsed();
        let mut drawn = Drawn {
            picture: images,
            key: picture.key(),
            current: false,
            steps,
            finished: log.0.into_inner().expect("nobody panics while noting a step"),
            skipped: plan.skipped().to_vec(),
            time,
            level: None,
            refines: false,
        };
        let Some(Traced { now, next, max_error }) = traced else { return Ok(Some((drawn, None))) };
        let level = *self.store.get(&plan, now.level)?;
        drawn.level = Some(level);
        let better = next.filter(|_| !level.reaches(max_error)).map(|next| self.missing(&plan, next));
        Ok(Some((drawn, better.map(|places| (plan, places)))))
    }

    /// What is traced is shown with as many paths as there are by now.
    fn plan(&self, subject: &Subject, gpu: &Gpu, viewing: &Viewing) -> Result<Shown, Problem> {
        let look = look(subject, viewing, gpu);
        render::plan_shown(&subject.scene, &look, viewing.display, &self.shaders, |plan, films| {
            films.iter().rposition(|film| self.store.has(plan, *film)).unwrap_or(0)
        })
    }

    /// What is the worker's to make of a traced picture: places in the plan.
    fn missing(&self, plan: &Plan, traced: Exposure) -> Vec<u32> {
        let mut places = self.store.missing_without_host(plan, traced.image);
        places.extend(self.store.missing_without_host(plan, traced.level));
        places.sort_unstable();
        places.dedup();
        places
    }

    /// Asks the worker for steps, if it did not fail to make them.
    fn ask(&self, plan: Plan, places: Vec<u32>) -> Result<(), Problem> {
        let keys: Vec<Key> = places.iter().map(|place| plan.steps()[*place as usize].key).collect();
        match &self.failed {
            Some((failed, problem)) if *failed == keys => Err(problem.clone()),
            _ => {
                self.worker.ask(&Arc::new(plan), places);
                Ok(())
            }
        }
    }

    fn steps(&self, plan: &Plan, slot: Slot<Images>) -> Steps {
        let mut steps = Steps::default();
        for state in self.store.states(plan, slot) {
            match (state.origin, state.needed) {
                (Origin::Ran, true) => steps.ran += 1,
                (Origin::Ran, false) => steps.unneeded += 1,
                _ => steps.reused += 1,
            }
        }
        steps
    }

    /// The linear picture of what was drawn last, for a file. None: there is none yet.
    pub fn image(&mut self, gpu: &Gpu, viewing: &Viewing) -> Result<Option<(Arc<Image>, Subject)>, Problem> {
        let Some(subject) = self.drawn.clone() else { return Ok(None) };
        let Shown { plan, traced, .. } = self.plan(&subject, gpu, viewing)?;
        let (plan, slot) = match traced {
            Some(traced) if self.missing(&plan, traced.now).is_empty() => (plan, traced.now.image),
            Some(_) => return Ok(None),
            None => render::plan(&subject.scene, &look(&subject, viewing, gpu), &self.shaders)?,
        };
        Ok(Some((self.store.get_with(&plan, slot, Some(gpu), &Log::default())?, subject)))
    }

    /// The object that is seen with this camera in the middle of its picture: its place in the scene.
    pub fn seen(&mut self, gpu: &Gpu, viewing: &Viewing) -> Result<Option<usize>, Problem> {
        let Some(subject) = self.drawn.clone() else { return Ok(None) };
        let mut look = look(&subject, viewing, gpu);
        look.view.antialias = 1;
        let (plan, slot) = render::plan_seen(&subject.scene, &look, &self.shaders)?;
        Ok(*self.store.get_with(&plan, slot, Some(gpu), &Log::default())?)
    }

    /// Asks for every shader of the picture, so that whoever follows the files knows them even when nothing is drawn.
    pub fn name_files(&self) {
        if let Some(subject) = self.wanted.as_ref().or(self.drawn.as_ref()) {
            // A problem shows when it is drawn.
            render::plan_shown(&subject.scene, &subject.look, Display::default(), &self.shaders, |_, _| 0).ok();
        }
    }
}

fn store(options: &Options) -> Store {
    match options.no_cache {
        true => Store::in_memory(),
        false => Store::on_disk(Disk::new(options.cache_folder())),
    }
}

/// The subject's look from here, as large as the device can draw it.
fn look(subject: &Subject, viewing: &Viewing, gpu: &Gpu) -> Look {
    let mut look = subject.look.clone();
    let largest = gpu.device.limits().max_texture_dimension_2d / look.view.antialias;
    look.view.camera = viewing.camera;
    look.view.size = (viewing.size.0.clamp(1, largest), viewing.size.1.clamp(1, largest));
    look
}

#[derive(Default)]
struct Log(Mutex<Vec<Finished>>);

impl Watch for Log {
    fn finished(&self, finished: &Finished) {
        self.0.lock().expect("nobody panics while noting a step").push(finished.clone());
    }
}
