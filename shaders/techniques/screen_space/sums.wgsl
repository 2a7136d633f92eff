// What is seen of one object, summed up over ever larger squares of pixels.

#include "lib/element.wgsl"
#include "techniques/screen_space/levels.wgsl"

struct Rise {
    // The level that is made; 0 is made of pixels.
    level: u32,
    object: u32,
}

@group(0) @binding(0) var<uniform> rise: Rise;
@group(0) @binding(1) var<storage, read> levels: array<Level>;
@group(0) @binding(2) var position_map: texture_2d<f32>;
@group(0) @binding(3) var entered_map: texture_2d<f32>;
@group(0) @binding(4) var<storage, read_write> sums: array<Sums>;

fn below(at: vec2u) -> Sums {
    if rise.level == 0u {
        if any(at >= textureDimensions(position_map)) {
            return Sums(vec3f(0.0), 0.0, vec3f(0.0), 0.0);
        }
        let position = textureLoad(position_map, at, 0);
        if u32(position.w) != rise.object + 1u {
            return Sums(vec3f(0.0), 0.0, vec3f(0.0), 0.0);
        }
        let entered = textureLoad(entered_map, at, 0);
        return Sums(entered.a * entered.rgb, entered.a, entered.a * position.xyz, 1.0);
    }
    let level = levels[rise.level - 1u];
    if at.x >= level.width || at.y >= level.height {
        return Sums(vec3f(0.0), 0.0, vec3f(0.0), 0.0);
    }
    return sums[level.offset + at.y * level.width + at.x];
}

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3u) {
    let i = element(id);
    let level = levels[rise.level];
    if i >= level.width * level.height {
        return;
    }
    let corner = 2u * vec2u(i % level.width, i / level.width);
    let a = below(corner);
    let b = below(corner + vec2u(1u, 0u));
    let c = below(corner + vec2u(0u, 1u));
    let d = below(corner + vec2u(1u, 1u));
    sums[level.offset + i] = Sums(
        (a.light + b.light) + (c.light + d.light),
        (a.area + b.area) + (c.area + d.area),
        (a.place + b.place) + (c.place + d.place),
        (a.pixels + b.pixels) + (c.pixels + d.pixels),
    );
}
