//! The benchmark: time against error. Scenes × techniques × settings become rows of bake, frame, memory and errors.
//!
//! | module | what |
//! |---|---|
//! | [`cases`] | what is measured: scenes, and the techniques with their settings that contend on each |
//! | [`timing`] | bakes, made once; frames, drawn again and again |
//! | [`edits`] | what an artist may change, and how long it takes until it shows |
//! | [`errors`] | the truths, and how far from them a picture is |
//! | [`samples`] | every value, one a row: `samples.csv` |
//! | [`machine`] | on what it was measured: `machine.json` |
//! | [`record`] | the folder of both, so that what was interrupted goes on |
//! | [`statistics`] | medians, quartiles, the Pareto front |
//! | [`summary`] | one line per contender, and sentences made of the numbers |
//! | [`plot`], [`page`] | SVG and HTML |
//! | [`checks`] | what became slower or wronger since an earlier run |
//!
//! Truths are traced first, then bakes are made; frames are drawn last, when nothing else is at work, in an order that is
//! drawn by lot, so that a machine that gets warm or busy is no contender's fault.

pub mod cases;
pub mod checks;
pub mod edits;
pub mod errors;
pub mod machine;
pub mod page;
pub mod plot;
pub mod record;
pub mod samples;
pub mod statistics;
pub mod summary;
pub mod timing;

pub use cases::{Case, Contender, Wishes};
pub use machine::Machine;
pub use record::Record;
pub use samples::{Sample, Samples, Subject};

use crate::image::Image;
use crate::metric::{Unit, heat_map};
use crate::problem::Problem;
use crate::reference;
use crate::reference::film::Film;
use crate::reference::random::Random;
use crate::session::{Goal, Session};
use crate::store::{Key, Plan, Values, Watch, fingerprint};
use errors::{PART, Traced};
use std::sync::Arc;
use timing::{Bakes, Warm, draw};

/// Draws the order of frames. Any number serves; always the same one makes runs comparable.
pub const ORDER_SEED: u64 = 1;

/// How often an edit is made at most: some bake for seconds.
const EDIT_REPETITIONS: u32 = 3;

/// The code that decides what is measured and how. A row that other code made is no longer true.
const CODE: [&str; 13] = [
    "src/bench/edits.rs",
    "src/bench/timing.rs",
    "src/bench/errors.rs",
    "src/metric/",
    "src/optics/",
    "src/geometry/",
    "src/store/",
    "src/scene/",
    "src/reference/",
    "src/gpu/",
    "src/frame/",
    "src/techniques/",
    "src/render.rs",
];

/// What there is to be seen of a contender.
pub struct Shown {
    pub subject: Subject,
    /// The part that is judged, linear.
    pub picture: Arc<Image>,
    /// The relative error in every pixel with its scale, one for each truth.
    pub heat: Vec<Image>,
}

/// What became of a case, beside the rows.
pub struct Measured {
    pub truths: Vec<Traced>,
    /// In the order of the contenders.
    pub shown: Vec<Shown>,
    /// How many rows are new.
    pub new_rows: usize,
    pub warnings: Vec<Problem>,
}

/// Measures what the record does not hold yet. `tell` is told what is being done.
pub fn measure(
    session: &mut Session,
    case: &Case,
    record: &mut Record,
    watch: &dyn Watch,
    tell: &dyn Fn(&str),
) -> Result<Measured, Problem> {
    session.timed = true;
    session.gpu()?;
    let cancel = session.store.cancel.clone();
    let mut warnings = Vec::new();
    let truths = trace(session, case, watch, tell, &mut warnings)?;
    for contender in &case.contenders {
        record.begin(&contender.subject, key(case, contender))?;
    }
    let rows_kept = record.samples.0.len();

    let mut bakes = Bakes::default();
    let mut shown = Vec::new();
    let mut ready: Vec<(&Contender, Values)> = Vec::new();
    for contender in &case.contenders {
        let subject = &contender.subject;
        tell(&format!("{}: {}", case.name, subject.words()));
        let made = bakes.made(session, &contender.frame.0, watch)?;
        if record.samples.value(subject, "bake").is_none() {
            let time = bakes.time(&contender.frame.0, &made, &cancel, watch)?;
            record.add([sample(subject, "bake", "ms", 1, 1e3 * time.as_secs_f64())])?;
        }
        let picture = draw(session.gpu()?, &contender.picture, &made, &cancel, watch)?;
        crate::session::whole(&picture)?;
        let mut heat = Vec::new();
        for traced in &truths {
            if record.samples.value(subject, &format!("relmse@{}", traced.truth.word())).is_none() {
                record.add(traced.errors(subject, &picture)?)?;
            }
            let map = traced.map(&picture)?;
            heat.push(heat_map(&map, picture.width, picture.height, Some(&traced.mask), Unit::Percent));
        }
        shown.push(Shown { subject: subject.clone(), picture, heat });
        if record.samples.values(subject, "frame").count() < case.repetitions as usize {
            ready.push((contender, made));
        }
    }
    frames(session, case, &ready, record, watch, tell)?;
    Ok(Measured { truths, shown, new_rows: record.samples.0.len() - rows_kept, warnings })
}

