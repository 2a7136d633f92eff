// What enters at each pixel, and how much surface the pixel stands for.

#include "frame/scene.wgsl"
#include "frame/surface.wgsl"
#include "frame/entering.wgsl"
#include "frame/lights.wgsl"
#include "techniques/pixel_area.wgsl"

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
    @location(1) normal: vec3f,
    @location(2) @interpolate(flat) object: u32,
#if ENVIRONMENT
    @location(3) environment: vec3f,
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
#if ENVIRONMENT
    out.environment = environment.rgb;
#endif
    return out;
}

// Transmitted irradiance, and the area of surface that the pixel covers.
@fragment
fn fragment(in: Vertex) -> @location(0) vec4f {
    let object = objects[in.object];
    let pixel = vec2i(in.clip.xy);
    var entered = vec3f(0.0);
#if ENVIRONMENT
    entered += in.environment;
#endif
#if LIGHTS
    for (var l = 0u; l < arrayLength(&lights); l++) {
        let light = lights[l];
        var from_light = entering(light, in.position, in.normal, object.eta);
#if SHADOWS
        if light.visibility >= 0 {
            from_light *= textureLoad(visibility, pixel, light.visibility, 0).r;
        }
#endif
        entered += from_light;
    }
#endif
    let flat_normal = unpack_direction(textureLoad(packed_map, pixel, 0).y);
    return vec4f(entered, pixel_area(camera, in.position, flat_normal));
}
