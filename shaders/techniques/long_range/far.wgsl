// Light from all splats at one pixel of each block of 4 x 4 that shows the object. Each invocation of a block's workgroup
// adds up every 64th splat. Sums in a fixed order are the same every time, and need no blending of 32-bit floats, which few
// devices have. One loop over all splats would be cut short by llvmpipe, which leaves a shader after 65,535 turns.

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
const LANES: u32 = 64u;
const PI: f32 = 3.14159265358979;

// The block's pixels from the middle outwards.
fn spiral(i: u32) -> vec2u {
    const ORDER = array<u32, 16>(5u, 10u, 6u, 9u, 1u, 4u, 2u, 7u, 8u, 13u, 11u, 14u, 0u, 15u, 3u, 12u);
    var order = ORDER;
    return vec2u(order[i] & 3u, order[i] >> 2u);
}

// Where the block's pixel lies in eye space; then which of the 16 it is, and 16 times how many of the others show the object.
// -1 for none.
var<workgroup> receiver: vec4f;
var<workgroup> sums: array<vec3f, LANES>;

fn find_receiver(block: u32) -> vec4f {
    let size = textureDimensions(position_map);
    let wide = (size.x + BLOCK - 1u) / BLOCK;
    let corner = BLOCK * vec2u(block % wide, block / wide);
    var found = vec4f(vec3f(0.0), -1.0);
    for (var k = 0u; k < 16u; k++) {
        let step = spiral(k);
        let at = corner + step;
        if any(at >= size) {
            continue;
        }
        let position = textureLoad(position_map, at, 0);
        if u32(position.w) != whose.object + 1u {
            continue;
        }
        if found.w < 0.0 {
            found = vec4f(position.xyz, f32(step.y * BLOCK + step.x));
        } else {
            found.w += 16.0;
        }
    }
    return found;
}

fn from_splat(splat: Splat, x: vec3f, reach: f32) -> vec3f {
    var sum = vec3f(0.0);
    var disks = splat.disks;
    for (var d = 0; d < 4; d++) {
        let disk = disks[d];
        if disk.w == 0.0 {
            break;
        }
        let offset = x - disk.xyz;
        let radius = sqrt(disk.w / PI);
        if dot(offset, offset) < (reach + radius) * (reach + radius) {
            sum += disk.w * splat.light * disk_mean_across(offset, splat.normal, radius);
        }
    }
    return sum;
}

@compute @workgroup_size(64)
fn compute(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let block = element_of_group(group);
    if block >= arrayLength(&blocks) {
        return;
    }
    if lane == 0u {
        receiver = find_receiver(block);
    }
    let found = workgroupUniformLoad(&receiver);
    if found.w < 0.0 {
        if lane == 0u {
            blocks[block] = vec4f(vec3f(0.0), -1.0);
        }
        return;
    }
    let reach = kernel_reach();
    var sum = vec3f(0.0);
    for (var k = lane; k < arrayLength(&splats); k += LANES) {
        sum += from_splat(splats[k], found.xyz, reach);
    }
    sums[lane] = sum;
    for (var half = LANES / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if lane < half {
            sums[lane] += sums[lane + half];
        }
    }
    if lane == 0u {
        blocks[block] = vec4f(sums[0], found.w);
    }
}
