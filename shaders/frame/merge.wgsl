// Two techniques in one picture: each is 0 where the other's objects are.

#include "lib/fullscreen.wgsl"

@group(0) @binding(0) var one: texture_2d<f32>;
@group(0) @binding(1) var other: texture_2d<f32>;

@fragment
fn fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    return textureLoad(one, pixel, 0) + textureLoad(other, pixel, 0);
}
