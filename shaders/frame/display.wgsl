// From linear radiance to what a display is sent; `src/image/tone.rs` is the same in Rust and says where the curves are from.

#include "lib/fullscreen.wgsl"

struct Display {
    gain: f32,
    tone: u32,
}

const CLAMP = 0u;
const SRGB = 1u;

@group(0) @binding(0) var<uniform> display: Display;
@group(0) @binding(1) var picture: texture_2d<f32>;

// The sRGB transfer function of a value in [0, 1].
fn srgb_from_linear(linear: vec3f) -> vec3f {
    return select(1.055 * pow(linear, vec3f(1.0 / 2.4)) - 0.055, 12.92 * linear, linear <= vec3f(0.0031308));
}

fn neutral(radiance: vec3f) -> vec3f {
    const F90 = 0.04;
    const START = 0.8 - F90;
    const DESATURATION = 0.15;
    let rgb = min(radiance, vec3f(1e30));
    let low = min(rgb.r, min(rgb.g, rgb.b));
    let veil = select(F90, low - low * low / (4.0 * F90), low < 2.0 * F90);
    let clear = rgb - veil;
    let peak = max(clear.r, max(clear.g, clear.b));
    if peak < START {
        return clear;
    }
    let shoulder = 1.0 - START;
    let compressed = 1.0 - shoulder * shoulder / (peak + shoulder - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    return min(mix(clear * (compressed / peak), vec3f(compressed), white), vec3f(1.0));
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let radiance = textureLoad(picture, vec2i(at.xy), 0).rgb;
    // A pixel that is no number is seen at once. Comparisons may assume that there are none; bits do not.
    if any((bitcast<vec3u>(radiance) & vec3u(0x7f800000u)) == vec3u(0x7f800000u)) {
        return vec4f(1.0, 0.0, 1.0, 1.0);
    }
    let exposed = max(radiance * display.gain, vec3f(0.0));
    if display.tone == CLAMP {
        return vec4f(min(exposed, vec3f(1.0)), 1.0);
    }
    if display.tone == SRGB {
        return vec4f(srgb_from_linear(min(exposed, vec3f(1.0))), 1.0);
    }
    return vec4f(srgb_from_linear(neutral(exposed)), 1.0);
}
