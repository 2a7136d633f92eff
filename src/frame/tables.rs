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
        pub distance: f32,
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
    pub struct OthersView {
        pub clip_from_object: Mat4,
        pub per_sample: u32,
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

uniform! {
    pub struct Display {
        /// 2 to the power of the exposure.
        pub gain: f32,
        pub tone: u32,
    }
}

pub const CLAMP: u32 = 0;
pub const SRGB: u32 = 1;
pub const FILMIC: u32 = 2;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{Shaders, Uniform};
    use std::collections::BTreeSet;
    use std::sync::Arc;

    /// What the shaders say of a struct, wherever one of them has it: name, size, and every field's name and offset.
    type Layout = (String, u32, Vec<(String, u32)>);

    fn of<T: Uniform + encase::ShaderSize>(name: &str) -> Layout {
        let fields = T::fields().into_iter().map(|(field, offset)| (field.to_string(), offset)).collect();
        (name.to_string(), T::SHADER_SIZE.get() as u32, fields)
    }

    fn in_shaders() -> BTreeSet<Layout> {
        let shaders = Shaders::new(None, Arc::default());
        let mut found = BTreeSet::new();
        for name in Shaders::names() {
            let shader = shaders.load(name, &[]).unwrap_or_else(|problem| panic!("{problem}"));
            for (_, kind) in shader.module.types.iter() {
                if let (Some(name), naga::TypeInner::Struct { members, span }) = (&kind.name, &kind.inner) {
                    let fields = members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset)).collect();
                    found.insert((name.clone(), *span, fields));
                }
            }
        }
        found
    }

    #[test]
    fn structs_lie_where_the_shaders_look_for_their_fields() {
        macro_rules! layouts {
            ($($name:ident),*) => { vec![$(of::<$name>(stringify!($name))),*] };
        }
        let ours = layouts![
            Camera, Object, Light, Caster, ShadowView, OthersView, Views, Vertices, Direction, Sky, Resolve, Display
        ];
        let declared = include_str!("tables.rs").matches("uniform! {").count() - 1; // this line is one more
        assert_eq!(ours.len(), declared, "a struct is missing in the list above");
        let theirs = in_shaders();
        for layout in &ours {
            let same_name: Vec<_> = theirs.iter().filter(|other| other.0 == layout.0).collect();
            assert_eq!(same_name, [layout], "program (right) and shaders (left)");
        }
        // A field that moves is noticed.
        let mut moved = of::<Light>("Light");
        moved.2.swap(4, 5);
        assert!(!theirs.contains(&moved));
    }
}
