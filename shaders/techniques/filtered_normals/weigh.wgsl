// The coefficients of light, each mode's with its weight per channel. The first is the weight of what all modes miss.

#include "lib/element.wgsl"

struct Pair {
    even: vec4f,
    odd: vec4f,
}

@group(0) @binding(0) var<storage, read> table: array<vec4f>;
@group(0) @binding(1) var<storage, read> areas: array<f32>;
@group(0) @binding(2) var<storage, read> partials: array<Pair>;
@group(0) @binding(3) var<storage, read_write> coefficients: array<vec4f>;

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3u) {
    let i = element(id);
    if i >= arrayLength(&coefficients) {
        return;
    }
    let entry = table[i];
    if i == 0u {
        coefficients[0] = entry;
        return;
    }
    let mode = i - 1u;
    let parts = arrayLength(&areas) / 64u;
    var sum = vec3f(0.0);
    for (var p = 0u; p < parts; p++) {
        let pair = partials[(mode / 2u) * parts + p];
        sum += select(pair.even.rgb, pair.odd.rgb, mode % 2u == 1u);
    }
    coefficients[i] = vec4f(entry.rgb * entry.w * sum, 0.0);
}
