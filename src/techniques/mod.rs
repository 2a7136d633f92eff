//! The ways of making light that went through something: one folder each, one line each in [`REGISTRY`].
//!
//! A technique plans its steps for the objects of a [`Surface`] and hands back [`Scattered`]: light that entered, was
//! scattered and came out again, linear, without gloss, without the surface's colour, 0 where the objects are not. Its
//! module's header is its manual, and `diaphane techniques NAME` prints it.

mod attenuation;
mod depth_map_thickness;
mod filtered_normals;
mod kernel;
mod layered;
mod local;
mod long_range;
mod opaque;
pub mod reference;
mod screen;
mod screen_space;
mod spherical_thickness;

use crate::frame::Surface;
use crate::gpu::Images;
use crate::problem::Problem;
use crate::scene::{Material, TechniqueText};
use crate::store::{Plan, Slot};
use depth_map_thickness::DepthMapThickness;
use reference::Reference;
use spherical_thickness::SphericalThickness;

/// Radiance per pixel, `rgba32float`, at the sampled size.
pub type Scattered = Slot<Images>;

/// A way of making scattered light, with its settings.
pub trait Technique: Send + Sync {
    /// The steps for all of the surface's objects.
    fn plan(&self, plan: &mut Plan, surface: &Surface) -> Result<Scattered, Problem>;

    /// How far above the surface of such a material shadows are to be looked up, mm: the distance over which this
    /// technique lets light in around an edge. 0 for one that knows nothing of its neighbourhood.
    fn entry_mm(&self, _material: &Material) -> f64 {
        0.0
    }

    /// What a material asks for that this technique cannot do, told at the field in the material's file, before anything
    /// is planned.
    fn refuses(&self, _material: &Material) -> Option<Problem> {
        None
    }
}

/// One line of the registry.
pub struct Entry {
    pub name: &'static str,
    /// The header of its module.
    pub manual: &'static str,
    /// Settings, beside the defaults, with which it is worth measuring: what the benchmark adds when it is to show every
    /// setting. Each is a whole text: `LongRange(layers: 16)`.
    pub sweep: &'static [&'static str],
    pub read: fn(&TechniqueText) -> Result<Box<dyn Technique>, Problem>,
}

/// `entry!(long_range, LongRange)`, or with the settings that are worth measuring behind it.
macro_rules! entry {
    ($module:ident, $type:ident $(, $setting:literal)*) => {
        Entry {
            name: stringify!($type),
            manual: include_str!(concat!(stringify!($module), "/mod.rs")),
            sweep: &[$($setting),*],
            read: |text| Ok(Box::new(text.settings::<$module::$type>()?)),
        }
    };
}

/// Every technique there is.
pub const REGISTRY: &[Entry] = &[
    entry!(opaque, Opaque),
    entry!(
        filtered_normals,
        FilteredNormals,
        "FilteredNormals(engine: Harmonics)",
        "FilteredNormals(signal: Irradiance)"
    ),
    entry!(
        layered,
        Layered,
        "Layered(samples: 4)",
        "Layered(samples: 10, march: Uniform)",
        "Layered(samples: 50, march: Uniform)",
        "Layered(samples: 100, march: Uniform)",
        "Layered(refract: false)",
        "Layered(multiple: true)"
    ),
    entry!(
        long_range,
        LongRange,
        "LongRange(layers: 6)",
        "LongRange(splats: 500)",
        "LongRange(splats: 8000)",
        "LongRange(brighten: Paper)"
    ),
    entry!(screen_space, ScreenSpace, "ScreenSpace(layers: 6)", "ScreenSpace(n_l: 8)", "ScreenSpace(brighten: Paper)"),
    Entry {
        name: "SphericalThickness",
        manual: include_str!("spherical_thickness/mod.rs"),
        sweep: &[
            "SphericalThickness(bands: 2)",
            "SphericalThickness(bands: 3)",
            "SphericalThickness(bands: 4)",
            "SphericalThickness(bands: 6)",
            "SphericalThickness(bands: 7)",
            "SphericalThickness(bands: 8)",
            "SphericalThickness(front_bands: 5)",
            "SphericalThickness(encode: Thickness)",
            "SphericalThickness(bands: 2, encode: Thickness)",
            "SphericalThickness(attenuation: Beer)",
            "SphericalThickness(bands: 2, attenuation: Beer)",
            "SphericalThickness(attenuation: Beer, encode: Thickness)",
            "SphericalThickness(bands: 2, attenuation: Beer, encode: Thickness)",
            "SphericalThickness(attenuation: Linear)",
            "SphericalThickness(bands: 2, attenuation: Linear)",
            "SphericalThickness(attenuation: Linear, encode: Thickness)",
            "SphericalThickness(bands: 2, attenuation: Linear, encode: Thickness)",
            "SphericalThickness(attenuation: Linear, encode: Thickness, terms: Paper)",
            "SphericalThickness(window: 1)",
        ],
        read: SphericalThickness::read,
    },
    Entry {
        name: "DepthMapThickness",
        manual: include_str!("depth_map_thickness/mod.rs"),
        sweep: &[
            "DepthMapThickness(blur: 0.5)",
            "DepthMapThickness(blur: 2)",
            "DepthMapThickness(attenuation: Beer)",
            "DepthMapThickness(attenuation: Linear, terms: Paper)",
        ],
        read: DepthMapThickness::read,
    },
    Entry {
        name: Reference::NAME,
        manual: include_str!("reference.rs"),
        sweep: &[],
        // It has no part in a frame: see `way`.
        read: |text| Reference::of(text).and_then(|_| Err(Reference::only_in_the_view(text))),
    },
];

