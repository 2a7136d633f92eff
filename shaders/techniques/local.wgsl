// Light that leaves where it entered: a surface that scatters the irradiance which its normal gathers.
//
// The normal may be any that a technique hands over. Radiance out = (1 - F_out) scatter E, with E the irradiance that
// got in, and scatter = albedo / (c pi) such that all of `albedo` leaves. With CHANNELS every colour channel has a normal of
// its own, and what the surroundings send to it.

#include "frame/scene.wgsl"
#include "frame/surface.wgsl"
#include "frame/entering.wgsl"
#include "frame/lights.wgsl"
#include "optics/fresnel.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> objects: array<Object>;
@group(0) @binding(2) var packed_map: texture_2d<u32>;
#if LIGHTS
@group(0) @binding(3) var<storage, read> lights: array<Light>;
#endif
#if SHADOWS
@group(0) @binding(4) var visibility: texture_2d_array<f32>;
#endif

struct Vertex {
    @invariant @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) @interpolate(flat) object: u32,
#if ENVIRONMENT
    @location(2) environment: vec3f,
#endif
    @location(3) normal: vec3f,
#if CHANNELS
    @location(4) normal_g: vec3f,
    @location(5) normal_b: vec3f,
#endif
}

@vertex
fn vertex(
    @builtin(instance_index) index: u32,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
#if CHANNELS
    @location(2) normal_g: vec3f,
    @location(3) normal_b: vec3f,
#if ENVIRONMENT
    @location(4) environment_r: vec4f,
    @location(5) environment_g: vec4f,
    @location(6) environment_b: vec4f,
#endif
#else
#if ENVIRONMENT
    @location(2) environment: vec4f,
#endif
#endif
) -> Vertex {
    var out: Vertex;
    out.position = eye_from_object(objects[index], position);
    out.clip = project(camera, out.position);
    out.normal = turned(objects[index], normal);
    out.object = index;
#if CHANNELS
    out.normal_g = turned(objects[index], normal_g);
    out.normal_b = turned(objects[index], normal_b);
#if ENVIRONMENT
    out.environment = vec3f(environment_r.r, environment_g.g, environment_b.b);
#endif
#else
#if ENVIRONMENT
    out.environment = environment.rgb;
#endif
#endif
    return out;
}

@fragment
fn fragment(in: Vertex) -> @location(0) vec4f {
    let object = objects[in.object];
    let pixel = vec2i(in.clip.xy);
    let normal_out = unpack_direction(textureLoad(packed_map, pixel, 0).x);
    var entered = vec3f(0.0);
#if ENVIRONMENT
    entered += max(vec3f(0.0), in.environment);
#endif
#if LIGHTS
    for (var l = 0u; l < arrayLength(&lights); l++) {
        let light = lights[l];
#if CHANNELS
        var from_light = vec3f(
            entering(light, in.position, in.normal, object.eta).r,
            entering(light, in.position, in.normal_g, object.eta).g,
            entering(light, in.position, in.normal_b, object.eta).b,
        );
#else
        var from_light = entering(light, in.position, in.normal, object.eta);
#endif
#if SHADOWS
        if light.visibility >= 0 {
            from_light *= textureLoad(visibility, pixel, light.visibility, 0).r;
        }
#endif
        entered += from_light;
    }
#endif
    // Where an interpolated normal turns away from the eye, the surface is seen edge on.
    let cos_out = max(0.0, dot(normal_out, -normalize(in.position)));
    let leaves = 1.0 - fresnel_dielectric(cos_out, object.eta);
    return vec4f(leaves * object.scatter * entered, 1.0);
}
