//! What a command holds while it works: the files, what was read from them, the store, and the device once it is needed.

use crate::gpu::{Gpu, Shaders};
use crate::image::Image;
use crate::problem::{Cause, Problem, Problems};
use crate::render::{self, Look};
use crate::scene::{Reader, Scene};
use crate::store::{Disk, Files, Plan, Slot, Store, Watch};
use std::path::{Path, PathBuf};
use std::sync::Arc;

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

    /// A scene with all that it names, and what is to be said of it. From here on [`Files::asked`] gathers what a picture of
    /// it depends on.
    pub fn scene(&self, path: &Path) -> Result<(Scene, Vec<Problem>), Problems> {
        self.files.forget();
        self.reader.scene(path, &self.options.sets)
    }

    /// The device, opened when it is first asked for.
    pub fn gpu(&mut self) -> Result<&Gpu, Problem> {
        if self.gpu.is_none() {
            let mut gpu = Gpu::open(self.options.adapter.as_deref())?;
            gpu.timed = self.timed;
            self.gpu = Some(gpu);
        }
        Ok(self.gpu.as_ref().expect("it was opened above"))
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
        self.fits(scene, look)?;
        let image = self.get(plan, picture, watch)?;
        if let Some(bad) = image.non_finite() {
            let (x, y) = bad.first;
            let what = format!("{} pixel(s) of the picture hold no number, the first at {x}, {y}", bad.count);
            return Err(Problem::new(Cause::Unfinished, what)
                .hint("this is a mistake in the program or in a shader that was edited; nothing was written"));
        }
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
