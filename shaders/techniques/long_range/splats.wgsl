// One splat per patch, in the patches' order: middle, normal and irradiance are means over its leaves by area. Of its area
// counts what the camera does not see, be it hidden, off the picture, too steep or turned away, so that the screen part
// and the far part together count every piece once. Pixels at its rim may count more than there is: then the rest is
// negative, and takes it back.

#include "lib/element.wgsl"
#include "frame/scene.wgsl"
#include "techniques/long_range/splat.wgsl"

struct Whose {
    object: u32,
}

@group(0) @binding(0) var<uniform> whose: Whose;
@group(0) @binding(1) var<storage, read> objects: array<Object>;
// Per patch: where its leaves begin and end, and its group.
@group(0) @binding(2) var<storage, read> spans: array<u32>;
@group(0) @binding(4) var<storage, read> areas: array<f32>;
@group(0) @binding(5) var<storage, read> positions: array<f32>;
@group(0) @binding(6) var<storage, read> normals: array<f32>;
@group(0) @binding(7) var<storage, read> irradiance: array<vec4f>;
@group(0) @binding(8) var<storage, read> seen: array<u32>;
@group(0) @binding(9) var<storage, read_write> splats: array<Splat>;

const ALL: f32 = 268435456.0;
const PI: f32 = 3.14159265358979;

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3u) {
    let i = element(id);
    if i >= arrayLength(&splats) {
        return;
    }
    let object = objects[whose.object];
    var area = 0.0;
    var place = vec3f(0.0);
    var normal = vec3f(0.0);
    var light = vec3f(0.0);
    for (var leaf = spans[3u * i]; leaf < spans[3u * i + 1u]; leaf++) {
        let at = vec3u(3u * leaf) + vec3u(0u, 1u, 2u);
        area += areas[leaf];
        place += areas[leaf] * vec3f(positions[at.x], positions[at.y], positions[at.z]);
        normal += areas[leaf] * vec3f(normals[at.x], normals[at.y], normals[at.z]);
        light += areas[leaf] * irradiance[leaf].rgb;
    }
    let unseen = 1.0 - f32(seen[spans[3u * i + 2u]]) / ALL;
    if area == 0.0 || all(light == vec3f(0.0)) || abs(unseen) < 1e-4 {
        splats[i] = Splat(vec3f(0.0), 0.0, vec3f(0.0), 0.0, vec3f(0.0), 0.0);
        return;
    }
    // The normal of a patch that closes around something may vanish: any will do.
    let turned_normal = turned(object, normal);
    let size = length(turned_normal);
    splats[i] = Splat(
        eye_from_object(object, place / area),
        sqrt(area / PI),
        select(vec3f(0.0, 1.0, 0.0), turned_normal / size, size > 0.0),
        unseen * area,
        light / area,
        0.0,
    );
}
