//! A plan: a plain list of steps, made without running anything.
//!
//! A [`Step`] is a serialisable struct with one pure function. Adding it to a [`Plan`] gives a [`Slot`], a typed promise
//! of its value, which later steps hold as a field: so insertion order is run order, and a step can read only what it
//! lists. Adding the same step twice adds it once.
//!
//! ```
//! use diaphane::store::{Bake, Plan, Run, Slot, Step, Store};
//! use diaphane::problem::Problem;
//!
//! #[derive(serde::Serialize)]
//! struct Square { of: f64 }
//! impl Step for Square {
//!     type Output = f64;
//!     fn name(&self) -> &'static str { "square" }
//!     fn about(&self) -> String { format!("{} times itself", self.of) }
//!     fn run(&self, _: &Run) -> Result<f64, Problem> { Ok(self.of * self.of) }
//! }
//!
//! #[derive(serde::Serialize)]
//! struct Sum { of: Vec<Slot<f64>> }
//! impl Step for Sum {
//!     type Output = f64;
//!     fn name(&self) -> &'static str { "sum" }
//!     fn about(&self) -> String { format!("{} numbers added up", self.of.len()) }
//!     fn run(&self, run: &Run) -> Result<f64, Problem> { Ok(self.of.iter().map(|&slot| *run.get(slot)).sum()) }
//! }
//! impl Bake for Sum { const CODE: &'static [&'static str] = &["src/store/"]; }
//!
//! let mut plan = Plan::default();
//! let of = [1.0, 2.0, 2.0].map(|of| plan.add(Square { of })).to_vec();
//! let sum = plan.bake(Sum { of });
//! assert_eq!(plan.steps().len(), 3); // the square of 2 is one step
//! assert_eq!(*Store::in_memory().get(&plan, sum)?, 9.0);
//! # Ok::<(), Problem>(())
//! ```

use super::code;
use super::floats::{Each, floats};
use super::key::{Key, SLOT, SlotBytes, Spelling};
use super::run::Run;
use crate::problem::Problem;
use serde::de::DeserializeOwned;
use serde::{Serialize, Serializer};
use std::any::Any;
use std::collections::HashMap;
use std::marker::PhantomData;
use std::sync::Arc;

/// Any value a step can make.
pub(super) type Value = Arc<dyn Any + Send + Sync>;

/// One serialisable struct, one pure function. Its fields are its parameters and the slots that it reads; together with
/// its name they are its key, so whatever `run` depends on must be a field.
pub trait Step: Serialize + Send + Sync + 'static {
    type Output: Send + Sync + 'static;
    /// `room.what`: `frame.gbuffer`. Steps that differ in what they compute differ in their name or in a field.
    fn name(&self) -> &'static str;
    /// What it makes, for `explain`: half a sentence.
    fn about(&self) -> String;
    fn run(&self, run: &Run) -> Result<Self::Output, Problem>;

    /// Whether `run` asks for the host. What does not, and reads nothing that does, can be made on another thread while an
    /// older picture is looked at. No bake needs it, whatever is said here.
    const NEEDS_HOST: bool = true;

    /// The step that this one goes on from: nobody asks for its value again once this one's is there, so it leaves memory
    /// and stays on disk.
    fn continues(&self) -> Option<Slot<Self::Output>> {
        None
    }
}

/// A step whose value is bytes, kept on disk.
pub trait Bake: Step<Output: Serialize + DeserializeOwned> {
    /// The source files whose text decides the value, as path prefixes: `src/optics/`, and the step's own file.
    const CODE: &'static [&'static str];
}

/// A promise of a value, made by adding a step to a plan. It serialises as the value's name.
pub struct Slot<T> {
    pub(super) index: u32,
    key: Key,
    value: PhantomData<fn() -> T>,
}

impl<T> Slot<T> {
    pub fn key(&self) -> Key {
        self.key
    }
}
impl<T> Clone for Slot<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T> Copy for Slot<T> {}
impl<T> PartialEq for Slot<T> {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}
impl<T> Serialize for Slot<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_newtype_struct(SLOT, &SlotBytes::new(self.index, &self.key))
    }
}
impl<T> std::fmt::Debug for Slot<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "#{} {:?}", self.index, self.key)
    }
}

/// A step's value as bytes and back. A value that cannot be read is `None`: it is made again.
pub(super) struct Codec {
    pub encode: fn(&Value) -> Vec<u8>,
    pub decode: fn(&[u8]) -> Option<Value>,
    /// Every number in it, for whoever looks between the steps.
    pub floats: fn(&Value, &mut Each),
}

type RunFn = dyn Fn(&Run) -> Result<Value, Problem> + Send + Sync;

