// Of each of four of the sky's lamps, the share that reaches each vertex: what lies above its horizon, past the things in
// the way.

#include "lib/element.wgsl"

struct Quad {
    world_from_object: mat4x4f, // a rotation
    // The first of the four.
    first: u32,
}

struct Direction {
    direction: vec3f,
    light: vec3f,
}

@group(0) @binding(0) var<uniform> quad: Quad;
@group(0) @binding(1) var<storage, read> directions: array<Direction>;
// The lamp that stands for each direction.
@group(0) @binding(2) var<storage, read> lamp_of: array<u32>;
#if OCCLUDED
@group(0) @binding(3) var<storage, read> visible: array<u32>;
#endif
@group(0) @binding(4) var<storage, read> normals: array<f32>;
@group(0) @binding(5) var<storage, read_write> share: array<vec4f>;

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3u) {
    let i = element(id);
    if i >= arrayLength(&share) {
        return;
    }
    let count = arrayLength(&directions);
    let stored = vec3f(normals[3u * i], normals[3u * i + 1u], normals[3u * i + 2u]);
    let normal = (quad.world_from_object * vec4f(stored, 0.0)).xyz;
    var seen = vec4f(0.0);
    var all = vec4f(0.0);
    for (var k = 0u; k < count; k++) {
        let weight = dot(directions[k].light, vec3f(1.0));
        let of_lamp = select(vec4f(0.0), vec4f(weight), vec4u(quad.first) + vec4u(0u, 1u, 2u, 3u) == vec4u(lamp_of[k]));
        all += of_lamp;
        if dot(normal, directions[k].direction) <= 0.0 {
            continue;
        }
#if OCCLUDED
        let bits = visible[i * ((count + 31u) >> 5u) + (k >> 5u)];
        seen += select(vec4f(0.0), of_lamp, (bits & (1u << (k & 31u))) != 0u);
#else
        seen += of_lamp;
#endif
    }
    share[i] = select(vec4f(0.0), seen / all, all > vec4f(0.0));
}
