// How much of a light each pixel sees, by its shadow maps.

#include "lib/fullscreen.wgsl"
#include "frame/scene.wgsl"
#include "frame/surface.wgsl"
#include "frame/lights.wgsl"
#include "frame/shadows.wgsl"

@group(0) @binding(0) var<storage, read> objects: array<Object>;
@group(0) @binding(1) var position_map: texture_2d<f32>;
@group(0) @binding(2) var packed_map: texture_2d<u32>;
@group(0) @binding(3) var<storage, read> lights: array<Light>;

@fragment
fn fragment(@builtin(position) at: vec4f) -> @location(0) f32 {
    let pixel = vec2i(at.xy);
    let surface = seen(textureLoad(position_map, pixel, 0), textureLoad(packed_map, pixel, 0));
    if surface.object < 0 {
        return 0.0;
    }
    // Along the smooth normal: along those of triangles places jump from one to the next, and a shadow's edge is a saw.
    let lift = objects[surface.object].entry * surface.normal;
    return sees(surface.position, surface.flat_normal, lift, lights[views.light]);
}
