// A pixel's ray through the layers below it, and where these end.

// What lies below a thing. Lengths are the world's.
struct Stack {
    // Its layers, outermost first, and the medium below them: from `first` to `last`.
    first: u32,
    last: u32,
    // The first of its maps of depths, four layers each; -1 where all depths are constant.
    map: i32,
    // What 1 in them stands for.
    deepest: f32,
    // No way through it is longer.
    reach: f32,
    // The index by which rays are bent.
    bend: f32,
}

struct Stratum {
    sigma_t: vec3f,
    // Where it ends, if that is the same everywhere.
    depth: f32,
    sigma_s: vec3f,
    is_schlick: u32,
    // Of the phase function, for each channel.
    parameter: vec3f,
}

@group(0) @binding(8) var<storage, read> strata: array<Stratum>;
#if DEPTHS
@group(0) @binding(9) var depth_maps: texture_2d_array<f32>;
@group(0) @binding(10) var repeat: sampler;
#endif

// Cosines below this count as this: what is seen so edge-on differs by less than the bound itself.
const GRAZING: f32 = 1e-4;

// Of what lies below this optical depth, less than a thousandth gets out.
const DARK: f32 = 6.9;

// A pixel's ray, from where it enters on. Places are relative to that, but for `origin`.
struct Ray {
    stack: Stack,
    eta: f32,
    // In eye space.
    origin: vec3f,
    // The normal of the surface, and the fitted plane.
    normal: vec3f,
    plane: vec4f,
    direction: vec3f,
    // Depth gained per length.
    fall: f32,
    // Where it ends.
    end: f32,
    uv: vec2f,
    slope_u: vec3f,
    slope_v: vec3f,
    // Of the maps' levels.
    level: f32,
}

fn uv_at(ray: Ray, p: vec3f) -> vec2f {
    return ray.uv + vec2f(dot(ray.slope_u, p), dot(ray.slope_v, p));
}

// Where the four layers from `first` on end, at a place in the map.
fn depths(ray: Ray, uv: vec2f, first: u32) -> vec4f {
    let stack = ray.stack;
#if DEPTHS
    if stack.map >= 0 {
        // v runs upwards, rows run downwards.
        let at = vec2f(uv.x, 1.0 - uv.y);
        return stack.deepest * textureSampleLevel(depth_maps, repeat, at, stack.map + i32(first >> 2u), ray.level);
    }
#endif
    let i = min(vec4u(stack.first + first) + vec4u(0u, 1u, 2u, 3u), vec4u(stack.last));
    return vec4f(strata[i.x].depth, strata[i.y].depth, strata[i.z].depth, strata[i.w].depth);
}

// The depth at P's place in the map above which lies the optical depth `wanted`. Channels differ: it is that of one
// between their mean and the clearest, or of the clearest.
fn depth_of(ray: Ray, wanted: f32, of_clearest: bool) -> f32 {
    let count = ray.stack.last - ray.stack.first;
    var left = wanted;
    var top = 0.0;
    var ends = vec4f(0.0);
    for (var j = 0u; j <= count; j++) {
        if (j & 3u) == 0u { ends = depths(ray, ray.uv, j); }
        let bottom = select(max(top, ends[j & 3u]), max(top, ray.stack.reach), j == count);
        let s = strata[ray.stack.first + j].sigma_t;
        let clearest = min(s.r, min(s.g, s.b));
        let sigma = select(0.5 * clearest + (s.r + s.g + s.b) / 6.0, clearest, of_clearest);
        if sigma * (bottom - top) >= left {
            return top + left / sigma;
        }
        left -= sigma * (bottom - top);
        top = bottom;
    }
    return top;
}
