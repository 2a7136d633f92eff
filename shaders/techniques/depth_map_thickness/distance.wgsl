// How far a point lies from a lamp, counted so that the object's middle has its diagonal: never 0, and small beside a lamp
// that is far away. Object space.

#include "frame/lights.wgsl"

struct Measure {
    middle: vec3f,
    diagonal: f32,
    // How far vertices are pushed out, and how wide the map is blurred: scene units.
    grow: f32,
    blur: f32,
}

@group(0) @binding(0) var<uniform> measure: Measure;
@group(0) @binding(1) var<uniform> lamp: Light;

fn distance_from_lamp(point: vec3f, i: i32) -> f32 {
    if lamp.kind == DIRECTIONAL {
        return measure.diagonal - dot(point - measure.middle, lamp.position);
    }
    let place = light_sample(lamp, i);
    return measure.diagonal + length(point - place) - length(measure.middle - place);
}
