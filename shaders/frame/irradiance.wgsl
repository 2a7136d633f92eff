// What one lamp sends into each of a list of points, on top of what was there before.

#include "lib/element.wgsl"
#include "frame/scene.wgsl"
#if LAMP
#include "frame/entering.wgsl"
#endif
#if SHADOWED
#include "frame/shadows.wgsl"
#endif

struct Points {
    // Places in the tables of objects and lamps.
    object: u32,
    light: u32,
}

@group(0) @binding(0) var<uniform> points: Points;
@group(0) @binding(1) var<storage, read> objects: array<Object>;
@group(0) @binding(2) var<storage, read> positions: array<f32>;
@group(0) @binding(3) var<storage, read> normals: array<f32>;
#if LAMP
@group(0) @binding(4) var<storage, read> lights: array<Light>;
#endif
#if ON_TOP
@group(0) @binding(5) var<storage, read> before: array<vec4f>;
#endif
@group(0) @binding(6) var<storage, read_write> irradiance: array<vec4f>;

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3u) {
    let i = element(id);
    if i >= arrayLength(&irradiance) {
        return;
    }
    var sum = vec3f(0.0);
#if ON_TOP
    sum = before[i].rgb;
#endif
#if LAMP
    let object = objects[points.object];
    let point = eye_from_object(object, vec3f(positions[3u * i], positions[3u * i + 1u], positions[3u * i + 2u]));
    let normal = turned(object, vec3f(normals[3u * i], normals[3u * i + 1u], normals[3u * i + 2u]));
    let light = lights[points.light];
    var from_lamp = entering(light, point, normal, object.eta);
#if SHADOWED
    if any(from_lamp > vec3f(0.0)) {
        let up = normalize(normal);
        from_lamp *= sees(point, up, object.entry * up, light);
    }
#endif
    sum += from_lamp;
#endif
    irradiance[i] = vec4f(sum, 0.0);
}
