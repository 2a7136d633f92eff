// All that shines on a thing: lamps, and parts of the sky.

#include "frame/lights.wgsl"

// A part of the sky.
struct SkyLamp {
    direction: vec3f,
    // How far it reaches to either side, as a cosine.
    spread: f32,
    light: vec3f,
}

#if LIGHTS
@group(0) @binding(3) var<storage, read> lights: array<Light>;
#endif
#if SHADOWS
@group(0) @binding(4) var visibility: texture_2d_array<f32>;
#endif
#if SKY_LAMPS
@group(0) @binding(5) var<storage, read> sky_lamps: array<SkyLamp>;
#endif

#if SKY_LAMPS
// Where the light of a lamp comes from that lies above the horizon of a plane.
fn above_horizon(lamp: SkyLamp, normal: vec3f) -> vec3f {
    let cos = dot(lamp.direction, normal);
    if abs(cos) >= lamp.spread {
        return lamp.direction;
    }
    let middle = 0.5 * (cos + lamp.spread);
    let sideways = lamp.direction - cos * normal;
    return middle * normal + sqrt((1.0 - middle * middle) / max(1e-20, dot(sideways, sideways))) * sideways;
}

var<private> shares: array<vec4f, 4>;
#endif

// Lamps, and after them the parts of the sky.
fn sources() -> u32 {
    var count = 0u;
#if LIGHTS
    count += arrayLength(&lights);
#endif
#if SKY_LAMPS
    count += arrayLength(&sky_lamps);
#endif
    return count;
}

// In how many samples one of them is taken: none where it is not seen.
struct Source {
    samples: i32,
    seen: f32,
}

fn source(l: u32, pixel: vec2i) -> Source {
#if LIGHTS
    if l < arrayLength(&lights) {
        var seen = 1.0;
#if SHADOWS
        if lights[l].visibility >= 0 {
            seen = textureLoad(visibility, pixel, lights[l].visibility, 0).r;
        }
#endif
        return Source(select(0, light_samples(lights[l]), seen > 0.0), seen);
    }
#endif
    return Source(1, 1.0);
}

// What its sample `i` sends to a place on a plane with that normal.
fn arriving(l: u32, i: i32, place: vec3f, normal: vec3f) -> Incident {
    var light_in: Incident;
    var lamps = 0u;
#if LIGHTS
    lamps = arrayLength(&lights);
    if l < lamps { light_in = incident(lights[l], i, place); }
#endif
#if SKY_LAMPS
    if l >= lamps {
        let lamp = sky_lamps[l - lamps];
        let share = shares[(l - lamps) >> 2u][(l - lamps) & 3u];
        light_in = Incident(above_horizon(lamp, normal), share * lamp.light, 1.0, 0.0);
    }
#endif
    return light_in;
}
