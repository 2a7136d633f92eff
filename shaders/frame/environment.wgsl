// What the surroundings send to each vertex, where the objects let it through: the visible directions are summed up,
// each with its share of the sky, for the vertex's own scattering normal.

#include "lib/element.wgsl"
#include "optics/fresnel.wgsl"

struct Vertices {
    world_from_object: mat4x4f, // a rotation
    eta: f32,
    words: u32,
}

struct Direction {
    // World space.
    direction: vec3f,
    // Radiance times solid angle.
    light: vec3f,
}

@group(0) @binding(0) var<uniform> vertices: Vertices;
@group(0) @binding(1) var<storage, read> normals: array<f32>;
@group(0) @binding(2) var<storage, read> directions: array<Direction>;
#if OCCLUDED
@group(0) @binding(3) var<storage, read> visible: array<u32>;
#endif
@group(0) @binding(4) var<storage, read_write> irradiance: array<vec4f>;

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3u) {
    let i = element(id);
    if i >= arrayLength(&irradiance) {
        return;
    }
    let stored = vec3f(normals[3u * i], normals[3u * i + 1u], normals[3u * i + 2u]);
    let normal = (vertices.world_from_object * vec4f(stored, 0.0)).xyz;
    let inverse_length = 1.0 / max(length(normal), 1e-20);
    var sum = vec3f(0.0);
    for (var k = 0u; k < arrayLength(&directions); k++) {
#if OCCLUDED
        let bits = visible[i * vertices.words + (k >> 5u)];
        if (bits & (1u << (k & 31u))) == 0u {
            continue;
        }
#endif
        // A filtered normal may be shorter than 1: it dims, and points where it points.
        let cos_length = dot(normal, directions[k].direction);
        if cos_length > 0.0 {
            let enters = 1.0 - fresnel_dielectric(min(1.0, cos_length * inverse_length), vertices.eta);
            sum += cos_length * enters * directions[k].light;
        }
    }
    irradiance[i] = vec4f(sum, 0.0);
}
