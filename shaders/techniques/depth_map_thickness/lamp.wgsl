// Light of one lamp that leaves where it entered, and what comes straight through from where the depth map saw it enter.

#include "frame/scene.wgsl"
#include "frame/surface.wgsl"
#include "frame/lights.wgsl"
#include "optics/fresnel.wgsl"
#if LAMP
#include "techniques/depth_map_thickness/distance.wgsl"
#include "techniques/transmittance.wgsl"
#if OTHERS
#include "frame/others.wgsl"
#endif

struct MapView {
    clip_from_object: mat4x4f,
    sample_index: i32,
    texel: f32,
}
#endif

struct Factors {
    ambient: f32,
    diffuse: f32,
    scatter: f32,
    // Views of one sample of the lamp.
    per_sample: u32,
}

@group(0) @binding(2) var<uniform> camera: Camera;
@group(0) @binding(3) var<storage, read> objects: array<Object>;
@group(0) @binding(4) var packed_map: texture_2d<u32>;
@group(0) @binding(5) var<uniform> factors: Factors;
#if LAMP
@group(0) @binding(6) var<storage, read> map_views: array<MapView>;
@group(0) @binding(7) var distances: texture_2d_array<f32>;
#if SHADOWS
@group(0) @binding(8) var visibility: texture_2d_array<f32>;
#endif
#endif
#if MORE
// Of other lamps.
@group(0) @binding(9) var before: texture_2d<f32>;
#endif

struct Vertex {
    @invariant @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) @interpolate(flat) object: u32,
    @location(3) in_object: vec3f,
    @location(4) normal_in_object: vec3f,
#if ENVIRONMENT
    @location(5) environment: vec3f,
#endif
}

@vertex
fn vertex(
    @builtin(instance_index) index: u32,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
#if ENVIRONMENT
    @location(2) environment: vec4f,
#endif
) -> Vertex {
    var out: Vertex;
    out.position = eye_from_object(objects[index], position);
    out.clip = project(camera, out.position);
    out.normal = turned(objects[index], normal);
    out.object = index;
    out.in_object = position;
    out.normal_in_object = normal;
#if ENVIRONMENT
    out.environment = environment.rgb;
#endif
    return out;
}

#if LAMP
// The stored distance at a place of a map, 0 where there is none.
fn stored(uv: vec2f, layer: u32) -> f32 {
    let size = vec2i(textureDimensions(distances));
    let texel = clamp(vec2i(uv * vec2f(size)), vec2i(0), size - 1);
    return textureLoad(distances, texel, layer, 0).r;
}

// How much of the way from the lamp to the point lies behind where light entered.
fn thickness(point: vec3f, i: i32) -> f32 {
    let here = distance_from_lamp(point, i);
    for (var face = 0u; face < factors.per_sample; face++) {
        let layer = u32(i) * factors.per_sample + face;
        let view = map_views[layer];
        let clip = view.clip_from_object * vec4f(point, 1.0);
        if clip.w <= 0.0 || any(abs(clip.xy) > vec2f(clip.w)) {
            continue;
        }
        let uv = vec2f(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w);
#if BLUR
        // Places around the entry, on what the map shows of the object.
        let depth = select(clip.w, 1.0, lamp.kind == DIRECTIONAL);
        let reach = 0.5 * measure.blur / (view.texel * depth * f32(textureDimensions(distances).x));
        var sum = 0.0;
        var count = 0.0;
        for (var tap = 0; tap < 25; tap++) {
            let found = stored(uv + reach * (vec2f(f32(tap % 5), f32(tap / 5)) - 2.0), layer);
            sum += found;
            count += select(0.0, 1.0, found > 0.0);
        }
        let entered = sum / max(count, 1.0);
#else
        let entered = stored(uv, layer);
#endif
        return select(0.0, max(0.0, here - entered), entered > 0.0);
    }
    return 0.0;
}
#endif

const INV_PI: f32 = 0.3183098861837907;

@fragment
fn fragment(in: Vertex) -> @location(0) vec4f {
    let object = objects[in.object];
    let pixel = vec2i(in.clip.xy);
    let normal_out = unpack_direction(textureLoad(packed_map, pixel, 0).x);
    var scattered = vec3f(0.0);
#if ENVIRONMENT
    scattered += factors.ambient * object.scatter * in.environment;
#endif
#if LAMP
    let normal = in.normal_in_object / max(length(in.normal_in_object), 1e-20);
    var entered = vec3f(0.0);
    var through = vec3f(0.0);
    for (var i = 0; i < light_samples(lamp); i++) {
        let light_in = incident(lamp, i, in.in_object);
        if !(light_in.distance > 0.0) {
            continue;
        }
        let cos_light = dot(normal, light_in.direction);
        let cos_in = clamp(cos_light, 0.0, 1.0);
        entered += cos_in * (1.0 - fresnel_dielectric(cos_in, object.eta)) * light_in.irradiance;
        var left = transmittance(thickness(in.in_object, i) / measure.diagonal);
#if BALANCED
        left *= behind(cos_light);
#endif
#if OTHERS
        left *= past_others(in.in_object, i);
#endif
        through += left * light_in.irradiance;
    }
#if SHADOWS
    entered *= textureLoad(visibility, pixel, lamp.visibility, 0).r;
#endif
    // What comes through got in by the mean transmittance of the boundary, which also normalises the way out: they cancel.
    scattered += factors.diffuse * object.scatter * entered + factors.scatter * INV_PI * through;
#endif
    let cos_out = max(0.0, dot(normal_out, -normalize(in.position)));
    let leaves = 1.0 - fresnel_dielectric(cos_out, object.eta);
    var radiance = leaves * scattered;
#if MORE
    radiance += textureLoad(before, pixel, 0).rgb;
#endif
    return vec4f(radiance, 1.0);
}
