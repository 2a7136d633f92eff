// Light reflected at the boundary: GGX with the exact Fresnel term [Walter2007], the same for every technique.

#include "frame/scene.wgsl"
#include "frame/surface.wgsl"
#include "frame/lights.wgsl"
#include "optics/fresnel.wgsl"
#include "optics/microfacet.wgsl"
#if ENVIRONMENT
#include "frame/sky.wgsl"
#endif

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> objects: array<Object>;
@group(0) @binding(2) var packed_map: texture_2d<u32>;
#if LIGHTS
@group(0) @binding(3) var<storage, read> lights: array<Light>;
#endif
#if SHADOWS
@group(0) @binding(4) var visibility: texture_2d_array<f32>;
#endif
#if ENVIRONMENT
// Directional albedo of the lobe: cosine along x, roughness along y, one layer per object.
@group(0) @binding(5) var albedo_table: texture_2d_array<f32>;
@group(0) @binding(6) var linear: sampler;
#endif

struct Vertex {
    @invariant @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) @interpolate(flat) object: u32,
#if OCCLUDED
    @location(2) openness: vec4f,
#endif
}

@vertex
fn vertex(
    @builtin(instance_index) index: u32,
    @location(0) position: vec3f,
#if OCCLUDED
    @location(1) openness: vec4f,
#endif
) -> Vertex {
    var out: Vertex;
    out.position = eye_from_object(objects[index], position);
    out.clip = project(camera, out.position);
    out.object = index;
#if OCCLUDED
    out.openness = openness;
#endif
    return out;
}

// A mirror has no lobe to evaluate: the roughness below which lights are reflected as if at it.
const SMOOTHEST: f32 = 0.03;

@fragment
fn fragment(in: Vertex) -> @location(0) vec4f {
    let object = objects[in.object];
    let pixel = vec2i(in.clip.xy);
    let packed = textureLoad(packed_map, pixel, 0);
    let normal = unpack_direction(packed.x);
    let roughness = unpack2x16float(packed.w).y;
    let to_eye = -normalize(in.position);
    let cos_out = max(1e-4, dot(normal, to_eye));
    var radiance = vec3f(0.0);
#if LIGHTS
    let rough = max(roughness, SMOOTHEST);
    for (var l = 0u; l < arrayLength(&lights); l++) {
        let light = lights[l];
        var from_light = vec3f(0.0);
        for (var i = 0; i < light_samples(light); i++) {
            let light_in = incident(light, i, in.position);
            let cos_in = dot(normal, light_in.direction);
            if cos_in > 0.0 {
                let half_way = normalize(light_in.direction + to_eye);
                // A sample stands for its cell of the light: the lobe is widened by what the cell subtends, so that the
                // samples are not seen one by one.
                let widened = pow(pow(rough, 4.0) + 0.6 * light_in.spread * light_in.spread, 0.25);
                from_light += ggx_lobe(cos_in, cos_out, min(1.0, dot(normal, half_way)), min(1.0, widened))
                    * fresnel_dielectric(saturate(dot(half_way, to_eye)), object.eta)
                    * light_in.irradiance;
            }
        }
#if SHADOWS
        if light.visibility >= 0 {
            from_light *= textureLoad(visibility, pixel, light.visibility, 0).r;
        }
#endif
        radiance += from_light;
    }
#endif
#if ENVIRONMENT
    let mirrored = reflect(-to_eye, normal);
    var open = 1.0;
#if OCCLUDED
    // What lies below the surface never counts as hidden: the same two bands of the whole upper half are 1/2 and 3/4 cos.
    open = saturate((in.openness.x + dot(in.openness.yzw, mirrored)) / (0.5 + 0.75 * cos_out));
#endif
    // The table's first and last texel stand for 0 and 1.
    let size = vec2f(textureDimensions(albedo_table));
    let place = (vec2f(min(1.0, cos_out), roughness) * (size - 1.0) + 0.5) / size;
    let albedo = textureSampleLevel(albedo_table, linear, place, in.object, 0.0).r;
    radiance += open * albedo * sky_reflected(mirrored, roughness);
#endif
    return vec4f(radiance, 1.0);
}