pub(super) enum Source {
    /// Was there before the plan: a file's content, a parsed mesh.
    Given(Value),
    /// Kept in memory.
    Pass(Box<RunFn>),
    /// Kept on disk.
    Bake(Box<RunFn>, Codec),
}

/// One line of a plan.
pub struct PlannedStep {
    pub name: &'static str,
    pub about: String,
    pub key: Key,
    /// The places of what it reads, all before its own.
    pub inputs: Vec<u32>,
    /// The place of what it goes on from.
    pub(super) continues: Option<u32>,
    pub(super) source: Source,
    needs_host: bool,
}

impl PlannedStep {
    pub fn is_bake(&self) -> bool {
        matches!(self.source, Source::Bake(..))
    }
    pub fn is_given(&self) -> bool {
        matches!(self.source, Source::Given(_))
    }
    /// Whether it is for the thread that holds the host to make.
    pub fn needs_host(&self) -> bool {
        self.needs_host
    }
}

/// What the scene made unnecessary, and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Skipped {
    pub what: String,
    pub why: String,
}

/// A list of steps; later ones read earlier ones.
#[derive(Default)]
pub struct Plan {
    steps: Vec<PlannedStep>,
    places: HashMap<Key, u32>,
    skipped: Vec<Skipped>,
}

impl Plan {
    /// Adds a step whose value is kept in memory: a pass.
    pub fn add<S: Step>(&mut self, step: S) -> Slot<S::Output> {
        self.place(step, None, |run| Source::Pass(run))
    }

    /// Adds a step whose value is kept on disk.
    pub fn bake<S: Bake>(&mut self, step: S) -> Slot<S::Output> {
        fn own<S: Step>(value: &Value) -> &S::Output {
            value.downcast_ref().expect("a step's value has the step's type")
        }
        let codec = Codec {
            encode: |value| {
                let value = own::<S>(value);
                postcard::to_stdvec(value).expect("a bake's value has fields of known length")
            },
            decode: |bytes| {
                let (value, rest) = postcard::take_from_bytes::<S::Output>(bytes).ok()?;
                rest.is_empty().then(|| Arc::new(value) as Value)
            },
            floats: |value, each| floats(own::<S>(value), each),
        };
        self.place(step, Some(code::fingerprint(S::CODE)), |run| Source::Bake(run, codec))
    }

    /// Adds a value that is there already, named by `key`.
    pub fn given<T: Send + Sync + 'static>(
        &mut self,
        name: &'static str,
        about: impl Into<String>,
        key: Key,
        value: Arc<T>,
    ) -> Slot<T> {
        let index = self.insert(key, || PlannedStep {
            name,
            about: about.into(),
            key,
            inputs: Vec::new(),
            continues: None,
            source: Source::Given(value),
            needs_host: false,
        });
        Slot { index, key, value: PhantomData }
    }

    /// Notes something that is not in the plan, for `explain`.
    pub fn skip(&mut self, what: impl Into<String>, why: impl Into<String>) {
        let skipped = Skipped { what: what.into(), why: why.into() };
        if !self.skipped.contains(&skipped) {
            self.skipped.push(skipped);
        }
    }

    pub fn steps(&self) -> &[PlannedStep] {
        &self.steps
    }

    pub fn skipped(&self) -> &[Skipped] {
        &self.skipped
    }

    pub fn keys(&self) -> impl Iterator<Item = Key> + '_ {
        self.steps.iter().map(|step| step.key)
    }

    fn place<S: Step>(
        &mut self,
        step: S,
        code: Option<[u8; 32]>,
        source: impl FnOnce(Box<RunFn>) -> Source,
    ) -> Slot<S::Output> {
        let mut spelling = Spelling::default();
        let name = step.name();
        spelling.write(name);
        spelling.write(&code);
        spelling.write(&step);
        let (key, mut inputs) = spelling.finish();
        // A step may hold a slot many times over: one mesh in each face of a shadow map.
        inputs.sort_unstable();
        inputs.dedup();
        debug_assert!(inputs.iter().all(|&i| (i as usize) < self.steps.len()), "{name} reads another plan's slot");
        let index = self.insert(key, || PlannedStep {
            name,
            about: step.about(),
            key,
            inputs,
            continues: step.continues().map(|slot| slot.index),
            source: source(Box::new(move |run| step.run(run).map(|value| Arc::new(value) as Value))),
            needs_host: S::NEEDS_HOST && code.is_none(),
        });
        Slot { index, key, value: PhantomData }
    }

    fn insert(&mut self, key: Key, step: impl FnOnce() -> PlannedStep) -> u32 {
        *self.places.entry(key).or_insert_with(|| {
            self.steps.push(step());
            self.steps.len() as u32 - 1
        })
    }
}
