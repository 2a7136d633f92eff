//! What a step sees while it runs: the values that it listed, somebody who may lose patience, and the host.

use super::plan::{Slot, Value};
use crate::problem::{Cause, Problem};
use std::any::Any;
use std::sync::Arc;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Says to long work that nobody waits for it any more.
#[derive(Clone, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
    /// Somebody waits again.
    pub fn reset(&self) {
        self.0.store(false, Ordering::Relaxed);
    }
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Given to [`Step::run`](super::Step::run).
pub struct Run<'a> {
    pub(super) name: &'static str,
    pub(super) inputs: &'a [(u32, Value)],
    pub(super) host: Option<&'a (dyn Any + Send + Sync)>,
    pub(super) cancel: &'a Cancel,
    pub(super) progress: &'a (dyn Fn(f64) + Sync),
    pub(super) measured: OnceLock<Duration>,
}

impl Run<'_> {
    /// The value of a slot that is among the step's fields.
    pub fn get<T: Send + Sync + 'static>(&self, slot: Slot<T>) -> Arc<T> {
        let value = self.inputs.iter().find(|(index, _)| *index == slot.index);
        let (_, value) = value.unwrap_or_else(|| panic!("{} reads a slot that is not one of its fields", self.name));
        value.clone().downcast().expect("a slot's value has the slot's type")
    }

    /// What the store was given to run passes with; the gpu room knows its type.
    pub fn host<T: Any>(&self) -> &T {
        let host = self.host.unwrap_or_else(|| panic!("{} needs a device, and the store was given none", self.name));
        host.downcast_ref().expect("the host is of the type that the steps expect")
    }

    /// Tells a time that the step measured better than the wall clock around it can: a device's own.
    pub fn took(&self, time: Duration) {
        self.measured.set(time).ok(); // the first measurement stands
    }

    /// Reports the share done, 0 to 1. An `Err` says that nobody waits any more: pass it up.
    pub fn tick(&self, share: f64) -> Result<(), Problem> {
        (self.progress)(share);
        match self.cancel.is_cancelled() {
            true => Err(Problem::new(Cause::Unfinished, format!("{} was interrupted", self.name))
                .hint("run the same command again: what was finished is kept")),
            false => Ok(()),
        }
    }
}
