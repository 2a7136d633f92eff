// What light has of each mode, sum_s A_s E_s y_k(s), in parts of 64 samples and for two modes at a time: every sum has its
// own order, so that the same light always gives the same bits.

#include "lib/element.wgsl"

struct Pair {
    even: vec4f,
    odd: vec4f,
}

// Two halves a word: modes 2p and 2p + 1 of every sample, then the next two.
@group(0) @binding(0) var<storage, read> modes: array<u32>;
// 0 for samples that are not there.
@group(0) @binding(1) var<storage, read> areas: array<f32>;
@group(0) @binding(2) var<storage, read> irradiance: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> partials: array<Pair>;

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3u) {
    let i = element(id);
    if i >= arrayLength(&partials) {
        return;
    }
    let parts = arrayLength(&areas) / 64u;
    var even = vec3f(0.0);
    var odd = vec3f(0.0);
    for (var j = 0u; j < 64u; j++) {
        let sample = min((i % parts) * 64u + j, arrayLength(&irradiance) - 1u);
        let values = unpack2x16float(modes[i * 64u + j]);
        let light = areas[(i % parts) * 64u + j] * irradiance[sample].rgb;
        even += values.x * light;
        odd += values.y * light;
    }
    partials[i] = Pair(vec4f(even, 0.0), vec4f(odd, 0.0));
}
