// Far light from blocks of 4 x 4 pixels to pixels: a cubic B-spline over the blocks around, each taken at the pixel that
// stands for it, and less of those that do not lie on the surface's own plane. A block at the object's rim, where far light is
// brightest, counts by the square root of how many of its pixels show the object: in full, rims shine on all around; by their
// number, rims themselves come out too dark.

#include "frame/surface.wgsl"

// What arrives at the block's pixel; which of the 16 that is, and 16 times how many of the others show the object, -1 for none.
@group(0) @binding(8) var<storage, read> blocks: array<vec4f>;

const BLOCK: i32 = 4;

fn spline(x: f32) -> f32 {
    let d = abs(x);
    let outer = max(0.0, 2.0 - d);
    let inner = max(0.0, 1.0 - d);
    return (outer * outer * outer - 4.0 * inner * inner * inner) / 6.0;
}

// `width`: of a block in the world, at the surface's depth.
fn far_light(position_map: texture_2d<f32>, pixel: vec2i, surface: Seen, width: f32) -> vec3f {
    let size = vec2i(textureDimensions(position_map));
    let wide = (size + BLOCK - 1) / BLOCK;
    let corner = vec2i(floor((vec2f(pixel) + 0.5) / f32(BLOCK) - 0.5)) - 1;
    var sum = vec4f(0.0);
    for (var i = 0; i < 16; i++) {
        let block = corner + vec2i(i & 3, i >> 2);
        if any(block < vec2i(0)) || any(block >= wide) {
            continue;
        }
        let found = blocks[block.y * wide.x + block.x];
        if found.w < 0.0 {
            continue;
        }
        let packed = i32(found.w);
        let at = BLOCK * block + vec2i(packed % BLOCK, packed / BLOCK % BLOCK);
        let shown = sqrt(f32(packed / 16 + 1));
        let away = vec2f(at - pixel) / f32(BLOCK);
        let apart = dot(textureLoad(position_map, at, 0).xyz - surface.position, surface.flat_normal) / width;
        // The pixel's own block always counts a little: there is light to be had even on the thinnest hair.
        let weight = shown * spline(away.x) * spline(away.y) * (exp(-2.0 * apart * apart) + 1e-6);
        sum += weight * vec4f(found.rgb, 1.0);
    }
    return sum.rgb / max(sum.w, 1e-30);
}
