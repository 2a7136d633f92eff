//! What a command holds while it works: the files, what was read from them, the store, and the device once it is needed.

use crate::gpu::{Gpu, Shaders};
use crate::image::Image;
use crate::problem::{Cause, Problem, Problems, counted};
use crate::reference::{self, film::Film};
use crate::render::{self, Look};
use crate::scene::{Part, Reader, Scene};
use crate::store::{Disk, Files, Plan, Slot, Store, Watch};
use crate::techniques::reference::Reference;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Where bakes are kept and what passes run on.
#[derive(Clone, Debug, Default)]
pub struct Options {
    pub cache_dir: Option<PathBuf>,
    pub no_cache: bool,
    pub adapter: Option<String>,
    /// PATH and RON, put in place of what the scene's file says.
    pub sets: Vec<(String, String)>,
}

impl Options {
    /// The folder of bakes: as asked for, else the system's place for such things.
    pub fn cache_folder(&self) -> PathBuf {
        use etcetera::BaseStrategy;
        match &self.cache_dir {
            Some(folder) => folder.clone(),
            None => match etcetera::choose_base_strategy() {
                Ok(places) => places.cache_dir().join("diaphane"),
                Err(_) => std::env::temp_dir().join("diaphane-cache"),
            },
        }
    }
}

/// When a reference is good enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// So many samples per pixel.
    Samples(u64),
    /// The relative standard error of a part, looked at from `min_samples` on, at least 2; or else so many samples.
    Error { part: Part, at_most: f64, min_samples: u64, max_samples: u64 },
    /// So many seconds: the last doubling of the samples that can be finished in them.
    Seconds(f64),
}

pub struct Session {
    pub options: Options,
    pub files: Arc<Files>,
    pub reader: Reader,
    pub shaders: Shaders,
    pub store: Store,
    gpu: Option<Gpu>,
    /// Whether each pass is waited for, so that its time is its own.
    pub timed: bool,
}

impl Session {
    pub fn new(options: Options) -> Session {
        let files = Arc::new(Files::default());
        let store = match options.no_cache {
            true => Store::in_memory(),
            false => Store::on_disk(Disk::new(options.cache_folder())),
        };
        Session {
            reader: Reader::new(files.clone()),
            shaders: Shaders::new(Shaders::usual_folder(), files.clone()),
            files,
            store,
            gpu: None,
            timed: false,
            options,
        }
    }

    /// A scene with all that it names, and what is to be said of it. Shaders are looked at anew with it, and from here on
    /// [`Files::asked`] gathers what a picture of it depends on.
    pub fn scene(&self, path: &Path) -> Result<(Scene, Vec<Problem>), Problems> {
        self.files.forget();
        self.shaders.look_again();
        self.reader.scene(path, &self.options.sets)
    }

    /// The device, opened when it is first asked for.
    pub fn gpu(&mut self) -> Result<&Gpu, Problem> {
        if self.gpu.is_none() {
            self.gpu = Some(Gpu::open(self.options.adapter.as_deref())?);
        }
        let gpu = self.gpu.as_mut().expect("it was opened above");
        gpu.timed = self.timed;
        Ok(gpu)
    }

    /// The plan for a picture, and the picture.
    pub fn render(&mut self, scene: &Scene, look: &Look, watch: &dyn Watch) -> Result<(Plan, Arc<Image>), Problem> {
        let (plan, picture) = render::plan(scene, look, &self.shaders)?;
        let image = self.picture(scene, look, &plan, picture, watch)?;
        Ok((plan, image))
    }

    /// The picture of a plan that was made for it.
    pub fn picture(
        &mut self,
        scene: &Scene,
        look: &Look,
        plan: &Plan,
        picture: Slot<Image>,
        watch: &dyn Watch,
    ) -> Result<Arc<Image>, Problem> {
        let image = match Reference::of(&look.technique)? {
            Some(reference) => {
                // No more paths than are needed: the plan holds the most that there may be.
                let (part, at_most, max_samples) =
                    (look.view.part, reference.max_error(scene), reference.max_spp(scene));
                let goal = Goal::Error { part, at_most, min_samples: 2, max_samples };
                let film = self.trace(scene, &reference.settings(scene, &look.view), &goal, watch, |_| ())?;
                Arc::new(film.picture(part))
            }
            None => {
                self.fits(scene, look)?;
                self.get(plan, picture, watch)?
            }
        };
        whole(&image)?;
        Ok(image)
    }

    /// That the device's textures hold the picture with all its samples.
    fn fits(&mut self, scene: &Scene, look: &Look) -> Result<(), Problem> {
        let largest = self.gpu()?.device.limits().max_texture_dimension_2d;
        let ((width, height), samples) = (look.view.size, look.view.antialias);
        if width.max(height) <= largest / samples {
            return Ok(());
        }
        // Who is to blame: the file, unless a flag asked for another size.
        let cause = if look.view.size == scene.view.size { Cause::Files } else { Cause::Words };
        let what = format!(
            "{width} x {height} pixels of {samples} x {samples} samples are too large for the adapter, whose textures end \
             at {largest} a side"
        );
        let hint = format!("at most {} pixels a side, or fewer samples: --set view.antialias=1", largest / samples);
        Err(Problem::new(cause, what).hint(hint))
    }

    /// The truth by paths on the CPU, as far as `goal` asks. `each` is told of every doubling of the samples.
    pub fn trace(
        &mut self,
        scene: &Scene,
        settings: &reference::Settings,
        goal: &Goal,
        watch: &dyn Watch,
        mut each: impl FnMut(&Film),
    ) -> Result<Arc<Film>, Problem> {
        let started = Instant::now();
        let mut samples = 1;
        loop {
            let mut plan = Plan::default();
            let slot = reference::plan(&mut plan, scene, settings, samples);
            let before = started.elapsed();
            let film = self.store.get_with(&plan, slot, None, watch)?;
            each(&film);
            let time = started.elapsed();
            let enough = match *goal {
                Goal::Samples(count) => samples >= count,
                Goal::Error { part, at_most, min_samples, max_samples } => {
                    samples >= max_samples || samples >= min_samples && film.level(part).reaches(at_most)
                }
                // The next doubling takes twice as long as the last: it is begun only if it can be finished.
                Goal::Seconds(seconds) => (time + 2 * (time - before)).as_secs_f64() > seconds,
            };
            if enough {
                return Ok(film);
            }
            samples = match *goal {
                Goal::Samples(count) => (2 * samples).min(count),
                Goal::Error { max_samples, .. } => (2 * samples).min(max_samples),
                Goal::Seconds(_) => 2 * samples,
            };
        }
    }

    /// One value of a plan that needs the device.
    pub fn get<T: Send + Sync + 'static>(
        &mut self,
        plan: &Plan,
        slot: Slot<T>,
        watch: &dyn Watch,
    ) -> Result<Arc<T>, Problem> {
        self.gpu()?;
        self.store.get_with(plan, slot, self.gpu.as_ref().map(|gpu| gpu as _), watch)
    }
}

/// That every pixel of a picture holds a number.
pub fn whole(image: &Image) -> Result<(), Problem> {
    let Some(bad) = image.non_finite() else { return Ok(()) };
    let (x, y) = bad.first;
    let what = format!("{} of the picture without a number, the first at {x}, {y}", counted(bad.count, "pixel"));
    Err(Problem::new(Cause::Unfinished, what)
        .hint("this is a mistake in the program or in a shader that was edited; nothing was written"))
}
