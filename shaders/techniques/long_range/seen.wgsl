// How much of each group of patches the camera sees: the areas of its pixels, as shares of the group's. They are added up
// as integers, so that the order does not matter.

#include "lib/element.wgsl"

struct Whose {
    object: u32,
}

@group(0) @binding(0) var<uniform> whose: Whose;
@group(0) @binding(1) var position_map: texture_2d<f32>;
@group(0) @binding(2) var entered_map: texture_2d<f32>;
@group(0) @binding(3) var group_map: texture_2d<f32>;
@group(0) @binding(4) var<storage, read> areas: array<f32>;
@group(0) @binding(5) var<storage, read_write> seen: array<atomic<u32>>;

// What stands for all of a group; sixteen times as much fits. Of a group that is smaller than a pixel nobody asks.
const ALL: f32 = 268435456.0;

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3u) {
    let i = element(id);
    let size = textureDimensions(position_map);
    if i >= size.x * size.y {
        return;
    }
    let pixel = vec2u(i % size.x, i / size.x);
    if u32(textureLoad(position_map, pixel, 0).w) != whose.object + 1u {
        return;
    }
    let index = u32(textureLoad(group_map, pixel, 0).r);
    let area = textureLoad(entered_map, pixel, 0).a;
    if area > 0.0 && areas[index] > 0.0 {
        atomicAdd(&seen[index], u32(min(area / areas[index], 1.0) * ALL + 0.5));
    }
}
