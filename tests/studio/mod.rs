//! Where tests take pictures: a folder that vanishes, and one session, so that each pipeline is compiled once.

#![allow(dead_code, reason = "each test file takes what it needs")]

use diaphane::gpu::how_to_get_an_adapter;
use diaphane::image::{Display, Format, Image};
use diaphane::render::{self, Look};
use diaphane::scene::{Part, Reader, Scene};
use diaphane::session::{Options, Session};
use diaphane::store::{Files, Plan, Watch};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

pub struct Nobody;
impl Watch for Nobody {}

pub struct Studio {
    folder: tempfile::TempDir,
    pub session: Session,
}

/// The studio of all tests in a file. They take turns; a test that failed in it leaves it usable.
pub fn studio() -> MutexGuard<'static, Studio> {
    static STUDIO: OnceLock<Mutex<Studio>> = OnceLock::new();
    STUDIO.get_or_init(|| Mutex::new(Studio::new())).lock().unwrap_or_else(PoisonError::into_inner)
}

impl Studio {
    /// A fresh session that remembers nothing. Without an adapter the test fails and says what to install: a test that
    /// does not draw proves nothing.
    pub fn new() -> Studio {
        let mut session = Session::new(Options { no_cache: true, ..Options::default() });
        if let Err(problem) = session.gpu() {
            panic!("{problem}\nthe tests that draw need a graphics adapter: {}", how_to_get_an_adapter());
        }
        Studio { folder: tempfile::tempdir().expect("a folder can be made"), session }
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.folder.path().join(name);
        std::fs::write(&path, content).expect("a file can be written");
        path
    }

    pub fn write_exr(&self, name: &str, image: &Image) {
        let bytes = image.encode(Format::Exr, Display::default(), &[]).unwrap_or_else(|problem| panic!("{problem}"));
        self.write(name, bytes);
    }

    /// The scene of a text, `Scene(version: 1, …)` put around it.
    pub fn scene(&self, text: &str) -> Scene {
        let path = self.write("scene.ron", format!("Scene(version: 1, {text})"));
        read(&path)
    }

    pub fn shoot(&mut self, scene: &Scene, look: &Look) -> (Plan, Arc<Image>) {
        self.session.render(scene, look, &Nobody).unwrap_or_else(|problem| panic!("{problem}"))
    }

    /// The scattered light of a text's picture, without the sky behind things.
    pub fn scattered(&mut self, text: &str) -> Arc<Image> {
        let scene = self.scene(text);
        let mut look = Look::of(&scene);
        look.view.part = Part::Scattered;
        self.shoot(&scene, &look).1
    }

    /// The picture of a text.
    pub fn picture(&mut self, text: &str) -> Arc<Image> {
        let scene = self.scene(text);
        self.shoot(&scene, &Look::of(&scene)).1
    }
}

/// A scene of a file, read anew.
pub fn read(path: &std::path::Path) -> Scene {
    let reader = Reader::new(Arc::new(Files::default()));
    let (scene, _) = reader.scene(path, &[]).unwrap_or_else(|problems| panic!("{problems}"));
    render::check(&scene, &scene.view.technique).unwrap_or_else(|problems| panic!("{problems}"));
    scene
}

/// The mean over all pixels and channels.
pub fn mean(image: &Image) -> f64 {
    let sum: f64 = image.pixels.iter().flatten().map(|v| *v as f64).sum();
    sum / (3 * image.pixels.len()) as f64
}

/// The largest difference of a channel of a pixel.
pub fn most_apart(a: &Image, b: &Image) -> f64 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
    pairs.map(|(a, b)| (*a as f64 - *b as f64).abs()).fold(0.0, f64::max)
}

/// The share of pixels in which a channel differs by more than `limit`.
pub fn share_apart(a: &Image, b: &Image, limit: f64) -> f64 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let differs = |(a, b): &(&[f32; 3], &[f32; 3])| (0..3).any(|c| (a[c] as f64 - b[c] as f64).abs() > limit);
    a.pixels.iter().zip(&b.pixels).filter(differs).count() as f64 / a.pixels.len() as f64
}
