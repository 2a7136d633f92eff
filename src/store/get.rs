//! Where values live under their names: memory, then disk; and how what is missing gets made.

use super::disk::Disk;
use super::key::Key;
use super::plan::{Plan, PlannedStep, Slot, Source, Value};
use super::run::{Cancel, Run};
use crate::problem::Problem;
use std::any::Any;
use std::collections::{HashMap, HashSet, VecDeque};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// Where a value that was asked for came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    Ran,
    Memory,
    Disk,
}

/// What would happen to a step if the plan's last value were asked for now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct State {
    pub origin: Origin,
    /// Whether anything that must run asks for it.
    pub needed: bool,
}

/// What happened to one step.
#[derive(Clone, Debug)]
pub struct Finished {
    pub name: &'static str,
    pub about: String,
    pub key: Key,
    pub origin: Origin,
    /// Its own time, without that of what it reads.
    pub time: Duration,
}

/// Sees steps run; for progress bars, timings and the last line of a command.
pub trait Watch: Sync {
    fn started(&self, _step: &PlannedStep) {}
    fn progress(&self, _step: &PlannedStep, _share: f64) {}
    fn finished(&self, _finished: &Finished) {}
    /// Something that does not stop the work.
    fn warn(&self, _problem: &Problem) {}
}

struct Nobody;
impl Watch for Nobody {}

/// Values on their way from one store to another.
#[derive(Clone, Default)]
pub struct Values(Vec<(Key, Value)>);

impl Values {
    /// Drops all whose names do not pass.
    pub fn retain(&mut self, keep: impl Fn(&Key) -> bool) {
        self.0.retain(|(key, _)| keep(key));
    }
}

/// Values by name. A value stays in memory as long as one of the last few plans names it: not by when it was touched,
/// since a value behind a hit is never touched, and is exactly what the next edit needs.
pub struct Store {
    values: HashMap<Key, Value>,
    disk: Option<Disk>,
    recent: VecDeque<HashSet<Key>>,
    keep_plans: usize,
    pub cancel: Cancel,
}

impl Store {
    pub fn in_memory() -> Store {
        Store { values: HashMap::new(), disk: None, recent: VecDeque::new(), keep_plans: 3, cancel: Cancel::default() }
    }

    pub fn on_disk(disk: Disk) -> Store {
        Store { disk: Some(disk), ..Store::in_memory() }
    }

    /// How many of the last plans keep their values in memory, at least 1.
    pub fn keep_plans(mut self, plans: usize) -> Store {
        self.keep_plans = plans.max(1);
        self
    }

