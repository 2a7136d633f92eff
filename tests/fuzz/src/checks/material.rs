//! Materials: what is read is valid, whatever it inherits.

use super::parts;
use super::shelf::{Shelf, finite};
use diaphane::optics::medium::Medium;
use diaphane::scene::{Kind, Material, Substance, Varying};

/// The material, and up to three others that may be its bases: `b.ron`, `c.ron` and `d.ron`.
pub fn check(bytes: &[u8]) {
    let parts = parts(bytes);
    let names = ["fuzz.ron", "b.ron", "c.ron", "d.ron"];
    let files: Vec<(&str, &[u8])> = names.into_iter().zip(parts).collect();
    let shelf = Shelf::of(&files);
    if let Some(material) = shelf.read(|reader, path| reader.material(path)) {
        valid(&material);
        if shelf.says_its_kind() {
            shelf.is(Kind::Material);
            shelf.reads_again(&material, |reader, path| Ok(reader.material(path)?.0));
        }
    }
}

pub fn valid(material: &Material) {
    finite(material);
    let surface = &material.surface;
    assert!((1.0..=4.0).contains(&surface.ior));
    match &surface.roughness {
        Varying::Constant(roughness) => assert!((0.0..=1.0).contains(roughness)),
        Varying::Texture(map) => assert!(!map.texture.texels.is_empty()),
    }
    if let Varying::Constant(color) = &surface.color {
        assert!(color.min_element() >= 0.0 && color.max_element() <= 1.0);
    }
    assert!(material.albedo.min_element() >= 0.0 && material.albedo.max_element() <= 1.0, "{}", material.albedo);
    match &material.medium {
        Substance::Translucent(medium) => valid_medium(medium),
        Substance::Opaque { albedo } => assert!(albedo.min_element() >= 0.0 && albedo.max_element() <= 1.0),
    }
    for layer in &material.layers {
        assert!(!layer.name.trim().is_empty());
        valid_medium(&layer.medium);
        if let Varying::Constant(depth) = layer.depth {
            assert!(depth >= 0.0);
        }
    }
}

/// What techniques ask of a medium is a number, too.
fn valid_medium(medium: &Medium) {
    assert!(medium.sigma_a.min_element() >= 0.0 && medium.sigma_s.min_element() >= 0.0);
    assert!(medium.g.abs().max_element() <= 1.0);
    for (what, value) in [
        ("sigma_t", medium.sigma_t()),
        ("sigma_t'", medium.sigma_t_prime()),
        ("albedo", medium.albedo()),
        ("albedo'", medium.albedo_prime()),
        ("sigma_tr", medium.sigma_tr()),
    ] {
        assert!(value.is_finite() && value.min_element() >= 0.0, "{what} is {value}");
    }
}
