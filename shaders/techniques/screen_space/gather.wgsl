// Light that entered wherever the camera sees the same object, gathered at each pixel [Maisch2020, eq. 7].

#include "lib/fullscreen.wgsl"
#include "frame/scene.wgsl"
#include "frame/surface.wgsl"
#include "optics/fresnel.wgsl"
#include "techniques/kernel.wgsl"
#include "techniques/pixel_area.wgsl"
#include "techniques/screen_space/levels.wgsl"

struct Pattern {
    object: u32,
    // The inner square is 2 n + 1 pixels wide, each layer around it n_l cells.
    n: i32,
    n_l: i32,
    layers: i32,
    // 1: cells count sqrt(i) times in layer i.
    brighten: u32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> objects: array<Object>;
@group(0) @binding(2) var position_map: texture_2d<f32>;
@group(0) @binding(3) var packed_map: texture_2d<u32>;
@group(0) @binding(4) var entered_map: texture_2d<f32>;
@group(0) @binding(5) var<storage, read> levels: array<Level>;
@group(0) @binding(6) var<storage, read> sums: array<Sums>;
@group(0) @binding(7) var<uniform> pattern: Pattern;
#if FAR_PART
#include "techniques/long_range/upscale.wgsl"
#endif
#if ON_TOP
@group(0) @binding(9) var before: texture_2d<f32>;
#endif

const PI: f32 = 3.14159265358979;

// A square of pixels covers an ellipse of a surface that is seen at an angle: the direction of its long axis, and its
// short axis over its long one.
struct Tilt {
    along: vec3f,
    facing: f32,
}

fn tilt(x: vec3f, flat_normal: vec3f) -> Tilt {
    let view = normalize(x);
    let facing = clamp(abs(dot(view, flat_normal)), STEEPEST, 1.0);
    let along = view - flat_normal * dot(view, flat_normal);
    let size = length(along);
    return Tilt(select(vec3f(0.0), along / size, size > 1e-3), facing);
}

// The distance at which a disk of the radius `a` stands for such an ellipse. Ellipses of neighbours do not overlap, so near
// one the distance is measured by its axes.
fn distance_to_piece(offset: vec3f, a: f32, tilt: Tilt) -> f32 {
    let squared = dot(offset, offset);
    let along = dot(offset, tilt.along);
    let across = max(0.0, squared - along * along);
    let by_axes = along * along * tilt.facing + across / tilt.facing;
    let nearness = a * a / (a * a + squared);
    return sqrt(max(0.0, squared + nearness * (by_axes - squared)));
}

fn inner(pixel: vec2i, x: vec3f, tilt: Tilt) -> vec3f {
    var sum = vec3f(0.0);
    let size = vec2i(textureDimensions(position_map));
    let width = 2 * pattern.n + 1;
    for (var i = 0; i < width * width; i++) {
        let at = pixel + vec2i(i % width, i / width) - pattern.n;
        if any(at < vec2i(0)) || any(at >= size) {
            continue;
        }
        let position = textureLoad(position_map, at, 0);
        let entered = textureLoad(entered_map, at, 0);
        if u32(position.w) != pattern.object + 1u || entered.a == 0.0 {
            continue;
        }
        let a = sqrt(entered.a / PI);
        sum += entered.a * entered.rgb * disk_mean(distance_to_piece(position.xyz - x, a, tilt), a);
    }
    return sum;
}

// The sums over a square of `cell` pixels around a place, from the level whose texels are about as large.
fn over_cell(center: vec2f, cell: f32) -> Sums {
    let index = u32(clamp(floor(log2(cell) + 0.5), 1.0, f32(arrayLength(&levels)))) - 1u;
    let level = levels[index];
    let texel = exp2(f32(index + 1u));
    let at = center / texel - 0.5;
    let corner = floor(at);
    let share = at - corner;
    var sum = Sums(vec3f(0.0), 0.0, vec3f(0.0), 0.0);
    for (var i = 0; i < 4; i++) {
        let step = vec2i(i & 1, i >> 1);
        let place = vec2i(corner) + step;
        if any(place < vec2i(0)) || place.x >= i32(level.width) || place.y >= i32(level.height) {
            continue;
        }
        let found = sums[level.offset + u32(place.y) * level.width + u32(place.x)];
        let towards = select(1.0 - share, share, step == vec2i(1));
        let weight = towards.x * towards.y;
        sum.light += weight * found.light;
        sum.area += weight * found.area;
        sum.place += weight * found.place;
    }
    let cells = cell * cell / (texel * texel);
    return Sums(cells * sum.light, cells * sum.area, cells * sum.place, 0.0);
}

// One layer: the cells on the rim of a square of n_l x n_l.
fn layer(i: i32, middle: vec2f, x: vec3f, tilt: Tilt) -> vec3f {
    let inside = f32(pattern.n_l - 2);
    let half_width = 0.5 * f32(2 * pattern.n + 1) * pow(f32(pattern.n_l) / inside, f32(i - 1));
    let cell = 2.0 * half_width / inside;
    let side = pattern.n_l - 1;
    var sum = vec3f(0.0);
    for (var k = 0; k < 4 * side; k++) {
        let along = k % side;
        var s = vec2i(along, 0);
        switch k / side {
            case 1: { s = vec2i(side, along); }
            case 2: { s = vec2i(side - along, side); }
            case 3: { s = vec2i(0, side - along); }
            default: {}
        }
        let offset = half_width * ((2.0 * vec2f(s) - 1.0) / inside - 1.0);
        let seen_there = over_cell(middle + offset, cell);
        if seen_there.area > 0.0 {
            let place = seen_there.place / seen_there.area;
            let a = sqrt(seen_there.area / PI);
            sum += seen_there.light * disk_mean(distance_to_piece(place - x, a, tilt), a);
        }
    }
    return sum * select(1.0, sqrt(f32(i)), pattern.brighten == 1u);
}

// How many layers reach as far as light does, in pixels.
fn layers_needed(depth: f32) -> i32 {
    let reach = kernel_reach();
    let nearest = max(depth - reach, 1e-3 * depth);
    let wide = 2.0 * reach / (nearest * camera.pixel) / f32(2 * pattern.n + 1);
    let growth = log(f32(pattern.n_l) / f32(pattern.n_l - 2));
    return clamp(i32(ceil(log(max(wide, 1.0)) / growth)), 0, pattern.layers);
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    var radiance = vec3f(0.0);
#if ON_TOP
    radiance = textureLoad(before, pixel, 0).rgb;
#endif
    let surface = seen(textureLoad(position_map, pixel, 0), textureLoad(packed_map, pixel, 0));
    if surface.object != i32(pattern.object) {
        return vec4f(radiance, 1.0);
    }
    let tilt = tilt(surface.position, surface.flat_normal);
    var leaving = inner(pixel, surface.position, tilt);
    let count = layers_needed(dot(surface.position, camera.forward));
    for (var i = 1; i <= count; i++) {
        leaving += layer(i, at.xy, surface.position, tilt);
    }
#if FAR_PART
    let block = f32(BLOCK) * dot(surface.position, camera.forward) * camera.pixel;
    leaving += far_light(position_map, pixel, surface, block);
#endif
    let cos_out = max(0.0, dot(surface.normal, -normalize(surface.position)));
    let leaves = 1.0 - fresnel_dielectric(cos_out, objects[pattern.object].eta);
    return vec4f(radiance + leaves * kernel.spread * select(leaving, vec3f(0.0), leaving < vec3f(0.0)), 1.0);
}
