// Light that scatters more than once below a place and leaves there: what the layers send back by diffusion, less what
// `single` says that they send back after one event. Both take the layers for as deep everywhere as they are there.

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
// For each thing: corrections of diffusion (r), by admittance and by the cosine outside; then, for each of its strata and by
// that cosine, what comes back after one event without absorption.
@group(0) @binding(13) var<storage, read> returns: array<vec4f>;

fn corrections(body: Body, q: vec3f, cos: f32) -> vec3f {
    var values = vec3f(0.0);
    for (var c = 0; c < 3; c++) {
        let at = saturate(vec2f(q[c], cos)) * f32(body.knots - 1u);
        let low = min(vec2u(at), vec2u(body.knots - 2u));
        let share = at - vec2f(low);
        let i = body.returns + low.x * body.knots + low.y;
        let clearer = mix(returns[i].r, returns[i + 1u].r, share.y);
        let darker = mix(returns[i + body.knots].r, returns[i + body.knots + 1u].r, share.y);
        values[c] = mix(clearer, darker, share.x);
    }
    return values;
}

// What one stratum alone sends back after one event.
fn single(ray: Ray, body: Body, j: u32, cos: f32) -> vec3f {
    let at = saturate(cos) * f32(body.knots - 1u);
    let low = min(u32(at), body.knots - 2u);
    let i = body.returns + (body.knots + j) * body.knots + low;
    let stratum = strata[ray.stack.first + j];
    return stratum.sigma_s / max(stratum.sigma_t, vec3f(1e-30)) * mix(returns[i].rgb, returns[i + 1u].rgb, at - f32(low));
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
    var q: vec3f;
    var diffused: vec3f;
    let deepest = reduced[ray.stack.last];
    for (var c = 0; c < 3; c++) {
        let level = below_all(deepest.sigma_a[c], deepest.sigma_s_prime[c], down);
        q[c] = level[0];
        diffused[c] = level[1];
    }
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
        for (var c = 0; c < 3; c++) {
            let level = on_top(layer.sigma_a[c], layer.sigma_s_prime[c], thickness, down, q[c], diffused[c]);
            q[c] = level[0];
            diffused[c] = level[1];
        }
        let below = exp(-slant * thickness * strata[ray.stack.first + j].sigma_t);
        once = mix(single(ray, body, j, cos), once, below);
    }
    let all = corrections(body, q, cos) * diffused / (1.0 + body.boundary * q);
    return max(vec3f(0.0), all - once);
}

// How far light gets to the side before it scatters: so wide a piece of the map is one.
fn widened(ray: Ray) -> Ray {
    var wide = ray;
#if DEPTHS
    let texels = vec2f(textureDimensions(depth_maps));
    let per_length = max(length(ray.slope_u) * texels.x, length(ray.slope_v) * texels.y);
    wide.level = max(ray.level, log2(max(1.0, 2.0 * per_length * depth_of(ray, 1.0, false))));
#endif
    return wide;
}

// The mean of that over light that comes from everywhere, in three directions.
fn returned_in_the_mean(ray: Ray, body: Body) -> vec3f {
    let cosines = vec3f(0.33571, 0.70711, 0.94196);
    let shares = vec3f(5.0, 8.0, 5.0);
    var sum = vec3f(0.0);
    var entered = 0.0;
    for (var i = 0; i < 3; i++) {
        let enters = shares[i] * (1.0 - fresnel_dielectric(cosines[i], ray.eta));
        sum += enters * returned_often(ray, body, cosines[i]);
        entered += enters;
    }
    return sum / entered;
}

// Radiance, but for Fresnel on the way out. Light leaves in a direction as it would be returned from there: both ways are
// alike, and what is evenly lit and white is evenly bright.
fn scattered_often(ray: Ray, body: Body, pixel: vec2i) -> vec3f {
    let wide = widened(ray);
    var sum = vec3f(0.0);
    for (var l = 0u; l < sources(); l++) {
        let shining = source(l, pixel);
        for (var i = 0; i < shining.samples; i++) {
            let light_in = arriving(l, i, ray.origin, ray.normal);
            let cos = min(1.0, dot(ray.normal, light_in.direction));
            if cos > 0.0 && any(light_in.irradiance > vec3f(0.0)) {
                let enters = shining.seen * cos * (1.0 - fresnel_dielectric(cos, ray.eta));
                sum += enters * light_in.irradiance * returned_often(wide, body, cos);
            }
        }
    }
    let leaves = returned_often(wide, body, saturate(-dot(ray.normal, normalize(ray.origin))));
    return body.spread * sum * leaves / max(vec3f(1e-20), returned_in_the_mean(wide, body));
}
