// The picture is the sum of its parts: scattered light in the surface's colour, gloss, and what passed through.

#include "lib/fullscreen.wgsl"
#include "frame/scene.wgsl"
#include "frame/surface.wgsl"
#include "optics/fresnel.wgsl"
#if ENVIRONMENT
#include "frame/sky.wgsl"
#endif

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> objects: array<Object>;
@group(0) @binding(2) var position_map: texture_2d<f32>;
@group(0) @binding(3) var packed_map: texture_2d<u32>;
#if SCATTERED
@group(0) @binding(4) var scattered: texture_2d<f32>;
#endif
#if GLOSSY
@group(0) @binding(5) var glossy: texture_2d<f32>;
#endif
#if THROUGH
@group(0) @binding(6) var depth_through: texture_2d<f32>;
#endif

@fragment
fn fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let surface = seen(textureLoad(position_map, pixel, 0), textureLoad(packed_map, pixel, 0));
    let ray = normalize(ray_through(camera, at.xy));
    var radiance = vec3f(0.0);
    if surface.object < 0 {
#if UNSCATTERED
#if ENVIRONMENT
        radiance += sky_seen(ray);
#endif
#endif
        return vec4f(radiance, 0.0);
    }
    let object = objects[surface.object];
#if UNSCATTERED
    if (object.flags & EMITTER) != 0u {
        return vec4f(select(vec3f(0.0), object.emission, dot(surface.normal, ray) < 0.0), 1.0);
    }
#if THROUGH
#if ENVIRONMENT
    if (object.flags & TRANSLUCENT) != 0u {
        let enters = 1.0 - fresnel_dielectric(max(0.0, -dot(surface.normal, ray)), object.eta);
        let through = exp(-max(vec3f(0.0), textureLoad(depth_through, pixel, 0).rgb));
        radiance += enters * enters * through * sky_seen(ray);
    }
#endif
#endif
#endif
#if SCATTERED
    radiance += surface.color * textureLoad(scattered, pixel, 0).rgb;
#endif
#if GLOSSY
    radiance += textureLoad(glossy, pixel, 0).rgb;
#endif
    return vec4f(radiance, 1.0);
}
