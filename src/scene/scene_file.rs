//! The schema of a scene file, with its defaults: what may be written, before anything is known of what it means.

use crate::scene::fields::{Raw, Triple};
use crate::scene::outside::Tone;
use crate::scene::{Camera, Deform, Figure, Normals, ReferenceSettings};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename = "Scene", deny_unknown_fields)]
pub struct SceneFile {
    pub version: u32,
    pub mm_per_unit: f64,
    #[serde(default)]
    pub camera: Camera,
    #[serde(default)]
    pub bookmarks: BTreeMap<String, Camera>,
    #[serde(default)]
    pub lights: Vec<LightSpec>,
    #[serde(default)]
    pub objects: Vec<ObjectSpec>,
    #[serde(default)]
    pub view: ViewSpec,
    #[serde(default)]
    pub reference: ReferenceSettings,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightSpec {
    Directional(DirectionalSpec),
    Point(PointSpec),
    Rect(RectSpec),
    Environment(EnvironmentSpec),
}

macro_rules! spec {
    ($(#[$meta:meta])* $name:ident as $word:literal {
        $($(#[$field_meta:meta])* $field:ident: $type:ty = $default:expr),* $(,)?
    }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(rename = $word, default, deny_unknown_fields)]
        pub struct $name {
            $($(#[$field_meta])* pub $field: $type),*
        }
        impl Default for $name {
            fn default() -> $name {
                $name { $($field: $default),* }
            }
        }
    };
}

/// Without the `Some` that nobody writes.
fn bare<S: serde::Serializer>(raw: &Option<Raw>, serializer: S) -> Result<S::Ok, S::Error> {
    match raw {
        Some(raw) => raw.serialize(serializer),
        None => serializer.serialize_none(),
    }
}

spec! { DirectionalSpec as "Directional" {
    name: Option<String> = None,
    direction: DVec3 = DVec3::NEG_Y,
    irradiance: Triple = Triple::all(1.0),
    shadow: bool = true,
    enabled: bool = true,
} }
spec! { PointSpec as "Point" {
    name: Option<String> = None,
    position: DVec3 = DVec3::Y,
    intensity: Triple = Triple::all(1.0),
    shadow: bool = true,
    enabled: bool = true,
} }
spec! { RectSpec as "Rect" {
    name: Option<String> = None,
    center: DVec3 = DVec3::Y,
    u: DVec3 = DVec3::X,
    v: DVec3 = DVec3::Z,
    radiance: Triple = Triple::all(1.0),
    shadow: bool = true,
    enabled: bool = true,
} }
spec! { EnvironmentSpec as "Environment" {
    name: Option<String> = None,
    image: Option<String> = None,
    radiance: Option<Triple> = None,
    scale: f64 = 1.0,
    rotation_deg: f64 = 0.0,
    shadow: bool = true,
    enabled: bool = true,
} }
spec! { ObjectSpec as "Object" {
    name: Option<String> = None,
    mesh: Option<MeshSpec> = None,
    material: Option<String> = None,
    transform: TransformSpec = TransformSpec::default(),
    normals: Normals = Normals::Auto,
    visible: bool = true,
    deform: Vec<Deform> = Vec::new(),
    #[serde(serialize_with = "bare")]
    technique: Option<Raw> = None,
} }
spec! { TransformSpec as "Transform" {
    translate: DVec3 = DVec3::ZERO,
    rotate_deg: DVec3 = DVec3::ZERO,
    scale: Triple = Triple::all(1.0),
} }
spec! { ViewSpec as "View" {
    technique: Raw = Raw("FilteredNormals()".to_string()),
    size: (u32, u32) = (960, 540),
    exposure_ev: f64 = 0.0,
    tone: Tone = Tone::Srgb,
    time_s: f64 = 0.0,
    antialias: u32 = 2,
} }

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum MeshSpec {
    File(String),
    Sphere(SphereSpec),
    Box(BoxSpec),
    Torus(TorusSpec),
    TorusKnot(TorusKnotSpec),
    Slab(SlabSpec),
    Sculpture(SculptureSpec),
}

spec! { SphereSpec as "Sphere" { radius: f64 = 1.0, subdivisions: u32 = 5 } }
spec! { BoxSpec as "Box" { size: Triple = Triple::all(1.0) } }
spec! { TorusSpec as "Torus" { radius: f64 = 1.0, tube: f64 = 0.4, segments: (u32, u32) = (128, 48) } }
spec! { TorusKnotSpec as "TorusKnot" {
    p: u32 = 2,
    q: u32 = 3,
    radius: f64 = 1.0,
    tube: f64 = 0.3,
    segments: (u32, u32) = (384, 48),
} }
spec! { SlabSpec as "Slab" { size: Triple = Triple::all(1.0), segments: (u32, u32) = (32, 32) } }
spec! { SculptureSpec as "Sculpture" { figure: Figure = Figure::Hare, height: f64 = 1.0, detail: u32 = 190 } }
