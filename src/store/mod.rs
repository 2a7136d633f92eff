//! The one mechanism: **every value is named by the content hash of everything that made it; ask for a value by name,
//! and what is not there yet gets made.**
//!
//! It knows nothing of scenes, optics or GPUs. Re-runs when: the key of a step is not in memory or on disk.

mod code;
mod disk;
mod files;
mod key;
mod plan;
mod run;
mod store;

pub use disk::{Disk, Entry};
pub use files::{File, Files};
pub use key::Key;
pub use plan::{Bake, Plan, PlannedStep, Skipped, Slot, Step};
pub use run::{Cancel, Run};
pub use store::{Finished, Origin, State, Store, Watch};
