// What one lamp sends through an object to each of its vertices: irradiance times what is left of it [Tomaszewska2012].
//
// Everything is in the object's space. Values are linear in the coefficients, so that interpolating them over a triangle is
// interpolating the coefficients, at the price of a vertex instead of a pixel.

#include "lib/element.wgsl"
#include "optics/sh.wgsl"
#include "frame/lights.wgsl"
#include "techniques/transmittance.wgsl"
#if SHADOWS
#include "frame/others.wgsl"
#endif

struct Series {
    // What bands 0 to 3 and 4 to 7 are multiplied with: the window, and what light from this side needs.
    low: vec4f,
    high: vec4f,
    // Those that are evaluated.
    bands: u32,
    // Of halves, per vertex and channel.
    words: u32,
}

@group(0) @binding(0) var<uniform> series: Series;
@group(0) @binding(1) var<uniform> lamp: Light;
@group(0) @binding(2) var<storage, read> positions: array<f32>;
@group(0) @binding(3) var<storage, read> normals: array<f32>;
@group(0) @binding(4) var<storage, read> coefficients: array<u32>;
#if MORE
// Of other lamps.
@group(0) @binding(5) var<storage, read> before: array<vec4f>;
#endif
@group(0) @binding(6) var<storage, read_write> through: array<vec4f>;

// The harmonics of one direction, weighted.
var<private> basis: array<f32, 64>;

fn weigh(direction: vec3f) {
    basis = sh_basis_8(direction.x, direction.y, direction.z);
    var weights = array<f32, 8>(
        series.low.x, series.low.y, series.low.z, series.low.w,
        series.high.x, series.high.y, series.high.z, series.high.w,
    );
    for (var i = 0u; i < 64u; i++) {
        basis[i] *= weights[u32(sqrt(f32(i) + 0.5))];
    }
}

fn sum(first: u32) -> f32 {
    var value = 0.0;
    let pairs = (series.bands * series.bands + 1u) / 2u;
    for (var pair = 0u; pair < pairs; pair++) {
        value += dot(unpack2x16float(coefficients[first + pair]), vec2f(basis[2u * pair], basis[2u * pair + 1u]));
    }
    return value;
}

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3u) {
    let i = element(id);
    if i >= arrayLength(&through) {
        return;
    }
    let position = vec3f(positions[3u * i], positions[3u * i + 1u], positions[3u * i + 2u]);
    let normal = vec3f(normals[3u * i], normals[3u * i + 1u], normals[3u * i + 2u]);
    var light = vec3f(0.0);
    for (var s = 0; s < light_samples(lamp); s++) {
        let light_in = incident(lamp, s, position);
        // A lamp in the surface itself sends nothing through.
        if !(light_in.distance > 0.0) {
            continue;
        }
        weigh(light_in.direction);
#if BALANCED
        // No series may say that more comes through than arrives.
        let most = behind(dot(normal, light_in.direction));
#else
        let most = 1.0;
#endif
#if THICKNESS
        var left = most * transmittance(max(0.0, sum(i * series.words)));
#else
        var found = vec3f(0.0);
        for (var channel = 0u; channel < 3u; channel++) {
            found[channel] = sum((3u * i + channel) * series.words);
        }
        var left = clamp(found, vec3f(0.0), vec3f(most));
#endif
#if SHADOWS
        left *= past_others(position, s);
#endif
        light += left * light_in.irradiance;
    }
#if MORE
    light += before[i].rgb;
#endif
    through[i] = vec4f(light, 0.0);
}
