//! How long a technique takes: its bakes, made once, and a frame.
//!
//! A store that answers would time a look into a table. So a repetition makes again what a frame takes when the camera and
//! the lights have moved and time has gone on. What does not change from such a frame to the next stays: bakes, shapes at
//! rest, and what was uploaded of them.

use super::Contender;
use super::edits::Edit;
use crate::gpu::{Gpu, Images};
use crate::problem::Problem;
use crate::render::Look;
use crate::scene::{Camera, LightKind, Scene};
use crate::session::Session;
use crate::store::{Cancel, Finished, Key, Origin, Plan, PlannedStep, Slot, Store, Values, Watch};
use glam::{DQuat, DVec3};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Mutex;
use std::time::Duration;

/// The scene and the look a moment later.
pub fn later(scene: &Scene, look: &Look) -> (Scene, Look) {
    let (mut scene, mut look) = (scene.clone(), look.clone());
    let camera = aside(&look.view.camera);
    let step = camera.eye - look.view.camera.eye;
    look.view.camera = camera;
    look.view.time_s += 1.0 / 24.0;
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Directional { direction, .. } => *direction = DQuat::from_rotation_y(1e-3) * *direction,
            LightKind::Point { position, .. } => *position += step,
            LightKind::Rect { center, .. } => *center += step,
            LightKind::Environment { rotation_deg, .. } => *rotation_deg += 0.1,
        }
    }
    (scene, look)
}

/// The camera a small step away.
pub fn aside(camera: &Camera) -> Camera {
    let step = 1e-3 * (camera.target - camera.eye).length() * DVec3::new(0.48, 0.6, 0.64);
    Camera { eye: camera.eye + step, target: camera.target + step, ..*camera }
}

/// Notes what ran, and how much was allocated meanwhile.
struct Meter<'a> {
    watch: &'a dyn Watch,
    gpu: Option<&'a Gpu>,
    noted: Mutex<(Vec<Finished>, u64)>,
}

impl<'a> Meter<'a> {
    fn new(watch: &'a dyn Watch, gpu: Option<&'a Gpu>) -> Meter<'a> {
        Meter { watch, gpu, noted: Mutex::default() }
    }

    fn into_noted(self) -> (Vec<Finished>, u64) {
        self.noted.into_inner().expect("nobody panics while noting a step")
    }
}

impl Watch for Meter<'_> {
    fn started(&self, step: &PlannedStep) {
        self.watch.started(step);
    }
    fn progress(&self, step: &PlannedStep, share: f64) {
        self.watch.progress(step, share);
    }
    fn finished(&self, finished: &Finished) {
        self.watch.finished(finished);
        let allocated = self.gpu.and_then(Gpu::allocated).unwrap_or(0);
        let mut noted = self.noted.lock().expect("nobody panics while noting a step");
        noted.0.push(finished.clone());
        noted.1 = noted.1.max(allocated);
    }
    fn warn(&self, problem: &Problem) {
        self.watch.warn(problem);
    }
}

fn bakes(plan: &Plan) -> BTreeSet<Key> {
    plan.steps().iter().filter(|step| step.is_bake()).map(|step| step.key).collect()
}

/// How long each bake took that was made, whoever asked for it.
#[derive(Default)]
pub struct Bakes(BTreeMap<Key, Duration>);

impl Bakes {
    /// Makes the bakes of a plan, or finds them.
    pub fn made(&mut self, session: &mut Session, plan: &Plan, watch: &dyn Watch) -> Result<Values, Problem> {
        let meter = Meter::new(watch, None);
        session.store.bake(plan, &meter)?;
        self.note(meter);
        let own = bakes(plan);
        let mut values = session.store.held(plan);
        values.retain(|key| own.contains(key));
        Ok(values)
    }

