// Light that scatters more than once below a place and leaves there: a share of what the layers send back by diffusion, by
// what `single` says that they send back after one event. Both take the layers for as deep everywhere as they are there.

#include "optics/fresnel.wgsl"
#include "optics/strata.wgsl"
#include "techniques/layered/ray.wgsl"
#include "techniques/layered/sources.wgsl"

struct Reduced {
    sigma_a: vec3f,
    sigma_s_prime: vec3f,
}

// A thing's tables, and its boundary.
struct Body {
    // The first knot of them, and how many there are along each axis.
    returns: u32,
    knots: u32,
    // Of what diffuses to the surface, 1/(1 + boundary q) leaves.
    boundary: f32,
    // 1 / (c pi): from irradiance that leaves to radiance, but for Fresnel.
    spread: f32,
}

// As `strata`.
@group(0) @binding(11) var<storage, read> reduced: array<Reduced>;
@group(0) @binding(12) var<storage, read> bodies: array<Body>;
// For each thing: corrections of diffusion (r) and the root of what survives (g), by admittance and by the cosine outside;
// then, for each of its strata and by that cosine, what comes back after one event without absorption.
@group(0) @binding(13) var<storage, read> returns: array<vec4f>;

// What scattered more than once of all that comes back by diffusion.
fn corrected(body: Body, cos: f32, q: f32, diffused: f32, once: f32, once_white: f32) -> f32 {
    let at = saturate(vec2f(q, cos)) * f32(body.knots - 1u);
    let low = min(vec2u(at), vec2u(body.knots - 2u));
    let share = at - vec2f(low);
    let i = body.returns + low.x * body.knots + low.y;
    let clearer = mix(returns[i].rg, returns[i + 1u].rg, share.y);
    let darker = mix(returns[i + body.knots].rg, returns[i + body.knots + 1u].rg, share.y);
    let both = mix(clearer, darker, share.x);
    return often(both.x * diffused, once, once_white, both.y * both.y);
}

// The admittance of all from a layer on downwards, and what diffuses up from there, in each channel.
struct Level {
    q: vec3f,
    diffused: vec3f,
}

fn level(r: array<f32, 2>, g: array<f32, 2>, b: array<f32, 2>) -> Level {
    return Level(vec3f(r[0], g[0], b[0]), vec3f(r[1], g[1], b[1]));
}

// What one stratum alone sends back after one event, and what it would without absorption.
fn single(ray: Ray, body: Body, j: u32, cos: f32) -> mat2x3f {
    let at = saturate(cos) * f32(body.knots - 1u);
    let low = min(u32(at), body.knots - 2u);
    let i = body.returns + (body.knots + j) * body.knots + low;
    let stratum = strata[ray.stack.first + j];
    let white = mix(returns[i].rgb, returns[i + 1u].rgb, at - f32(low));
    return mat2x3f(stratum.sigma_s / max(stratum.sigma_t, vec3f(1e-30)) * white, white);
}

// The cosine below a surface.
fn below_surface(cos: f32, eta: f32) -> f32 {
    return max(GRAZING, sqrt((eta - 1.0) * (eta + 1.0) + cos * cos) / eta);
}

