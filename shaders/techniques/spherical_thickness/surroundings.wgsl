// What the surroundings send through an object to each of its vertices: the integral of radiance times transmittance is the
// inner product of their coefficients.

#include "lib/element.wgsl"

struct Stored {
    // Coefficients of each channel.
    count: u32,
    // Of halves, per vertex and channel.
    words: u32,
}

@group(0) @binding(0) var<uniform> stored: Stored;
@group(0) @binding(1) var<storage, read> coefficients: array<u32>;
// Radiance, in the object's space.
@group(0) @binding(2) var<storage, read> sky: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> through: array<vec4f>;

fn coefficient(first: u32, i: u32) -> f32 {
    let pair = unpack2x16float(coefficients[first + i / 2u]);
    return select(pair.x, pair.y, (i & 1u) == 1u);
}

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3u) {
    let vertex = element(id);
    if vertex >= arrayLength(&through) {
        return;
    }
    let first = 3u * vertex * stored.words;
    var light = vec3f(0.0);
    for (var i = 0u; i < stored.count; i++) {
        let left = vec3f(
            coefficient(first, i),
            coefficient(first + stored.words, i),
            coefficient(first + 2u * stored.words, i),
        );
        light += left * sky[i].rgb;
    }
    through[vertex] = vec4f(max(vec3f(0.0), light), 0.0);
}
