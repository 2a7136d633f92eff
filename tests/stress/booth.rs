//! Where pictures are taken and looked at: a device for what is drawn, which takes turns, and none for what is traced.

use crate::columns::Column;
use crate::inputs::{Input, Law};
use crate::laws;
use crate::sound::{Flaw, inspect};
use crate::stage::{Files, Stage};
use diaphane::gpu::{Gpu, how_to_get_an_adapter};
use diaphane::image::Image;
use diaphane::problem::Problem;
use diaphane::reference::film::Film;
use diaphane::render::{self, Look};
use diaphane::scene::{Part, Scene};
use diaphane::session::{Options, Session};
use diaphane::store::{Key, Plan, Slot, Watch};
use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// A picture whose every step was looked at.
pub struct Shot {
    pub image: Arc<Image>,
    /// Of a traced one.
    pub film: Option<Arc<Film>>,
    /// How many numbers were looked at.
    pub numbers: usize,
}

/// Why there is none.
pub enum Miss {
    Flaw(Flaw),
    /// A law between pictures is broken.
    Law(String),
    /// The technique says itself that it cannot do this.
    Refused(String),
}

impl From<Flaw> for Miss {
    fn from(flaw: Flaw) -> Miss {
        Miss::Flaw(flaw)
    }
}

struct Nobody;
impl Watch for Nobody {}

pub struct Booth {
    folder: tempfile::TempDir,
    pub session: Session,
    /// None where pictures are traced.
    gpu: Option<Gpu>,
    known: HashSet<Key>,
}

/// The only one with a device. A test that failed in it leaves it usable.
fn drawn() -> MutexGuard<'static, Booth> {
    static BOOTH: OnceLock<Mutex<Booth>> = OnceLock::new();
    BOOTH.get_or_init(|| Mutex::new(Booth::new(false))).lock().unwrap_or_else(PoisonError::into_inner)
}

/// Takes what an input's law asks for, and tells how far the law is kept.
pub fn judge(input: &Input, column: &Column) -> Result<String, Miss> {
    match column.is_traced {
        true => Booth::new(true).judge(input, column),
        false => drawn().judge(input, column),
    }
}

impl Booth {
    pub fn new(is_traced: bool) -> Booth {
        let open = || {
            let told =
                |problem| panic!("{problem}\nwhat is drawn needs a graphics adapter: {}", how_to_get_an_adapter());
            Gpu::open(None).unwrap_or_else(told)
        };
        Booth {
            folder: tempfile::tempdir().expect("a folder can be made"),
            session: Session::new(Options { no_cache: true, ..Options::default() }),
            gpu: (!is_traced).then(open),
            known: HashSet::new(),
        }
    }

    pub fn judge(&mut self, input: &Input, column: &Column) -> Result<String, Miss> {
        let part = if matches!(input.law, Law::White) && !column.is_traced { Part::Scattered } else { Part::Full };
        let mut take = |stage: &Stage| self.shoot(stage, &column.technique, part);
        let shot = take(&input.stage)?;
        let kept = match &input.law {
            Law::Sound => Ok(format!("{} numbers", shot.numbers)),
            Law::White => laws::no_more_than_white(&shot, &column.name),
            Law::SameAs(other) => laws::times(&shot, 1.0, &take(other)?),
            Law::NearlySameAs(other) => laws::nearly(&shot, &take(other)?),
            Law::SumOf(one, other) => laws::sum(&shot, &take(one)?, &take(other)?),
            Law::Times(factor, other) => laws::times(&shot, *factor, &take(other)?),
        };
        kept.map_err(Miss::Law)
    }

    fn scene(&self, Files(files): Files, technique: &str) -> Result<Scene, Miss> {
        let mut scene = PathBuf::new();
        for (name, text) in files {
            let (path, is_scene) = (self.folder.path().join(name), name == "scene.ron");
            let text = if is_scene { format!("{text}{technique}))") } else { text };
            std::fs::write(&path, text).expect("a file can be written");
            if is_scene {
                scene = path;
            }
        }
        // An input that cannot be read is a mistake in the grid.
        let (scene, _) = self.session.scene(&scene).unwrap_or_else(|problems| panic!("{problems}"));
        let refused = |problems: diaphane::problem::Problems| Miss::Refused(problems.to_string());
        render::check(&scene, &scene.view.technique).map_err(refused)?;
        Ok(scene)
    }

    /// The picture of a stage, after a look at everything that was made on the way.
    pub fn shoot(&mut self, stage: &Stage, technique: &str, part: Part) -> Result<Shot, Miss> {
        let scene = self.scene(stage.files(), technique)?;
        let mut look = Look::of(&scene);
        look.view.part = part;
        let wrong = |problem: Problem| {
            Miss::Flaw(Flaw { step: "the plan".into(), place: "the whole".into(), what: problem.to_string() })
        };
        let (plan, picture) = render::plan(&scene, &look, &self.session.shaders).map_err(wrong)?;
        let image = self.get(&plan, picture);
        // A picture that was refused has parts, and one of them says why.
        let numbers = self.inspect(&plan)?;
        let films = self.session.store.made(&plan).filter_map(|made| made.value::<Film>());
        let film = films.last().map(|film| Arc::new(film.clone()));
        Ok(Shot { image: image.map_err(wrong)?, film, numbers })
    }

    pub fn get<T: Send + Sync + 'static>(&mut self, plan: &Plan, slot: Slot<T>) -> Result<Arc<T>, Problem> {
        self.session.store.get_with(plan, slot, self.gpu.as_ref().map(|gpu| gpu as _), &Nobody)
    }

    pub fn inspect(&mut self, plan: &Plan) -> Result<usize, Flaw> {
        inspect(&self.session.store, plan, self.gpu.as_ref(), &mut self.known)
    }
}
