//! The scenes of the project are sound, and those to measure on are as hard as they claim.

use diaphane::frame;
use diaphane::render;
use diaphane::scene::{MeshSource, Reader, Scene};
use std::path::{Path, PathBuf};

/// Scenes that warn, and why that is right.
const WARN: [(&str, &str); 6] = [
    ("fish", "the measured media absorb light before it diffuses: that is what they are there for"),
    ("one-lamp", "the same fish"),
    ("four-lamps", "the same fish"),
    ("sixteen-lamps", "the same fish"),
    ("layers", "light spreads less than a pixel in its leaf, whose layers are thinner still"),
    ("procession", "its figures are so far away that light spreads less than a pixel"),
];

fn files_in(folder: &str) -> Vec<PathBuf> {
    let listed = std::fs::read_dir(folder).expect("the tests run where the scenes are").flatten();
    let mut found: Vec<PathBuf> = listed.map(|entry| entry.path()).collect();
    found.retain(|path| {
        let name = path.to_string_lossy();
        name.ends_with(".ron") && !name.ends_with(".bench.ron")
    });
    found.sort();
    found
}

/// A scene and how many warnings it has; none for one whose model has to be fetched.
fn sound(path: &Path) -> Option<(Scene, usize)> {
    let text = std::fs::read_to_string(path).expect("it was listed");
    if text.contains("models/") && !Path::new("models/bunny.obj").is_file() {
        eprintln!("NOT TESTED: {}: its model is not there; tools/fetch-models brings it", path.display());
        return None;
    }
    let reader = Reader::new(Default::default());
    let (scene, warnings) = reader.scene(path, &[]).unwrap_or_else(|problems| panic!("{problems}"));
    render::check(&scene, &scene.view.technique).unwrap_or_else(|problems| panic!("{problems}"));
    Some((scene, warnings.len()))
}

#[test]
fn every_scene_is_sound_and_says_what_it_is_for() {
    let all = ["scenes", "scenes/bench", "scenes/layers", "scenes/long-range"].map(files_in).concat();
    assert!(all.len() >= 14, "scenes are gone: {all:?}");
    for path in all {
        let text = std::fs::read_to_string(&path).expect("it was listed");
        assert!(text.starts_with("// "), "{}: the first line says what it is for", path.display());
        let Some((_, warnings)) = sound(&path) else { continue };
        let stem = path.file_stem().expect("a scene has a name").to_string_lossy();
        let may_warn = WARN.iter().any(|(name, _)| *name == stem);
        assert_eq!(warnings > 0, may_warn, "{}: {warnings} warnings", path.display());
    }
}

/// How far light spreads in each translucent thing, 1/sigma_tr, as a share of it: in the channel where it goes farthest.
fn shares(scene: &Scene) -> Vec<f64> {
    let share = |object: &diaphane::scene::Object| {
        let medium = object.material.medium.medium()?;
        let far = medium.sigma_tr().map(|s| 1.0 / s).max_element();
        Some(far / (frame::extent(object) * scene.mm_per_unit))
    };
    scene.objects.iter().filter_map(share).collect()
}

#[test]
fn scenes_to_measure_on_cover_what_is_hard() {
    let paths = files_in("scenes/bench");
    let scenes: Vec<Scene> = paths.iter().filter_map(|path| sound(path)).map(|(scene, _)| scene).collect();
    assert!(scenes.len() >= 12 && scenes.len() == paths.len(), "none of them needs a model that has to be fetched");
    for path in &paths {
        let text = std::fs::read_to_string(path).expect("it was listed");
        assert!(text.starts_with("// Hard for: "), "{}: the first line says what it is hard for", path.display());
    }
    let shares: Vec<f64> = scenes.iter().flat_map(shares).collect();
    let least = shares.iter().copied().fold(f64::INFINITY, f64::min);
    let most = shares.iter().copied().fold(0.0, f64::max);
    println!("light spreads over {least:.4} to {most:.2} of the things");
    assert!(least < 0.02 && most > 1.0, "from {least} to {most}");
    let any = |what: &str, found: &dyn Fn(&Scene) -> bool| assert!(scenes.iter().any(found), "no scene with {what}");
    any("sixteen lights", &|scene| scene.lights.len() == 16);
    any("the surroundings alone", &|scene| scene.lights.len() == 1 && scene.objects.len() > 1);
    any("layers", &|scene| scene.objects.iter().any(|object| !object.material.layers.is_empty()));
    any("something that deforms", &|scene| scene.objects.iter().any(|object| !object.deform.is_empty()));
    any("a mesh from a file", &|scene| {
        scene.objects.iter().any(|object| matches!(object.mesh, MeshSource::File { .. }))
    });
}
