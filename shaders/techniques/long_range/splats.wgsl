// One splat per patch, in the patches' order: normal and irradiance are means over its leaves by area. Of its area counts
// what the camera does not see, be it hidden, off the picture, too steep or turned away, so that the screen part and the
// far part together count every piece once. Whether something is seen is looked up in the picture, at points all over each
// leaf: one per four pixels that it is large.

#include "lib/element.wgsl"
#include "lib/octahedron.wgsl"
#include "frame/scene.wgsl"
#include "techniques/pixel_area.wgsl"
#include "techniques/long_range/splat.wgsl"

struct Whose {
    object: u32,
}

@group(0) @binding(0) var<uniform> whose: Whose;
@group(0) @binding(1) var<storage, read> objects: array<Object>;
// Per patch: where its leaves begin and end.
@group(0) @binding(2) var<storage, read> spans: array<u32>;
@group(0) @binding(3) var<storage, read> areas: array<f32>;
@group(0) @binding(4) var<storage, read> positions: array<f32>;
@group(0) @binding(5) var<storage, read> normals: array<f32>;
@group(0) @binding(6) var<storage, read> irradiance: array<vec4f>;
@group(0) @binding(7) var<uniform> camera: Camera;
@group(0) @binding(8) var position_map: texture_2d<f32>;
@group(0) @binding(9) var packed_map: texture_2d<u32>;
@group(0) @binding(10) var<storage, read_write> splats: array<Splat>;

const PI: f32 = 3.14159265358979;
const GOLDEN_ANGLE: f32 = 2.39996322972865;
const MOST_POINTS: f32 = 64.0;
// What is less of a patch than this is nothing: areas are added up in two orders.
const NOTHING: f32 = 1e-4;

struct Leaf {
    middle: vec3f,
    area: f32,
    normal: vec3f,
}

fn leaf_at(i: u32) -> Leaf {
    let object = objects[whose.object];
    return Leaf(
        eye_from_object(object, vec3f(positions[3u * i], positions[3u * i + 1u], positions[3u * i + 2u])),
        areas[i],
        turned(object, vec3f(normals[3u * i], normals[3u * i + 1u], normals[3u * i + 2u])),
    );
}

// Whether the screen part has the surface at `point`, on a leaf of this normal and radius.
fn is_seen(point: vec3f, normal: vec3f, radius: f32) -> bool {
    let depth = dot(point, camera.forward);
    let clip = project(camera, point);
    let size = textureDimensions(position_map);
    let at = floor((0.5 + vec2f(0.5, -0.5) * clip.xy / clip.w) * vec2f(size));
    let faces_away = dot(point, normal) >= 0.0;
    if faces_away || depth <= 0.0 || any(at < vec2f(0.0)) || any(at >= vec2f(size)) {
        return false;
    }
    let found = textureLoad(position_map, vec2u(at), 0);
    let flat_normal = unpack_direction(textureLoad(packed_map, vec2u(at), 0).y);
    if u32(found.w) != whose.object + 1u || pixel_area(camera, found.xyz, flat_normal) == 0.0 {
        return false;
    }
    // The same sheet: a leaf may be a little bent, and the pixel's centre lies elsewhere on it.
    let apart = abs(dot(found.xyz - point, flat_normal));
    return dot(normal, flat_normal) > 0.0 && apart < 0.5 * radius + depth * camera.pixel;
}

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3u) {
    let i = element(id);
    if i >= arrayLength(&splats) {
        return;
    }
    splats[i] = Splat();
    var area = 0.0;
    var middle = vec3f(0.0);
    var normal = vec3f(0.0);
    var light = vec3f(0.0);
    for (var l = spans[2u * i]; l < spans[2u * i + 1u]; l++) {
        let leaf = leaf_at(l);
        area += leaf.area;
        middle += leaf.area * leaf.middle;
        normal += leaf.area * leaf.normal;
        light += leaf.area * irradiance[l].rgb;
    }
    if area <= 0.0 || all(light <= vec3f(0.0)) {
        return;
    }
    middle /= area;

    // What is not seen of the patch, to the left, to the right, below and above its middle: a frame around the picture falls
    // into its sides.
    var quarters = array<vec4f, 4>();
    for (var l = spans[2u * i]; l < spans[2u * i + 1u]; l++) {
        let leaf = leaf_at(l);
        let radius = sqrt(leaf.area / PI);
        let pixel = camera.pixel * max(dot(leaf.middle, camera.forward), 1e-3 * radius);
        let count = floor(clamp(0.25 * leaf.area / (pixel * pixel), 1.0, MOST_POINTS));
        // Any two directions along the leaf.
        let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(leaf.normal.x) > 0.5);
        let u = normalize(cross(leaf.normal, other));
        let v = cross(leaf.normal, u);
        for (var k = 0.0; k < count; k += 1.0) {
            let r = select(radius * sqrt((k + 0.5) / count), 0.0, count == 1.0);
            let turn = GOLDEN_ANGLE * k;
            let point = leaf.middle + r * (cos(turn) * u + sin(turn) * v);
            if !is_seen(point, leaf.normal, radius) {
                let away = point - middle;
                let x = dot(away, camera.right);
                let y = dot(away, camera.up);
                let quarter = select(2u + u32(y > 0.0), u32(x > 0.0), abs(x) > abs(y));
                quarters[quarter] += leaf.area / count * vec4f(away, 1.0);
            }
        }
    }
    let unseen = quarters[0] + quarters[1] + quarters[2] + quarters[3];
    if unseen.w < NOTHING * area {
        return;
    }
    var disks = array<vec4f, 4>();
    if unseen.w > (1.0 - NOTHING) * area {
        disks[0] = vec4f(middle, area);
    } else {
        var count = 0;
        for (var q = 0; q < 4; q++) {
            if quarters[q].w > NOTHING * area {
                disks[count] = vec4f(middle + quarters[q].xyz / quarters[q].w, quarters[q].w);
                count++;
            }
        }
    }
    // The normal of a patch that closes around something may vanish: any will do.
    let size = length(normal);
    let unit_normal = select(vec3f(0.0, 1.0, 0.0), normal / size, size > 0.0);
    splats[i] = Splat(light / area, unit_normal, disks);
}
