// Light that leaves where it entered, and light that came through [Tomaszewska2012, eq. 3].

#include "frame/scene.wgsl"
#include "frame/surface.wgsl"
#include "frame/lights.wgsl"
#include "optics/fresnel.wgsl"

// The factors of the equation's terms. Its specular one is the gloss that everything has.
struct Factors {
    ambient: f32,
    diffuse: f32,
    scatter: f32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> objects: array<Object>;
@group(0) @binding(2) var packed_map: texture_2d<u32>;
#if LIGHTS
@group(0) @binding(3) var<storage, read> lights: array<Light>;
#endif
#if SHADOWS
@group(0) @binding(4) var visibility: texture_2d_array<f32>;
#endif
@group(0) @binding(5) var<uniform> factors: Factors;

const INV_PI: f32 = 0.3183098861837907;

struct Vertex {
    @invariant @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) @interpolate(flat) object: u32,
    // The share of light that enters here and does not go through.
    @location(3) kept: vec3f,
#if THROUGH
    // Irradiance that came through.
    @location(4) through: vec3f,
#endif
#if ENVIRONMENT
    @location(5) environment: vec3f,
#endif
}

@vertex
fn vertex(
    @builtin(instance_index) index: u32,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) kept: vec4f,
#if THROUGH
    @location(3) through: vec4f,
#endif
#if ENVIRONMENT
    @location(4) environment: vec4f,
#endif
) -> Vertex {
    var out: Vertex;
    out.position = eye_from_object(objects[index], position);
    out.clip = project(camera, out.position);
    out.normal = turned(objects[index], normal);
    out.object = index;
    out.kept = kept.rgb;
#if THROUGH
    out.through = through.rgb;
#endif
#if ENVIRONMENT
    out.environment = environment.rgb;
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
    entered += factors.ambient * in.environment;
#endif
#if LIGHTS
    let normal = in.normal / max(length(in.normal), 1e-20);
    for (var l = 0u; l < arrayLength(&lights); l++) {
        let light = lights[l];
        var from_light = vec3f(0.0);
        for (var i = 0; i < light_samples(light); i++) {
            let light_in = incident(light, i, in.position);
            let cos_in = clamp(dot(normal, light_in.direction), 0.0, 1.0);
            from_light += cos_in * (1.0 - fresnel_dielectric(cos_in, object.eta)) * light_in.irradiance;
        }
#if SHADOWS
        if light.visibility >= 0 {
            from_light *= textureLoad(visibility, pixel, light.visibility, 0).r;
        }
#endif
        entered += factors.diffuse * from_light;
    }
#endif
    var scattered = object.scatter * in.kept * entered;
#if THROUGH
    // It got in by the mean transmittance of the boundary, which also normalises the way out: they cancel.
    scattered += factors.scatter * INV_PI * in.through;
#endif
    let cos_out = max(0.0, dot(normal_out, -normalize(in.position)));
    let leaves = 1.0 - fresnel_dielectric(cos_out, object.eta);
    return vec4f(leaves * scattered, 1.0);
}
