//! What was made on the way to a picture, step by step: for whoever looks between the steps.
//!
//! ```
//! # use diaphane::store::{Plan, Store, Key};
//! # let mut plan = Plan::default();
//! # let slot = plan.given("example.number", "a number", Key::of(&1), std::sync::Arc::new(1.5f64));
//! let mut store = Store::in_memory();
//! store.get(&plan, slot)?;
//! let numbers: Vec<_> = store.made(&plan).map(|made| (made.step.name, *made.value::<f64>().unwrap())).collect();
//! assert_eq!(numbers, [("example.number", 1.5)]);
//! # Ok::<(), diaphane::problem::Problem>(())
//! ```

use super::floats::Each;
use super::get::Store;
use super::plan::{Plan, PlannedStep, Source, Value};

/// A value that is in memory, and the step that made it.
pub struct Made<'a> {
    pub step: &'a PlannedStep,
    value: &'a Value,
}

impl<'a> Made<'a> {
    /// The value, if it is of this type.
    pub fn value<T: Send + Sync + 'static>(&self) -> Option<&'a T> {
        self.value.downcast_ref()
    }

    /// Tells every floating-point number of a bake's value, whatever its type, with its place: `normals[7][2]`. False for
    /// what is no bake: only those can be written down.
    pub fn floats(&self, each: &mut Each) -> bool {
        let Source::Bake(_, codec) = &self.step.source else { return false };
        (codec.floats)(self.value, each);
        true
    }
}

impl Store {
    /// All that is in memory of a plan, in the plan's order.
    pub fn made<'a>(&'a self, plan: &'a Plan) -> impl Iterator<Item = Made<'a>> {
        plan.steps().iter().filter_map(|step| Some(Made { step, value: self.value(&step.key)? }))
    }
}
