//! Scenes: what is read is valid, and `--set` reads as what it sets.

use super::material::valid as valid_material;
use super::parts;
use super::shelf::{Shelf, finite};
use diaphane::scene::{Camera, Kind, LightKind, Scene, Sky};
use glam::DVec3;

/// The scene, and lines of `PATH=RON` after it.
pub fn check(bytes: &[u8]) {
    let parts = parts(bytes);
    let shelf = Shelf::of(&[("fuzz.ron", parts[0])]);
    if let Some(scene) = shelf.read(|reader, path| reader.scene(path, &[])) {
        valid(&scene);
        shelf.is(Kind::Scene);
        shelf.reads_again(&scene, |reader, path| Ok(reader.scene(path, &[])?.0));
    }
    let lines = parts[1..].iter().flat_map(|part| part.split(|&byte| byte == b'\n'));
    let words = lines.filter_map(|line| std::str::from_utf8(line).ok()?.split_once('='));
    let sets: Vec<(String, String)> = words.take(8).map(|(path, ron)| (path.to_string(), ron.to_string())).collect();
    if !sets.is_empty()
        && let Some(scene) = shelf.read(|reader, path| reader.scene(path, &sets))
    {
        valid(&scene);
    }
}

fn valid(scene: &Scene) {
    finite(scene);
    let camera = |camera: &Camera| {
        assert!(camera.fov_y_deg > 0.0 && camera.fov_y_deg < 180.0);
        assert!(camera.eye != camera.target && camera.up.length() != 0.0);
    };
    assert!(scene.mm_per_unit > 0.0);
    camera(&scene.camera);
    scene.bookmarks.values().for_each(camera);
    for light in &scene.lights {
        assert!(!light.name.trim().is_empty());
        match &light.kind {
            LightKind::Directional { direction, irradiance } => {
                assert!((direction.length() - 1.0).abs() < 1e-9 && irradiance.min_element() >= 0.0);
            }
            LightKind::Point { intensity, .. } => assert!(intensity.min_element() >= 0.0),
            LightKind::Rect { u, v, radiance, .. } => {
                assert!(*u != DVec3::ZERO && *v != DVec3::ZERO && radiance.min_element() >= 0.0);
            }
            LightKind::Environment { sky, scale, .. } => {
                assert!(*scale >= 0.0);
                match sky {
                    Sky::Constant(radiance) => assert!(radiance.min_element() >= 0.0),
                    Sky::Image(map) => assert!(!map.texture.texels.is_empty()),
                }
            }
        }
    }
    for object in &scene.objects {
        assert!(!object.name.trim().is_empty() && object.transform.scale.min_element() > 0.0);
        valid_material(&object.material);
    }
    let view = &scene.view;
    assert!([view.size.0, view.size.1].iter().all(|side| (1..=16_384).contains(side)));
    assert!([1, 2, 4].contains(&view.antialias) && view.exposure_ev.abs() <= 64.0);
    let reference = &scene.reference;
    assert!(reference.max_error > 0.0 && reference.max_spp > 0 && reference.max_depth > 0);
}
