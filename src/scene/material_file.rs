//! The schema of a material file, with its defaults. Lengths are millimetres, coefficients 1/mm.

use crate::optics::phase::Phase;
use crate::optics::profile::Model;
use crate::scene::fields::{Spec, Triple};
use crate::scene::medium::MediumSpec;
use serde::{Deserialize, Serialize};

/// Every field may be left out, since a `base` may give it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename = "Material", default, deny_unknown_fields)]
pub struct MaterialFile {
    pub version: u32,
    pub base: Option<String>,
    pub surface: SurfaceSpec,
    pub medium: MediumSpec,
    /// The medium's own when it is left out.
    pub phase: Option<Phase>,
    pub profile: Model,
    pub filter: Filter,
    pub layers: Vec<LayerSpec>,
}

impl Default for MaterialFile {
    fn default() -> MaterialFile {
        MaterialFile {
            version: 1,
            base: None,
            surface: SurfaceSpec::default(),
            medium: MediumSpec::Preset("marble".to_string()),
            phase: None,
            profile: Model::default(),
            filter: Filter::default(),
            layers: Vec::new(),
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename = "Surface", default, deny_unknown_fields)]
pub struct SurfaceSpec {
    /// The medium's own when it is left out.
    pub ior: Option<f64>,
    pub roughness: Spec<f64>,
    pub color: Spec<Triple>,
}

impl Default for SurfaceSpec {
    fn default() -> SurfaceSpec {
        SurfaceSpec { ior: None, roughness: Spec::Constant(0.2), color: Spec::Constant(Triple::all(1.0)) }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename = "Layer", default, deny_unknown_fields)]
pub struct LayerSpec {
    pub name: Option<String>,
    pub medium: MediumSpec,
    /// The material's when it is left out.
    pub phase: Option<Phase>,
    /// Where the layer ends, mm below the surface.
    pub depth: Spec<f64>,
}

impl Default for LayerSpec {
    fn default() -> LayerSpec {
        let medium = MediumSpec::Preset("marble".to_string());
        LayerSpec { name: None, medium, phase: None, depth: Spec::Constant(1.0) }
    }
}

/// Whether a filtered normal keeps its length, and so dims as diffusion does, or is made unit again [Patro2007].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Length {
    #[default]
    Keep,
    Unit,
}

/// The share of each neighbour [Patro2007, eq. 3].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Weights {
    /// Its vertex area: another triangulation gives the same field.
    #[default]
    Area,
    /// One each, as printed.
    Uniform,
}

macro_rules! kernel {
    ($(#[$meta:meta])* $name:ident as $word:literal { $($(#[$field_meta:meta])* $field:ident: $type:ty = $default:expr),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(rename = $word, default, deny_unknown_fields)]
        pub struct $name {
            $($(#[$field_meta])* pub $field: $type,)*
            pub length: Length,
        }
        impl Default for $name {
            fn default() -> $name {
                $name { $($field: $default,)* length: Length::Keep }
            }
        }
    };
}

/// The kernel of filtered normals, as a function of the angular frequency omega, rad/mm, per channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Filter {
    Neighbours(Neighbours),
    Gaussian(Gaussian),
    Exponential(Exponential),
    Diffusion(Diffusion),
    Box(BoxKernel),
    Curve(Curve),
    Normalized(Normalized),
    FromMedium(FromMedium),
}

impl Default for Filter {
    fn default() -> Filter {
        Filter::FromMedium(FromMedium::default())
    }
}

impl Filter {
    pub fn length(&self) -> Length {
        match self {
            Filter::Neighbours(k) => k.length,
            Filter::Gaussian(k) => k.length,
            Filter::Exponential(k) => k.length,
            Filter::Diffusion(k) => k.length,
            Filter::Box(k) => k.length,
            Filter::Curve(k) => k.length,
            Filter::Normalized(k) => k.length,
            Filter::FromMedium(k) => k.length,
        }
    }
}

kernel! {
    /// The sum over neighbours [Patro2007, eq. 3].
    Neighbours as "Neighbours" {
        /// 1/mm
        sigma_tr: Triple = Triple::all(1.0),
        /// mm
        radius: f64 = 2.0,
        /// The share of the vertex's own normal, [0, 1].
        alpha: f64 = 0.3,
        weights: Weights = Weights::Area,
    }
}
kernel! {
    /// exp(-(omega width)² / 2)
    Gaussian as "Gaussian" {
        /// mm
        width: Triple = Triple::all(0.5),
    }
}
kernel! {
    /// exp(-omega width)
    Exponential as "Exponential" {
        /// mm
        width: Triple = Triple::all(0.5),
    }
}
kernel! {
    /// exp(-omega² time)
    Diffusion as "Diffusion" {
        time_mm2: Triple = Triple::all(0.1),
    }
}
kernel! {
    /// 1 below 2 pi / wavelength, else 0
    BoxKernel as "Box" {
        /// mm
        wavelength: Triple = Triple::all(2.0),
    }
}
kernel! {
    /// Straight lines between points; constant before the first and after the last.
    Curve as "Curve" {
        /// (omega in rad/mm, weight), omega ascending
        points: Vec<(f64, f64)> = vec![(0.0, 1.0), (4.0, 0.0)],
    }
}
kernel! {
    /// A Gaussian on the mesh-dependent axis of [Patro2007, section 4].
    Normalized as "Normalized" {
        std: Triple = Triple::all(0.25),
    }
}
kernel! {
    /// (1 + (omega / sigma_tr)²)^(-3/2), the transform of [Patro2007, eq. 3], with the medium's own sigma_tr.
    FromMedium as "FromMedium" {}
}
