//! What is left out of a plan cannot be missed in the picture.

mod studio;

use diaphane::render::Look;
use diaphane::scene::Scene;
use std::path::{Path, PathBuf};
use studio::{mean, most_apart, read, studio};

const SIZE: (u32, u32) = (64, 48);

fn look(scene: &Scene, skip: bool) -> Look {
    let mut look = Look::of(scene);
    look.view.size = SIZE;
    look.view.antialias = 1;
    look.view.skip = skip;
    look
}

/// The project's scenes and those made for this.
fn scenes() -> Vec<PathBuf> {
    let listed = |folder: &str| std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut found: Vec<PathBuf> = listed("scenes")
        .filter(|path| path.extension().is_some_and(|e| e == "ron") && !path.to_string_lossy().contains(".bench."))
        .chain(listed("tests/scenes").filter(|path| path.to_string_lossy().ends_with(".scene.ron")))
        .collect();
    found.retain(|path| {
        // A model that is fetched, not part of the project.
        let text = std::fs::read_to_string(path).unwrap_or_default();
        let absent = text.contains("../models/bunny.obj") && !std::path::Path::new("models/bunny.obj").is_file();
        if absent {
            eprintln!("NOT TESTED: {}: its model is not there; tools/fetch-models brings it", path.display());
        }
        !absent
    });
    // Three busts take half a minute of bakes, and no step that other scenes do not take.
    found.retain(|path| !path.ends_with("three-busts.ron"));
    found.sort();
    assert!(found.len() >= 3, "the tests run where the scenes are");
    found
}

#[test]
fn leaving_out_changes_no_picture() {
    let mut studio = studio();
    for path in scenes() {
        let scene = read(&path);
        let (short, with) = studio.shoot(&scene, &look(&scene, true));
        let (long, without) = studio.shoot(&scene, &look(&scene, false));
        let limit = 1e-6 * mean(&without);
        assert!(mean(&without) > 0.0, "{}: the picture is black", path.display());
        assert!(most_apart(&with, &without) <= limit, "{}: {}", path.display(), most_apart(&with, &without));
        let (short, long) = (short.steps().len(), long.steps().len());
        assert!(short <= long, "{}: {short} steps with skipping, {long} without", path.display());
        println!("{}: {short} steps, {long} without skipping", path.display());
    }
}

fn plan(name: &str, skip: bool, set: &[(&str, &str)]) -> diaphane::store::Plan {
    let sets: Vec<_> = set.iter().map(|(path, ron)| (path.to_string(), ron.to_string())).collect();
    let reader = diaphane::scene::Reader::new(Default::default());
    let path = Path::new("tests/scenes").join(format!("{name}.scene.ron"));
    let (scene, _) = reader.scene(&path, &sets).unwrap_or_else(|problems| panic!("{problems}"));
    let shaders = diaphane::gpu::Shaders::new(None, Default::default());
    diaphane::render::plan(&scene, &look(&scene, skip), &shaders).unwrap_or_else(|problem| panic!("{problem}")).0
}

#[test]
fn every_rule_acts_and_gives_its_reason() {
    let all = plan("all", true, &[]);
    for (what, why) in [
        ("the object `hidden`", "visible: false"),
        ("drawing `behind`", "outside the view"),
        ("gloss of `matched`", "index of refraction is 1"),
        ("shadows of the light `fill`", "shadow: false"),
        ("the light `off`", "enabled: false"),
        ("light straight through `dense`", "mean free paths"),
        ("where `twisted` sees the sky", "it deforms"),
    ] {
        let found = all.skipped().iter().any(|s| s.what.contains(what) && s.why.contains(why));
        assert!(found, "`{what}` because of `{why}` is not among {:#?}", all.skipped());
    }
    let count = |plan: &diaphane::store::Plan, name: &str| plan.steps().iter().filter(|s| s.name == name).count();
    // Four of the lights shine and cast shadows; the black one, the one that is off and the one without shadow do not.
    assert_eq!(count(&all, "frame.shadow"), 3);
    assert_eq!(count(&all, "frame.through"), 1, "one thing is clear");
    // Nothing of it is there when nothing asks for it.
    let dark = plan("dark", true, &[]);
    for absent in
        ["frame.environment", "frame.through", "frame.gloss", "sky.visibility", "gloss.albedo", "frame.resolve"]
    {
        assert_eq!(count(&dark, absent), 0, "{absent}");
        assert!(count(&all, absent) > 0 || absent == "frame.resolve", "{absent} is a name of a step");
    }
    let sky = plan("sky", true, &[]);
    for absent in ["frame.shadow", "frame.visibility", "frame.through"] {
        assert_eq!(count(&sky, absent), 0, "{absent}");
    }
    assert_eq!(count(&plan("sky", true, &[("lights.room.shadow", "false")]), "sky.visibility"), 0);
    assert_eq!(count(&plan("dark", true, &[("lights.sun.shadow", "false")]), "frame.shadow"), 0);
}