    /// How long the bakes of a plan take, all together. Those that were found and not made are made once more, where
    /// nothing is kept; `made` are all of them.
    pub fn time(
        &mut self,
        plan: &Plan,
        made: &Values,
        cancel: &Cancel,
        watch: &dyn Watch,
    ) -> Result<Duration, Problem> {
        let own = bakes(plan);
        if own.iter().any(|key| !self.0.contains_key(key)) {
            let mut known = made.clone();
            known.retain(|key| self.0.contains_key(key));
            let mut cold = store_with(plan, known, cancel);
            let meter = Meter::new(watch, None);
            cold.bake(plan, &meter)?;
            self.note(meter);
        }
        Ok(own.iter().map(|key| self.0[key]).sum())
    }

    fn note(&mut self, meter: Meter<'_>) {
        let ran = meter.into_noted().0.into_iter().filter(|step| step.origin == Origin::Ran);
        self.0.extend(ran.map(|step| (step.key, step.time)));
    }
}

/// A store that holds these values and keeps nothing.
fn store_with(plan: &Plan, values: Values, cancel: &Cancel) -> Store {
    let mut store = Store::in_memory();
    store.cancel = cancel.clone();
    store.adopt(plan, values);
    store
}

/// A value of a plan whose bakes are made.
pub fn draw<T: Send + Sync + 'static>(
    gpu: &Gpu,
    (plan, slot): &(Plan, Slot<T>),
    made: &Values,
    cancel: &Cancel,
    watch: &dyn Watch,
) -> Result<std::sync::Arc<T>, Problem> {
    store_with(plan, made.clone(), cancel).get_with(plan, *slot, Some(gpu), watch)
}

/// A frame that can be drawn again and again.
pub struct Warm {
    /// What stays from frame to frame.
    stays: Values,
    /// All of the frame that is there when something is edited.
    held: Values,
    /// The most that a first frame took on the device, bytes, with what stays.
    pub peak_memory: Option<u64>,
}

impl Warm {
    /// Draws a first frame, for which shaders are compiled.
    pub fn up(
        gpu: &Gpu,
        contender: &Contender,
        made: &Values,
        cancel: &Cancel,
        watch: &dyn Watch,
    ) -> Result<Warm, Problem> {
        let (plan, slot): &(Plan, Slot<Images>) = &contender.frame;
        gpu.free()?;
        let before = gpu.allocated();
        let mut store = store_with(plan, made.clone(), cancel);
        let meter = Meter::new(watch, Some(gpu));
        store.get_with(plan, *slot, Some(gpu), &meter)?;
        let (_, most) = meter.into_noted();
        let kept = bakes(plan);
        let next: BTreeSet<Key> = contender.next.keys().collect();
        let held = store.held(plan);
        let mut stays = held.clone();
        stays.retain(|key| kept.contains(key) || next.contains(key));
        Ok(Warm { stays, held, peak_memory: before.map(|before| most.saturating_sub(before)) })
    }

    /// How long it takes until an edit shows, ms: the sum of the steps that run for it.
    pub fn edit(&self, gpu: &Gpu, edit: &Edit, cancel: &Cancel, watch: &dyn Watch) -> Result<f64, Problem> {
        let (plan, slot) = &edit.frame;
        let meter = Meter::new(watch, None);
        store_with(plan, self.held.clone(), cancel).get_with(plan, *slot, Some(gpu), &meter)?;
        Ok(meter.into_noted().0.iter().map(|step| 1e3 * step.time.as_secs_f64()).sum())
    }

    /// Lets go of what only edits need.
    pub fn settle(&mut self) {
        self.held = Values::default();
    }

    /// The passes of another frame with the time of each, ms, by name; together they are the frame.
    pub fn again(
        &self,
        gpu: &Gpu,
        contender: &Contender,
        cancel: &Cancel,
        watch: &dyn Watch,
    ) -> Result<BTreeMap<&'static str, f64>, Problem> {
        let (plan, slot) = &contender.frame;
        let meter = Meter::new(watch, None);
        store_with(plan, self.stays.clone(), cancel).get_with(plan, *slot, Some(gpu), &meter)?;
        let mut passes = BTreeMap::new();
        for step in meter.into_noted().0 {
            *passes.entry(step.name).or_default() += 1e3 * step.time.as_secs_f64();
        }
        Ok(passes)
    }
}