    /// The value of a slot of a plan whose steps need no host.
    pub fn get<T: Send + Sync + 'static>(&mut self, plan: &Plan, slot: Slot<T>) -> Result<Arc<T>, Problem> {
        self.get_with(plan, slot, None, &Nobody)
    }

    /// The value of a slot; whatever is missing for it is made first, and nothing else.
    pub fn get_with<T: Send + Sync + 'static>(
        &mut self,
        plan: &Plan,
        slot: Slot<T>,
        host: Option<&(dyn Any + Send + Sync)>,
        watch: &dyn Watch,
    ) -> Result<Arc<T>, Problem> {
        self.remember(plan);
        self.make(plan, slot.index, host, watch)?;
        let value = self.values[&slot.key()].clone();
        Ok(value.downcast().expect("a slot's value has the slot's type"))
    }

    fn make(
        &mut self,
        plan: &Plan,
        index: u32,
        host: Option<&(dyn Any + Send + Sync)>,
        watch: &dyn Watch,
    ) -> Result<(), Problem> {
        // Inputs come before the steps that read them, so a stack of places to visit is enough: a place whose inputs are
        // not there yet waits under them.
        let mut stack = vec![index];
        while let Some(&index) = stack.last() {
            let step = &plan.steps()[index as usize];
            if self.find(step, watch) {
                stack.pop();
                continue;
            }
            let missing: Vec<u32> =
                step.inputs.iter().copied().filter(|&i| !self.find(&plan.steps()[i as usize], watch)).collect();
            if missing.is_empty() {
                self.run(plan, index, host, watch)?;
                stack.pop();
            } else {
                stack.extend(missing.iter().rev());
            }
        }
        Ok(())
    }

    /// Makes every bake of a plan that is not there yet, with whatever it reads; passes stay unmade, so no host is needed.
    pub fn bake(&mut self, plan: &Plan, watch: &dyn Watch) -> Result<(), Problem> {
        let bakes = (0..plan.steps().len() as u32).filter(|i| plan.steps()[*i as usize].is_bake());
        self.bake_each(plan, bakes, watch)
    }

    /// Makes the steps at these places of a plan, which need no host, with whatever they read.
    pub fn bake_each(
        &mut self,
        plan: &Plan,
        places: impl IntoIterator<Item = u32>,
        watch: &dyn Watch,
    ) -> Result<(), Problem> {
        self.remember(plan);
        places.into_iter().try_for_each(|place| self.make(plan, place, None, watch))
    }

    /// What asking for `slot` would make, or read from disk, and what needs no host for it: places in the plan, in order.
    /// Another store can make them on another thread, and this one [adopt](Store::adopt) them.
    pub fn missing_without_host<T>(&self, plan: &Plan, slot: Slot<T>) -> Vec<u32> {
        let missing = |(place, state): (usize, State)| {
            let elsewhere = state.needed && state.origin != Origin::Memory && !plan.steps()[place].needs_host();
            elsewhere.then_some(place as u32)
        };
        self.states(plan, slot).into_iter().enumerate().filter_map(missing).collect()
    }

    /// All values of a plan that are in memory.
    pub fn held(&self, plan: &Plan) -> Values {
        Values(plan.keys().filter_map(|key| Some((key, self.values.get(&key)?.clone()))).collect())
    }

    /// Takes over what another store holds of a plan. Nothing is copied.
    pub fn adopt(&mut self, plan: &Plan, values: Values) {
        self.remember(plan);
        self.values.extend(values.0);
        (0..plan.steps().len()).for_each(|index| self.leave_behind(plan, index));
    }

    /// Drops all that a step that is there went on from.
    fn leave_behind(&mut self, plan: &Plan, index: usize) {
        let mut step = &plan.steps()[index];
        if self.values.contains_key(&step.key) {
            while let Some(earlier) = step.continues {
                step = &plan.steps()[earlier as usize];
                self.values.remove(&step.key);
            }
        }
    }

    /// Whether a step's value is in memory by now; it may have come from disk.
    fn find(&mut self, step: &PlannedStep, watch: &dyn Watch) -> bool {
        if self.values.contains_key(&step.key) {
            return true;
        }
        let started = Instant::now();
        let (value, origin) = match &step.source {
            Source::Given(value) => (Some(value.clone()), Origin::Memory),
            Source::Pass(_) => (None, Origin::Ran),
            Source::Bake(_, codec) => (self.read_bake(step, codec.decode, watch), Origin::Disk),
        };
        let Some(value) = value else { return false };
        self.values.insert(step.key, value);
        if origin == Origin::Disk {
            watch.finished(&step.finished(origin, started.elapsed()));
        }
        true
    }

    fn read_bake(&self, step: &PlannedStep, decode: fn(&[u8]) -> Option<Value>, watch: &dyn Watch) -> Option<Value> {
        let disk = self.disk.as_ref()?;
        let content = disk.read(&step.key).unwrap_or_else(|problem| {
            watch.warn(&problem);
            None
        })?;
        decode(&content)
    }

    fn run(
        &mut self,
        plan: &Plan,
        index: u32,
        host: Option<&(dyn Any + Send + Sync)>,
        watch: &dyn Watch,
    ) -> Result<(), Problem> {
        let step = &plan.steps()[index as usize];
        let inputs: Vec<(u32, Value)> =
            step.inputs.iter().map(|&i| (i, self.values[&plan.steps()[i as usize].key].clone())).collect();
        let (function, codec) = match &step.source {
            Source::Given(_) => unreachable!("a given value is always found"),
            Source::Pass(function) => (function, None),
            Source::Bake(function, codec) => (function, Some(codec)),
        };
        watch.started(step);
        let started = Instant::now();
        let progress = |share: f64| watch.progress(step, share);
        let run = Run {
            name: step.name,
            inputs: &inputs,
            host,
            cancel: &self.cancel,
            progress: &progress,
            measured: OnceLock::new(),
        };
        run.tick(0.0)?;
        let value = function(&run)?;
        let time = run.measured.get().copied().unwrap_or_else(|| started.elapsed());
        if let (Some(codec), Some(disk)) = (codec, &self.disk)
            && let Err(problem) = disk.write(step.name, &step.key, &(codec.encode)(&value))
        {
            watch.warn(&problem);
        }
        self.values.insert(step.key, value);
        self.leave_behind(plan, index as usize);
        watch.finished(&step.finished(Origin::Ran, time));
        Ok(())
    }

    /// What asking for `slot` would do to each step of the plan, in the plan's order.
    pub fn states<T>(&self, plan: &Plan, slot: Slot<T>) -> Vec<State> {
        let state = |step| State { origin: self.origin(step), needed: false };
        let mut states: Vec<State> = plan.steps().iter().map(state).collect();
        states[slot.index as usize].needed = true;
        for i in (0..states.len()).rev() {
            if states[i].needed && states[i].origin == Origin::Ran {
                plan.steps()[i].inputs.iter().for_each(|&input| states[input as usize].needed = true);
            }
        }
        states
    }

    fn origin(&self, step: &PlannedStep) -> Origin {
        let on_disk = || step.is_bake() && self.disk.as_ref().is_some_and(|disk| disk.holds(&step.key));
        if step.is_given() || self.values.contains_key(&step.key) {
            Origin::Memory
        } else if on_disk() {
            Origin::Disk
        } else {
            Origin::Ran
        }
    }

    /// Whether a value is in memory or on disk.
    pub fn has<T>(&self, plan: &Plan, slot: Slot<T>) -> bool {
        self.origin(&plan.steps()[slot.index as usize]) != Origin::Ran
    }

    pub fn disk(&self) -> Option<&Disk> {
        self.disk.as_ref()
    }

    /// How many values are in memory.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    pub(super) fn value(&self, key: &Key) -> Option<&Value> {
        self.values.get(key)
    }

    /// Drops what no recent plan names.
    fn remember(&mut self, plan: &Plan) {
        let keys: HashSet<Key> = plan.keys().collect();
        if self.recent.back() == Some(&keys) {
            return;
        }
        self.recent.push_back(keys);
        while self.recent.len() > self.keep_plans {
            self.recent.pop_front();
        }
        let recent = &self.recent;
        self.values.retain(|key, _| recent.iter().any(|keys| keys.contains(key)));
    }
}

impl PlannedStep {
    fn finished(&self, origin: Origin, time: Duration) -> Finished {
        Finished { name: self.name, about: self.about.clone(), key: self.key, origin, time }
    }
}

#[cfg(test)]
mod tests;
