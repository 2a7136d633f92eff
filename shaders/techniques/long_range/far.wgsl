// Light from all splats at one pixel of each block of 4 x 4 that shows the object. A sum in their order is the same every
// time, and needs no blending of 32-bit floats, which few devices have.

#include "lib/element.wgsl"
#include "techniques/kernel.wgsl"
#include "techniques/long_range/splat.wgsl"

struct Whose {
    object: u32,
}

@group(0) @binding(0) var<uniform> whose: Whose;
@group(0) @binding(1) var position_map: texture_2d<f32>;
@group(0) @binding(2) var<storage, read> splats: array<Splat>;
@group(0) @binding(3) var<storage, read_write> blocks: array<vec4f>;

const BLOCK: u32 = 4u;
const PI: f32 = 3.14159265358979;

// The block's pixels from the middle outwards.
fn spiral(i: u32) -> vec2u {
    const ORDER = array<u32, 16>(5u, 10u, 6u, 9u, 1u, 4u, 2u, 7u, 8u, 13u, 11u, 14u, 0u, 15u, 3u, 12u);
    var order = ORDER;
    return vec2u(order[i] & 3u, order[i] >> 2u);
}

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3u) {
    let i = element(id);
    if i >= arrayLength(&blocks) {
        return;
    }
    let size = textureDimensions(position_map);
    let wide = (size.x + BLOCK - 1u) / BLOCK;
    let corner = BLOCK * vec2u(i % wide, i / wide);
    var found = vec4f(0.0);
    var index = -1.0;
    for (var k = 0u; k < 16u; k++) {
        let at = corner + spiral(k);
        if any(at >= size) {
            continue;
        }
        let position = textureLoad(position_map, at, 0);
        if u32(position.w) == whose.object + 1u {
            found = position;
            index = f32(at.y * size.x + at.x);
            break;
        }
    }
    var sum = vec3f(0.0);
    if index >= 0.0 {
        let reach = kernel_reach();
        for (var k = 0u; k < arrayLength(&splats); k++) {
            for (var d = 0; d < 4; d++) {
                let disk = splats[k].disks[d];
                if disk.w == 0.0 {
                    break;
                }
                let offset = found.xyz - disk.xyz;
                let radius = sqrt(disk.w / PI);
                if dot(offset, offset) < (reach + radius) * (reach + radius) {
                    sum += disk.w * splats[k].light * disk_mean_across(offset, splats[k].normal, radius);
                }
            }
        }
    }
    blocks[i] = vec4f(sum, index);
}