/// Techniques that a scene may name one day.
const LATER: [&str; 6] = [
    "PrecomputedTransfer",
    "DeepScreenSpace",
    "MultiresolutionSplatting",
    "SeparableScreenSpace",
    "AdjacencyMaps",
    "Auto",
];

/// The technique that an object or a flag names, with its settings read.
pub fn read(text: &TechniqueText) -> Result<Box<dyn Technique>, Problem> {
    match REGISTRY.iter().find(|entry| entry.name == text.name) {
        Some(entry) => (entry.read)(text),
        None => Err(match not_in_this_version(&text.name) {
            Some((what, hint)) => text.problem("", what).hint(hint),
            None => text.unknown(&REGISTRY.iter().map(|entry| entry.name).collect::<Vec<_>>()),
        }),
    }
}

/// Who makes a view's pictures.
pub enum Way {
    /// They are drawn, by this technique where an object names none.
    Drawn(Box<dyn Technique>),
    /// The whole scene is traced.
    Traced(Reference),
}

/// What a view's technique comes to, with its settings read.
pub fn way(text: &TechniqueText) -> Result<Way, Problem> {
    match Reference::of(text)? {
        Some(reference) => Ok(Way::Traced(reference)),
        None => read(text).map(Way::Drawn),
    }
}

/// What to say of a technique that is known and not there yet, and which ones there are.
pub fn not_in_this_version(name: &str) -> Option<(String, String)> {
    let name = LATER.iter().find(|later| later.eq_ignore_ascii_case(name))?;
    let names: Vec<&str> = REGISTRY.iter().map(|entry| entry.name).collect();
    let version = env!("CARGO_PKG_VERSION");
    Some((format!("the technique {name} is not in this version ({version})"), format!("there is {}", names.join(", "))))
}

impl Entry {
    /// The manual as text: the module's header without its comment marks.
    pub fn manual_text(&self) -> String {
        let header = self.manual.lines().take_while(|line| line.starts_with("//!"));
        header.map(|line| line.trim_start_matches("//!").strip_prefix(' ').unwrap_or("").to_string() + "\n").collect()
    }

    /// The manual's first line.
    pub fn summary(&self) -> String {
        self.manual_text().lines().next().unwrap_or_default().to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_technique_has_a_manual_and_reads_without_settings() {
        for entry in REGISTRY {
            assert!(entry.manual_text().lines().count() > 10, "{} has no manual", entry.name);
            let text = TechniqueText::from_flag("--technique", &format!("{}()", entry.name)).unwrap();
            assert!(read(&text).is_ok() || Reference::of(&text).unwrap().is_some());
            let text = TechniqueText::from_flag("--technique", &format!("{}(oops: 1)", entry.name)).unwrap();
            assert!(read(&text).err().unwrap().what.contains("oops"));
            for setting in entry.sweep {
                let text = TechniqueText::from_flag("--technique", setting).unwrap();
                assert!(read(&text).is_ok() && text.name == entry.name, "{setting}");
            }
        }
    }

    #[test]
    fn numbers_that_mean_nothing_are_told_at_their_place() {
        for (ron, path) in [
            ("SphericalThickness(bands: 9)", "bands"),
            ("SphericalThickness(front_bands: 0)", "front_bands"),
            ("SphericalThickness(max_thickness: 0)", "max_thickness"),
            ("SphericalThickness(window: -1)", "window"),
            ("DepthMapThickness(blur: -1)", "blur"),
            ("DepthMapThickness(max_thickness: -3)", "max_thickness"),
        ] {
            let text = TechniqueText::from_flag("--technique", ron).unwrap();
            let problem = read(&text).err().unwrap_or_else(|| panic!("{ron} is read"));
            assert_eq!(problem.path.as_deref(), Some(path), "{ron}: {problem}");
            assert!(problem.at.is_some_and(|at| at.column > ron.find(path).unwrap()) && problem.hint.is_some());
        }
    }

    #[test]
    fn a_name_that_is_not_there_brings_the_nearest_one() {
        let text = TechniqueText::from_flag("--technique", "FilterdNormals()").unwrap();
        assert!(read(&text).err().unwrap().hint.unwrap().contains("FilteredNormals"));
    }
}
