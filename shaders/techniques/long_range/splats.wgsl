// One splat per patch, in the patches' order: middle, normal and irradiance are means over its leaves by area. Of its area
// counts what the camera does not see, be it hidden, off the picture, too steep or turned away, so that the screen part
// and the far part together count every piece once. Pixels at its rim may count more than there is: then the rest is
// negative, and takes it back. What is within the noise of counting pixels is nothing; and of a patch of few pixels that
// count says little: there its middle is looked up.

#include "lib/element.wgsl"
#include "frame/scene.wgsl"
#include "techniques/pixel_area.wgsl"
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
@group(0) @binding(9) var<uniform> camera: Camera;
@group(0) @binding(10) var position_map: texture_2d<f32>;
@group(0) @binding(11) var<storage, read_write> splats: array<Splat>;

const ALL: f32 = 268435456.0;
const PI: f32 = 3.14159265358979;

// Whether the camera sees a point of a patch: 1 or 0.
fn is_seen(place: vec3f, radius: f32) -> f32 {
    let clip = project(camera, place);
    let depth = dot(place, camera.forward);
    let size = vec2f(textureDimensions(position_map));
    let pixel = vec2i(floor((0.5 + vec2f(0.5, -0.5) * clip.xy / clip.w) * size));
    if depth <= 0.0 || any(pixel < vec2i(0)) || any(pixel >= vec2i(size)) {
        return 0.0;
    }
    let found = textureLoad(position_map, pixel, 0);
    // The patch is not flat, and the pixel's centre lies elsewhere on it.
    let apart = dot(found.xyz - place, camera.forward);
    return select(0.0, 1.0, u32(found.w) == whose.object + 1u && abs(apart) < 2.0 * radius + depth * camera.pixel / STEEPEST);
}

// How much of a patch the camera sees: 0 to 1, or a little more.
fn share_seen(group: u32, area: f32, place: vec3f, normal: vec3f) -> f32 {
    let pixel = pixel_area(camera, place, normal);
    if dot(place, normal) >= 0.0 || pixel == 0.0 {
        return f32(seen[group]) / ALL;
    }
    // Its side in pixels, and by how much their number is off.
    let side = sqrt(area / pixel);
    let noise = 0.6 / (max(side, 1e-3) * sqrt(max(side, 1e-3)));
    let counted = f32(seen[group]) / ALL;
    let whole = select(counted, 1.0, abs(counted - 1.0) < noise);
    return mix(is_seen(place, sqrt(area / PI)), whole, smoothstep(6.0, 12.0, side));
}

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
    // The normal of a patch that closes around something may vanish: any will do.
    let turned_normal = turned(object, normal);
    let size = length(turned_normal);
    let unit_normal = select(vec3f(0.0, 1.0, 0.0), turned_normal / size, size > 0.0);
    let middle = eye_from_object(object, place / area);
    var unseen = 0.0;
    if area > 0.0 && any(light > vec3f(0.0)) {
        unseen = 1.0 - share_seen(spans[3u * i + 2u], area, middle, unit_normal);
    }
    if abs(unseen) < 1e-4 {
        splats[i] = Splat(vec3f(0.0), 0.0, vec3f(0.0), 0.0, vec3f(0.0), 0.0);
        return;
    }
    splats[i] = Splat(middle, sqrt(area / PI), unit_normal, unseen * area, light / area, 0.0);
}
