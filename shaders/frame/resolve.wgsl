// The mean of a pixel's samples, linear.

#include "lib/fullscreen.wgsl"

struct Resolve {
    samples: u32,
}

@group(0) @binding(0) var<uniform> resolve: Resolve;
@group(0) @binding(1) var picture: texture_2d<f32>;

@fragment
fn fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let n = i32(resolve.samples);
    let corner = vec2i(at.xy) * n;
    var sum = vec4f(0.0);
    for (var i = 0; i < n * n; i++) {
        sum += textureLoad(picture, corner + vec2i(i % n, i / n), 0);
    }
    return sum / f32(n * n);
}
