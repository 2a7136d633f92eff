// How much of one lamp a point sees, by the lamp's shadow maps.

#include "frame/lights.wgsl"

// A shadow map's view.
struct ShadowView {
    clip_from_eye: mat4x4f,
    // The width of a texel: in the world for a directional light, else at unit depth.
    texel: f32,
    is_directional: u32,
}

struct Views {
    light: u32,
    // Views of one sample of the light: 1, or the 6 faces of a cube.
    per_sample: u32,
}

@group(0) @binding(20) var<uniform> views: Views;
@group(0) @binding(21) var<storage, read> shadow_views: array<ShadowView>;
@group(0) @binding(22) var shadow_map: texture_depth_2d_array;
@group(0) @binding(23) var compare: sampler_comparison;

// The face of a cube that a direction goes through: +x, -x, +y, -y, +z, -z.
fn face(d: vec3f) -> u32 {
    let a = abs(d);
    if a.x >= a.y && a.x >= a.z { return select(0u, 1u, d.x < 0.0); }
    if a.y >= a.z { return select(2u, 3u, d.y < 0.0); }
    return select(4u, 5u, d.z < 0.0);
}

// How much of sample `i` is seen from a point, and `lift` away from it, whose triangle faces along `normal`.
fn sees_sample(point: vec3f, normal: vec3f, lift: vec3f, light: Light, i: i32) -> f32 {
    let to_light = select(light_sample(light, i) - point, light.position, light.kind == DIRECTIONAL);
    var index = u32(i) * views.per_sample;
    var view = shadow_views[index];
    let depth = select(length(to_light), 1.0, view.is_directional == 1u);
    let cos_light = dot(normalize(to_light), normal);
    // A texel covers a slope: stepping off it along the normal, by as much as the filter is wide, takes the surface out
    // of its own shadow, whatever the scene's scale.
    let texel = view.texel * depth;
    let offset = texel * (0.5 + 2.0 * sqrt(max(0.0, 1.0 - cos_light * cos_light)));
    let lifted = point + lift + offset * normal;
    // Near the edge of a cube's face the step may lead over it.
    if views.per_sample == 6u {
        index += face(lifted - point - to_light);
        view = shadow_views[index];
    }
    let clip = view.clip_from_eye * vec4f(lifted, 1.0);
    let ndc = clip.xyz / clip.w;
    // What lies outside the map has nothing between itself and the light.
    if clip.w <= 0.0 || any(abs(ndc.xy) > vec2f(1.0)) || ndc.z <= 0.0 || ndc.z > 1.0 {
        return 1.0;
    }
    let uv = vec2f(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y);
    if light.kind == RECT {
        return textureSampleCompareLevel(shadow_map, compare, uv, index, ndc.z);
    }
    let step = 1.0 / vec2f(textureDimensions(shadow_map));
    var sum = 0.0;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            sum += textureSampleCompareLevel(shadow_map, compare, uv + step * vec2f(f32(x), f32(y)), index, ndc.z);
        }
    }
    return sum / 9.0;
}

// The mean over the lamp's samples, each weighted by what it sends here.
fn sees(point: vec3f, normal: vec3f, lift: vec3f, light: Light) -> f32 {
    var sum = 0.0;
    var weight = 0.0;
    for (var i = 0; i < light_samples(light); i++) {
        let light_in = incident(light, i, point);
        let w = light_in.irradiance.r + light_in.irradiance.g + light_in.irradiance.b;
        if w > 0.0 {
            sum += w * sees_sample(point, normal, lift, light, i);
            weight += w;
        }
    }
    return select(0.0, sum / weight, weight > 0.0);
}
