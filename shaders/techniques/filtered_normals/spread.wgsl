// Filtered light at each vertex: its modes, and what they miss.

#include "lib/element.wgsl"

const NOWHERE: u32 = 0xffffffffu;

// The sample of each vertex.
@group(0) @binding(0) var<storage, read> vertices: array<u32>;
@group(0) @binding(1) var<storage, read> modes: array<u32>;
@group(0) @binding(2) var<storage, read> coefficients: array<vec4f>;
@group(0) @binding(3) var<storage, read> irradiance: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> filtered: array<vec4f>;

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3u) {
    let i = element(id);
    if i >= arrayLength(&filtered) {
        return;
    }
    let sample = vertices[i];
    if sample == NOWHERE {
        filtered[i] = vec4f(0.0);
        return;
    }
    let count = arrayLength(&coefficients) - 1u;
    let pairs = (count + 1u) / 2u;
    // Not the length of the areas: of a buffer that may hold vertices, too, it counts a word that is not there.
    let stride = arrayLength(&modes) / pairs;
    var sum = coefficients[0].rgb * irradiance[sample].rgb;
    for (var p = 0u; p < pairs; p++) {
        let values = unpack2x16float(modes[p * stride + sample]);
        sum += values.x * coefficients[2u * p + 1u].rgb;
        // The last pair may be half of one.
        sum += values.y * coefficients[min(2u * p + 2u, count)].rgb;
    }
    filtered[i] = vec4f(sum, 0.0);
}
