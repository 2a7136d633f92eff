//! Two threads beside the window's own: one reads the scene's files, one makes what needs no device. Both are told what
//! is wanted now, drop what is wanted no longer, and wake the window when there is news.

use super::Subject;
use crate::problem::{Cause, Problem, Problems};
use crate::store::{Cancel, Finished, Key, Plan, PlannedStep, Store, Values, Watch};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// How often progress is worth a new picture of it.
const TOLD: Duration = Duration::from_millis(80);

/// What the threads have to say.
pub enum News {
    /// The files were read, and this is what they hold.
    Read(Result<(Subject, Vec<Problem>), Problems>),
    /// What was asked for is there.
    Made(Arc<Plan>, Values, Vec<Finished>),
    /// These values cannot be made.
    Failed(Vec<Key>, Problem),
    /// A step went on a little.
    Progress,
}

pub type Tell = Arc<dyn Fn(News) + Send + Sync>;

/// Reads the files again whenever it is asked to; who asks often is answered once.
pub struct Reading(Sender<()>);

impl Reading {
    pub fn start(read: impl Fn() -> Result<(Subject, Vec<Problem>), Problems> + Send + 'static, tell: Tell) -> Reading {
        let (sender, inbox): (_, Receiver<()>) = mpsc::channel();
        std::thread::spawn(move || {
            while inbox.recv().is_ok() {
                while inbox.try_recv().is_ok() {}
                let read = unless_it_panics(&read).unwrap_or_else(|problem| Err(problem.into()));
                tell(News::Read(read));
            }
        });
        Reading(sender)
    }

    pub fn ask(&self) {
        self.0.send(()).ok(); // the thread ends with the window
    }
}

/// How far a step has come.
#[derive(Clone)]
pub struct Progress {
    pub about: String,
    pub share: f64,
}

/// Makes what needs no device.
pub struct Worker(Arc<Desk>);

#[derive(Default)]
struct Desk {
    papers: Mutex<Papers>,
    bell: Condvar,
}

#[derive(Default)]
struct Papers {
    next: Option<Job>,
    /// What was asked for last, until it is there.
    asked: Vec<Key>,
    /// The step that runs, and how to stop it.
    running: Option<(Key, Cancel)>,
    progress: Option<Progress>,
    closed: bool,
}

struct Job {
    plan: Arc<Plan>,
    places: Vec<u32>,
}

impl Worker {
    pub fn start(store: Store, tell: Tell) -> Worker {
        let desk = Arc::<Desk>::default();
        let own = desk.clone();
        std::thread::spawn(move || own.work(store, &tell));
        Worker(desk)
    }

    /// Asks for these steps of a plan, in place of all that was asked for before. A step that runs and is among them goes
    /// on; another one stops as soon as it can.
    pub fn ask(&self, plan: &Arc<Plan>, places: Vec<u32>) {
        let keys = keys(plan, &places);
        let mut papers = self.0.papers();
        if papers.asked == keys {
            return;
        }
        if let Some((running, cancel)) = &papers.running
            && !keys.contains(running)
        {
            cancel.cancel();
        }
        papers.asked = keys;
        papers.next = Some(Job { plan: plan.clone(), places });
        self.0.bell.notify_one();
    }

    /// Nothing is wanted any more.
    pub fn rest(&self) {
        let mut papers = self.0.papers();
        papers.next = None;
        papers.asked.clear();
        if let Some((_, cancel)) = &papers.running {
            cancel.cancel();
        }
    }

    /// What it is at.
    pub fn progress(&self) -> Option<Progress> {
        self.0.papers().progress.clone()
    }
}

impl Drop for Worker {
    /// Nobody waits for the thread: what a step has on disk is whole at any time.
    fn drop(&mut self) {
        self.rest();
        self.0.papers().closed = true;
        self.0.bell.notify_one();
    }
}

fn keys(plan: &Plan, places: &[u32]) -> Vec<Key> {
    places.iter().map(|place| plan.steps()[*place as usize].key).collect()
}

impl Desk {
    fn papers(&self) -> MutexGuard<'_, Papers> {
        self.papers.lock().expect("nobody panics while writing on the desk")
    }

    fn work(&self, mut store: Store, tell: &Tell) {
        while let Some(job) = self.next() {
            store.cancel = Cancel::default();
            let log = Log { desk: self, tell, cancel: store.cancel.clone(), said: Mutex::default() };
            let made = self.make(&mut store, &job, &log);
            let mut papers = self.papers();
            papers.running = None;
            papers.progress = None;
            let superseded = papers.next.is_some() || store.cancel.is_cancelled();
            if !superseded {
                papers.asked.clear();
            }
            drop(papers);
            match made {
                // What is superseded is not lost: the next job finds what was finished.
                _ if superseded => {}
                Ok(()) => {
                    let finished = log.said.into_inner().expect("nobody panics while noting a step").finished;
                    tell(News::Made(job.plan.clone(), store.held(&job.plan), finished));
                }
                Err(problem) => tell(News::Failed(keys(&job.plan, &job.places), problem)),
            }
        }
    }

    /// The next job, when there is one; None at the end.
    fn next(&self) -> Option<Job> {
        let mut papers = self.papers();
        loop {
            if papers.closed {
                return None;
            }
            match papers.next.take() {
                Some(job) => return Some(job),
                None => papers = self.bell.wait(papers).expect("nobody panics while writing on the desk"),
            }
        }
    }

    /// The steps of a job, until there is another job.
    fn make(&self, store: &mut Store, job: &Job, log: &Log) -> Result<(), Problem> {
        for place in &job.places {
            if self.papers().next.is_some() {
                break;
            }
            unless_it_panics(|| store.bake_each(&job.plan, [*place], log))??;
        }
        Ok(())
    }
}