/// Of fewer samples the variance is a guess: pixels that no light has found yet seem to be sure of it.
const LEAST_SAMPLES: u64 = 64;

fn trace(
    session: &mut Session,
    case: &Case,
    watch: &dyn Watch,
    tell: &dyn Fn(&str),
    warnings: &mut Vec<Problem>,
) -> Result<Vec<Traced>, Problem> {
    let mut traced = Vec::new();
    for &truth in &case.truths {
        let settings = errors::settings(truth, &case.scene, &case.look.view);
        let each = |film: &Film| {
            tell(&format!(
                "{}: {}, {} samples per pixel, relative standard error {:.4}",
                case.name,
                truth.title(),
                film.samples,
                film.relative_standard_error(PART)
            ));
        };
        let goal = Goal::Error {
            part: PART,
            at_most: case.max_error,
            min_samples: LEAST_SAMPLES,
            max_samples: case.max_samples,
        };
        let film = session.trace(&case.scene, &settings, &goal, watch, each)?;
        let error = film.relative_standard_error(PART);
        if error > case.max_error {
            let what = format!(
                "{}: after {} samples the relative standard error of the {} is {error:.4}, not {}",
                case.name,
                film.samples,
                truth.title(),
                case.max_error
            );
            warnings.push(Problem::warning(what).hint("raise max_spp in the scene's .bench.ron or in its reference"));
        }
        traced.push(Traced::new(truth, film));
    }
    Ok(traced)
}

/// Names all that decides a contender's rows.
fn key(case: &Case, contender: &Contender) -> Key {
    let truths: Vec<Key> = case
        .truths
        .iter()
        .map(|&truth| {
            let settings = errors::settings(truth, &case.scene, &case.look.view);
            reference::plan(&mut Plan::default(), &case.scene, &settings, 1).key()
        })
        .collect();
    let seen = (contender.frame.1.key(), contender.picture.1.key());
    Key::of(&(seen, truths, case.max_error, case.max_samples, fingerprint(&CODE)))
}

/// The frames that are missing, by lot.
fn frames(
    session: &mut Session,
    case: &Case,
    ready: &[(&Contender, Values)],
    record: &mut Record,
    watch: &dyn Watch,
    tell: &dyn Fn(&str),
) -> Result<(), Problem> {
    let cancel = session.store.cancel.clone();
    let gpu = session.gpu()?;
    let mut warm = Vec::new();
    let mut lots = Vec::new();
    for (place, (contender, made)) in ready.iter().enumerate() {
        let subject = &contender.subject;
        let mut frame = Warm::up(gpu, contender, made, &cancel, watch)?;
        if let Some(bytes) = frame.peak_memory
            && record.samples.value(subject, "peak_memory").is_none()
        {
            record.add([sample(subject, "peak_memory", "bytes", 1, bytes as f64)])?;
        }
        for edit in &contender.edits {
            let measure = format!("edit:{}", edit.kind);
            let there = record.samples.values(subject, &measure).count() as u32;
            let wanted = case.repetitions.min(EDIT_REPETITIONS);
            if there < wanted {
                tell(&format!("{}: another {}, {}", case.name, edit.kind, subject.words()));
                frame.edit(gpu, edit, &cancel, watch)?; // compiles what is new
            }
            for repeat in there + 1..=wanted {
                let time = frame.edit(gpu, edit, &cancel, watch)?;
                record.add([sample(subject, &measure, "ms", repeat, time)])?;
            }
        }
        frame.settle();
        warm.push(frame);
        let there = record.samples.values(subject, "frame").count() as u32;
        lots.extend((there + 1..=case.repetitions).map(|_| place));
    }
    shuffle(&mut lots);
    for (n, &place) in lots.iter().enumerate() {
        let (contender, _) = &ready[place];
        tell(&format!("{}: frame {} of {}, {}", case.name, n + 1, lots.len(), contender.subject.words()));
        let passes = warm[place].again(gpu, contender, &cancel, watch)?;
        let subject = &contender.subject;
        let repeat = record.samples.values(subject, "frame").count() as u32 + 1;
        let pass = |(name, time): (&&str, &f64)| sample(subject, &format!("pass:{name}"), "ms", repeat, *time);
        let whole = sample(subject, "frame", "ms", repeat, passes.values().sum());
        record.add(passes.iter().map(pass).chain([whole]))?;
    }
    Ok(())
}

fn shuffle(lots: &mut [usize]) {
    let mut random = Random::new(ORDER_SEED, 0, 0);
    for i in (1..lots.len()).rev() {
        lots.swap(i, random.choice(i + 1));
    }
}

fn sample(subject: &Subject, measure: &str, unit: &'static str, repeat: u32, value: f64) -> Sample {
    Sample { subject: subject.clone(), measure: measure.to_string(), unit, repeat, value }
}

#[cfg(test)]
mod tests;
