//! A window on a scene: the same plan and the same store as a picture that is written, asked again for every frame.
//!
//! | file | what it holds |
//! |---|---|
//! | `window` | the event loop: what happens when, and the only place that knows winit |
//! | `redraw` | one frame of it |
//! | `screen` | the surface of the window, and what is painted on it |
//! | `stage` | what is looked at, and how its picture comes to be |
//! | `worker` | the threads that read files and make what needs no device |
//! | `camera` | orbit, pan, zoom, frame |
//! | `pace` | how long pictures take, and how many of their pixels are drawn while things move |
//! | `panel`, `overlay` | what is seen beside and over the picture |
//! | `deeds` | what becomes of what hands and programs want |
//! | `channel` | what happens, a line of JSON each, and words that stand for hands |
//!
//! There is no state that says what has to be done again: every frame that is drawn is planned anew, and the store knows
//! what is there. An idle window draws nothing. Passes run on the window's own thread, in plan order; bakes on another
//! one, and until they are there the last subject that was complete is drawn from wherever the camera is. What is traced is
//! shown with as many paths as there are, while the next doubling of them is made like a bake.
//!
//! Re-runs when: a hand, a file or the worker moves.

mod camera;
mod channel;
mod deeds;
mod overlay;
mod pace;
mod panel;
mod redraw;
mod screen;
mod stage;
mod telling;
mod window;
mod worker;

pub use channel::WORDS;
pub use window::open;

use crate::problem::Problems;
use crate::render::Look;
use crate::scene::Scene;
use crate::session::Options;
use std::path::PathBuf;
use std::sync::Arc;

/// How a scene that was read is to be looked at.
pub type LookOf = Box<dyn Fn(&Scene) -> Result<Look, Problems> + Send>;

/// What somebody wants to see.
pub struct Asked {
    pub options: Options,
    pub scene: PathBuf,
    pub look: LookOf,
    /// The window's first size in pixels, if not the usual one.
    pub size: Option<(u32, u32)>,
    /// Whether programs listen on stdout and speak on stdin.
    pub json: bool,
}

/// A scene, and the technique and the time at which it is seen.
#[derive(Clone)]
struct Subject {
    scene: Arc<Scene>,
    look: Look,
}

impl Subject {
    /// Whether the two need the same bakes, wherever the camera is.
    fn same(&self, other: &Subject) -> bool {
        let (a, b) = (&self.look, &other.look);
        Arc::ptr_eq(&self.scene, &other.scene) && a.technique == b.technique && a.view.time_s == b.view.time_s
    }
}