// Of light that comes in at that cosine outside, the share that leaves after more than one event.
fn returned_often(ray: Ray, body: Body, cos: f32) -> vec3f {
    let down = below_surface(cos, ray.eta);
    // Light that scatters once goes in and, at the mean cosine of diffuse light, out again.
    let slant = 1.0 / below_surface(cos, ray.stack.bend) + 1.0 / below_surface(2.0 / 3.0, ray.stack.bend);
    let count = ray.stack.last - ray.stack.first;
    let deepest = reduced[ray.stack.last];
    let a = deepest.sigma_a;
    let s = deepest.sigma_s_prime;
    var up = level(below_all(a.r, s.r, down), below_all(a.g, s.g, down), below_all(a.b, s.b, down));
    var once = single(ray, body, count, cos);
    // From the deepest layer upwards.
    var ends = vec4f(0.0);
    for (var above = count; above > 0u; above--) {
        let j = above - 1u;
        if above == count || (j & 3u) == 3u { ends = depths(ray, ray.uv, j & ~3u); }
        var top = 0.0;
        if (j & 3u) > 0u {
            top = ends[(j & 3u) - 1u];
        } else if j > 0u {
            top = depths(ray, ray.uv, j - 4u).w;
        }
        let thickness = max(0.0, ends[j & 3u] - top);
        let layer = reduced[ray.stack.first + j];
        let a = layer.sigma_a;
        let s = layer.sigma_s_prime;
        up = level(
            on_top(a.r, s.r, thickness, down, up.q.r, up.diffused.r),
            on_top(a.g, s.g, thickness, down, up.q.g, up.diffused.g),
            on_top(a.b, s.b, thickness, down, up.q.b, up.diffused.b)
        );
        let below = exp(-slant * thickness * strata[ray.stack.first + j].sigma_t);
        let here = single(ray, body, j, cos);
        once = mat2x3f(mix(here[0], once[0], below), mix(here[1], once[1], below));
    }
    let all = up.diffused / (1.0 + body.boundary * up.q);
    return vec3f(
        corrected(body, cos, up.q.r, all.r, once[0].r, once[1].r),
        corrected(body, cos, up.q.g, all.g, once[0].g, once[1].g),
        corrected(body, cos, up.q.b, all.b, once[0].b, once[1].b)
    );
}

// How far light gets to the side before it scatters, in the mean along the ray: so wide a piece of the map is one.
fn widened(ray: Ray) -> Ray {
    var wide = ray;
#if DEPTHS
    let texels = vec2f(textureDimensions(depth_maps));
    let per_length = max(length(ray.slope_u) * texels.x, length(ray.slope_v) * texels.y);
    wide.level = max(ray.level, log2(max(1.0, 2.0 * per_length * ray.end / DARK)));
#endif
    return wide;
}

// Radiance, but for Fresnel on the way out. Light leaves in a direction as it would be returned from there, as a share of
// the mean over all that comes from everywhere: both ways are alike, and what is evenly lit and white is evenly bright.
fn scattered_often(ray: Ray, body: Body, pixel: vec2i) -> vec3f {
    // Three directions stand for light from everywhere.
    let cosines = vec3f(0.33571, 0.70711, 0.94196);
    let shares = vec3f(5.0, 8.0, 5.0);
    let wide = widened(ray);
    var leaves = vec3f(0.0);
    var everywhere = vec3f(0.0);
    var entered = 0.0;
    var shone = vec3f(0.0);
    // One loop over all directions, since drivers inline what each of them takes: first the one that light leaves in, then
    // those three, then where lamps are.
    var l = 0u;
    var sample = 0;
    for (var k = 0; k < 4 || l < sources(); k++) {
        var cos = saturate(-dot(ray.normal, normalize(ray.origin)));
        var light = vec3f(0.0);
        if k >= 4 {
            let shining = source(l, pixel);
            if sample >= shining.samples {
                l++;
                sample = 0;
                continue;
            }
            let light_in = arriving(l, sample, ray.origin, ray.normal);
            sample++;
            cos = min(1.0, dot(ray.normal, light_in.direction));
            light = shining.seen * cos * light_in.irradiance;
            if cos <= 0.0 || all(light <= vec3f(0.0)) {
                continue;
            }
        } else if k >= 1 {
            cos = cosines[k - 1];
        }
        let returned = returned_often(wide, body, cos);
        let enters = 1.0 - fresnel_dielectric(cos, ray.eta);
        if k == 0 {
            leaves = returned;
        } else if k < 4 {
            everywhere += shares[k - 1] * enters * returned;
            entered += shares[k - 1] * enters;
        } else {
            shone += enters * light * returned;
        }
    }
    let mean = everywhere / entered;
    // Where nothing comes back from anywhere, nothing leaves. A comparison lets through what is no number; max would not.
    return body.spread * shone * leaves / select(mean, vec3f(1e-20), mean < vec3f(1e-20));
}
