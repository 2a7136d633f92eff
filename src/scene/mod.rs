//! Scenes and materials: RON text into a [`Scene`], which is valid when there is one.
//!
//! The only room that knows RON. A text becomes a [`tree`] in which every value knows its place; `base:` and `--set`
//! change the tree; [`de`] reads the schema ([`scene_file`], [`material_file`]) from it; what the values mean is judged
//! all at once ([`meaning`], [`build`], [`material`], [`warn`]). The tour of a read is [`Reader::scene`].
//!
//! Lengths of scenes are scene units, those of materials mm; angles are degrees and say so; all numbers are f64. Every
//! type here is `Serialize`, so that what depends on it can be named by its hash; file contents stand as their [`Key`].

mod bench_file;
mod build;
mod de;
mod document;
mod fields;
mod material;
mod material_file;
mod meaning;
mod medium;
mod outside;
mod path;
mod reader;
mod scalar;
mod scene_file;
pub mod shape;
mod technique;
mod tree;
mod warn;

#[cfg(test)]
mod tests;

pub use bench_file::{BenchSettings, Truth, beside as bench_beside};
pub use document::Kind;
pub use fields::Triple;
pub use material::{AsNumber, Layer, Material, Surface, TextureMap, Varying};
pub use material_file::{
    BoxKernel, Curve, Diffusion, Exponential, Filter, FromMedium, Gaussian, Length, Neighbours, Normalized, Weights,
};
pub use medium::{MediumSpec, Substance};
pub use outside::{Channel, Encoding, Mesh, Texture, Tone};
pub use reader::Reader;
pub use technique::TechniqueText;

use crate::store::Key;
use glam::{DAffine3, DQuat, DVec3, EulerRot};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Things, their light, and how they are looked at unless the command line says otherwise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scene {
    pub mm_per_unit: f64,
    pub camera: Camera,
    pub bookmarks: BTreeMap<String, Camera>,
    pub lights: Vec<Light>,
    pub objects: Vec<Object>,
    pub view: ViewSettings,
    pub reference: ReferenceSettings,
}

/// A pinhole.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Camera {
    pub eye: DVec3,
    pub target: DVec3,
    /// Not parallel to the view; need not be unit or square to it.
    pub up: DVec3,
    /// The full vertical angle.
    pub fov_y_deg: f64,
}

impl Default for Camera {
    fn default() -> Camera {
        Camera { eye: DVec3::new(0.0, 0.0, 5.0), target: DVec3::ZERO, up: DVec3::Y, fov_y_deg: 30.0 }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Light {
    pub name: String,
    /// Whether objects are in its way.
    pub shadow: bool,
    pub enabled: bool,
    pub kind: LightKind,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum LightKind {
    /// `direction` is the way light travels, unit length; `irradiance` in W/m² on a plane facing it.
    Directional { direction: DVec3, irradiance: DVec3 },
    /// W/sr; its falloff counts scene units.
    Point { position: DVec3, intensity: DVec3 },
    /// `u` and `v` are half-edges; emits to the side of cross(u, v); reflects nothing, blocks light.
    Rect { center: DVec3, u: DVec3, v: DVec3, radiance: DVec3 },
    /// From everywhere. An image's centre lies at -z and its right half towards +x, before it is turned about y, the way
    /// an object turns: by 90 degrees from -z to -x.
    Environment { sky: Sky, scale: f64, rotation_deg: f64 },
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum Sky {
    Constant(DVec3),
    /// Latitude-longitude.
    Image(Arc<TextureMap>),
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Object {
    pub name: String,
    pub mesh: MeshSource,
    pub material: Arc<Material>,
    pub transform: Transform,
    pub normals: Normals,
    pub visible: bool,
    /// In the order in which they are applied, in the object's own space.
    pub deform: Vec<Deform>,
    /// In place of the view's.
    pub technique: Option<TechniqueText>,
}

/// Lengths in the object's own space.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum MeshSource {
    File {
        path: PathBuf,
        key: Key,
        #[serde(skip)]
        mesh: Arc<Mesh>,
    },
    /// 20 · 4^subdivisions faces
    Sphere {
        radius: f64,
        subdivisions: u32,
    },
    Box {
        size: DVec3,
    },
    Torus {
        radius: f64,
        tube: f64,
        segments: (u32, u32),
    },
    TorusKnot {
        p: u32,
        q: u32,
        radius: f64,
        tube: f64,
        segments: (u32, u32),
    },
    /// `segments` are the cells along x and y
    Slab {
        size: DVec3,
        segments: (u32, u32),
    },
    Sculpture {
        figure: Figure,
        height: f64,
        detail: u32,
    },
}

/// What the project has sculpted itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Figure {
    Hare,
    Bust,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Normals {
    /// The file's, else smooth.
    Auto,
    Smooth {
        #[serde(default = "default_crease")]
        crease_deg: f64,
    },
    Flat,
}

fn default_crease() -> f64 {
    60.0
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Deform {
    /// Turns each point about an axis through the origin, by its height along the axis and with time.
    Twist {
        #[serde(default = "default_axis")]
        axis: DVec3,
        #[serde(default)]
        deg_per_unit: f64,
        #[serde(default)]
        speed_hz: f64,
    },
}

fn default_axis() -> DVec3 {
    DVec3::Y
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Transform {
    pub translate: DVec3,
    /// About the fixed x, then y, then z axis.
    pub rotate_deg: DVec3,
    pub scale: DVec3,
}

impl Transform {
    /// Scale, then rotation, then translation.
    pub fn world_from_object(&self) -> DAffine3 {
        let [x, y, z] = self.rotate_deg.to_array().map(f64::to_radians);
        // Turning about fixed x, y, z is turning about moving z, y, x.
        let rotation = DQuat::from_euler(EulerRot::ZYX, z, y, x);
        DAffine3::from_scale_rotation_translation(self.scale, rotation, self.translate)
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ViewSettings {
    pub technique: TechniqueText,
    /// Width and height, pixels.
    pub size: (u32, u32),
    pub exposure_ev: f64,
    pub tone: Tone,
    pub time_s: f64,
    /// Samples per pixel and axis: 1, 2 or 4.
    pub antialias: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename = "Reference", default, deny_unknown_fields)]
pub struct ReferenceSettings {
    /// Relative standard error of the image at which it is good enough.
    pub max_error: f64,
    pub max_spp: u32,
    pub max_depth: u32,
    pub seed: u64,
}

impl Default for ReferenceSettings {
    fn default() -> ReferenceSettings {
        ReferenceSettings { max_error: 0.02, max_spp: 4096, max_depth: 512, seed: 1 }
    }
}

/// Which of its three summands a picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub enum Part {
    #[default]
    Full,
    /// Entered, scattered at least once, left.
    Scattered,
    /// Reflected at the boundary.
    Glossy,
    /// Passed through without scattering; what is seen of the surroundings and of lights.
    Unscattered,
}

impl Part {
    pub fn has(self, part: Part) -> bool {
        self == Part::Full || self == part
    }
}
