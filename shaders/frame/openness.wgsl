// How much of the sky is seen from each vertex, as a function of direction: real spherical harmonics of bands 0 and 1
// of its visibility. Reflections of the surroundings are dimmed by it.

#include "lib/element.wgsl"

struct Direction {
    direction: vec3f,
    light: vec3f,
}

@group(0) @binding(0) var<storage, read> directions: array<Direction>;
@group(0) @binding(1) var<storage, read> visible: array<u32>;
@group(0) @binding(2) var<storage, read_write> openness: array<vec4f>;

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3u) {
    let i = element(id);
    if i >= arrayLength(&openness) {
        return;
    }
    let count = arrayLength(&directions);
    var sum = vec4f(0.0);
    for (var k = 0u; k < count; k++) {
        if (visible[i * ((count + 31u) >> 5u) + (k >> 5u)] & (1u << (k & 31u))) != 0u {
            sum += vec4f(1.0, directions[k].direction);
        }
    }
    // Band 0 is 1/(4 pi) of the integral, band 1 is 3/(4 pi): mean and three times the mean direction.
    openness[i] = vec4f(1.0, 3.0, 3.0, 3.0) * sum / f32(count);
}
