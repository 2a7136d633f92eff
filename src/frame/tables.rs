//! The structs that the frame's shaders read; `shaders/frame/scene.wgsl` and its neighbours spell the same.

use crate::uniform;
use glam::{Mat4, Vec3};

uniform! {
    pub struct Camera {
        pub clip_from_eye: Mat4,
        pub forward: Vec3,
        pub width: f32,
        pub right: Vec3,
        pub height: f32,
        pub up: Vec3,
        pub pixel: f32,
    }
}

uniform! {
    pub struct Object {
        pub eye_from_object: Mat4,
        pub color: Vec3,
        pub roughness: f32,
        pub scatter: Vec3,
        pub eta: f32,
        pub emission: Vec3,
        pub entry: f32,
        pub sigma_t: Vec3,
        pub color_layer: i32,
        pub roughness_layer: i32,
        pub flags: u32,
    }
}

pub const TRANSLUCENT: u32 = 1;
pub const EMITTER: u32 = 2;

uniform! {
    pub struct Light {
        pub position: Vec3,
        pub kind: u32,
        pub power: Vec3,
        pub visibility: i32,
        pub u: Vec3,
        pub v: Vec3,
    }
}

uniform! {
    pub struct Caster {
        pub clip_from_object: Mat4,
    }
}

uniform! {
    pub struct ShadowView {
        pub clip_from_eye: Mat4,
        pub texel: f32,
        pub is_directional: u32,
    }
}

uniform! {
    pub struct Views {
        pub light: u32,
        pub per_sample: u32,
    }
}

uniform! {
    pub struct Vertices {
        pub world_from_object: Mat4,
        pub eta: f32,
        pub words: u32,
    }
}

uniform! {
    pub struct Direction {
        pub direction: Vec3,
        pub light: Vec3,
    }
}

uniform! {
    pub struct Sky {
        pub radiance: Vec3,
        pub rotation: f32,
    }
}

uniform! {
    pub struct Resolve {
        pub samples: u32,
    }
}