/// A mistake in the program that the rest of it survives: the panic's own words are on stderr by now.
fn unless_it_panics<T>(work: impl FnOnce() -> T) -> Result<T, Problem> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| {
        let said = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
        let what = format!("a mistake in the program: {}", said.unwrap_or("something that must not happen did"));
        Problem::new(Cause::Unfinished, what).hint("another edit may avoid it; please report this with the scene")
    })
}

/// Notes what the steps say.
struct Log<'a> {
    desk: &'a Desk,
    tell: &'a Tell,
    cancel: Cancel,
    said: Mutex<Said>,
}

#[derive(Default)]
struct Said {
    finished: Vec<Finished>,
    told: Option<Instant>,
}

impl Watch for Log<'_> {
    fn started(&self, step: &PlannedStep) {
        self.desk.papers().running = Some((step.key, self.cancel.clone()));
    }

    fn progress(&self, step: &PlannedStep, share: f64) {
        let mut said = self.said.lock().expect("nobody panics while noting a step");
        if said.told.is_none_or(|told| told.elapsed() > TOLD) {
            said.told = Some(Instant::now());
            drop(said);
            self.desk.papers().progress = Some(Progress { about: step.about.clone(), share });
            (self.tell)(News::Progress);
        }
    }

    fn finished(&self, finished: &Finished) {
        self.said.lock().expect("nobody panics while noting a step").finished.push(finished.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::{Run, Slot, Step};
    use std::sync::mpsc::{Receiver, channel};

    /// A step that runs until somebody loses patience, if it is not quick.
    #[derive(serde::Serialize)]
    struct Work {
        name: u32,
        quick: bool,
    }
    impl Step for Work {
        type Output = u32;
        const NEEDS_HOST: bool = false;
        fn name(&self) -> &'static str {
            "test.work"
        }
        fn about(&self) -> String {
            format!("work {}", self.name)
        }
        fn run(&self, run: &Run) -> Result<u32, Problem> {
            if self.name == 13 {
                panic!("13 brings bad luck");
            }
            if self.quick {
                return Ok(self.name);
            }
            loop {
                run.tick(0.5)?;
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }

    fn plan(name: u32, quick: bool) -> (Arc<Plan>, Slot<u32>) {
        let mut plan = Plan::default();
        let slot = plan.add(Work { name, quick });
        (Arc::new(plan), slot)
    }

    fn worker() -> (Worker, Receiver<News>) {
        let (sender, news) = channel();
        let sender = Mutex::new(sender);
        let tell = move |news| drop(sender.lock().unwrap().send(news));
        (Worker::start(Store::in_memory(), Arc::new(tell)), news)
    }

    fn next(news: &Receiver<News>) -> News {
        loop {
            match news.recv_timeout(Duration::from_secs(60)).expect("there is news within a minute") {
                News::Progress => {}
                other => return other,
            }
        }
    }

    #[test]
    fn what_nobody_wants_any_more_stops_and_what_is_wanted_comes() {
        let (worker, news) = worker();
        worker.ask(&plan(1, false).0, vec![0]);
        assert!(matches!(news.recv_timeout(Duration::from_secs(60)), Ok(News::Progress)), "it runs");
        let (quick, slot) = plan(2, true);
        worker.ask(&quick, vec![0]);
        let News::Made(made, values, _) = next(&news) else { panic!("the quick one is made") };
        let mut store = Store::in_memory();
        store.adopt(&made, values);
        assert_eq!(*store.get(&made, slot).unwrap(), 2);
        assert!(store.missing_without_host(&quick, slot).is_empty());
    }

    #[test]
    fn asking_again_for_what_runs_does_not_stop_it_and_closing_does() {
        let (worker, news) = worker();
        let (slow, _) = plan(1, false);
        worker.ask(&slow, vec![0]);
        assert!(matches!(news.recv_timeout(Duration::from_secs(60)), Ok(News::Progress)));
        worker.ask(&plan(1, false).0, vec![0]);
        let running = || worker.0.papers().running.clone();
        assert!(running().is_some_and(|(_, cancel)| !cancel.is_cancelled()));
        let cancel = running().unwrap().1;
        drop(worker);
        assert!(cancel.is_cancelled());
    }

    #[test]
    fn a_step_that_panics_is_a_problem_and_the_next_one_is_made() {
        let (worker, news) = worker();
        worker.ask(&plan(13, true).0, vec![0]);
        let News::Failed(keys, problem) = next(&news) else { panic!("13 fails") };
        assert!(keys.len() == 1 && problem.what.contains("bad luck"), "{problem}");
        worker.ask(&plan(2, true).0, vec![0]);
        assert!(matches!(next(&news), News::Made(..)));
    }
}
