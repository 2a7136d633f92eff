//! The one mechanism: **every value is named by the content hash of everything that made it; ask for a value by name,
//! and what is not there yet gets made.**
//!
//! It knows nothing of scenes, optics or GPUs. Re-runs when: the key of a step is not in memory or on disk.

mod code;
mod disk;
mod files;
mod floats;
mod follow;
mod get;
mod key;
mod made;
mod plan;
mod run;

pub use code::fingerprint;
pub use disk::{Disk, Entry, Swept};
pub use files::{File, Files};
pub use floats::Place;
pub use follow::Follow;
pub use get::{Finished, Origin, State, Store, Values, Watch};
pub use key::Key;
pub use made::Made;
pub use plan::{Bake, Plan, PlannedStep, Skipped, Slot, Step};
pub use run::{Cancel, Run};
