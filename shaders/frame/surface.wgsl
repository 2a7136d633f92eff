// The G-buffer, read back.

#include "lib/octahedron.wgsl"

struct Seen {
    position: vec3f,
    // -1 where there is nothing.
    object: i32,
    normal: vec3f,
    flat_normal: vec3f,
    color: vec3f,
    roughness: f32,
}

fn seen(position: vec4f, packed: vec4u) -> Seen {
    let b_roughness = unpack2x16float(packed.w);
    return Seen(
        position.xyz,
        i32(position.w) - 1,
        unpack_direction(packed.x),
        unpack_direction(packed.y),
        vec3f(unpack2x16float(packed.z), b_roughness.x),
        b_roughness.y,
    );
}
