// Light that goes into layers, scatters once and comes out [Francois2006].
//
// From where the eye's ray enters, at P, it is followed to the depth below which nothing is seen, in steps. A point M of
// it lies at a depth below the fitted plane, and the layer there is the first that reaches deeper at M's place in the map.
// Light comes to M through a plane between the tangent one at P and the fitted one [eqs. 9, 10], through layers as thick
// as the mean of those over M and over where it enters [eqs. 11, 12].

#include "frame/scene.wgsl"
#include "frame/surface.wgsl"
#include "optics/fresnel.wgsl"
#include "optics/phase.wgsl"
#include "techniques/layered/ray.wgsl"
#include "techniques/layered/sources.wgsl"
#if MULTIPLE
#include "techniques/layered/multiple.wgsl"
#endif

struct March {
    samples: u32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> objects: array<Object>;
@group(0) @binding(2) var packed_map: texture_2d<u32>;
@group(0) @binding(6) var<uniform> march: March;
@group(0) @binding(7) var<storage, read> stacks: array<Stack>;

struct Vertex {
    @invariant @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    // The fitted plane: its normal, and its distance from the surface along that.
    @location(1) plane: vec4f,
    @location(2) @interpolate(flat) object: u32,
#if DEPTHS
    @location(3) uv: vec2f,
    // How u and v change along the surface.
    @location(4) slope_u: vec3f,
    @location(5) slope_v: vec3f,
#endif
#if SKY_LAMPS
    @location(6) share_0: vec4f,
    @location(7) share_1: vec4f,
    @location(8) share_2: vec4f,
    @location(9) share_3: vec4f,
#endif
}

@vertex
fn vertex(
    @builtin(instance_index) index: u32,
    @location(0) position: vec3f,
    @location(1) plane: vec4f,
#if SKY_LAMPS
    @location(2) share_0: vec4f,
    @location(3) share_1: vec4f,
    @location(4) share_2: vec4f,
    @location(5) share_3: vec4f,
#if DEPTHS
    @location(6) uv_slope: vec4f,
    @location(7) slopes: vec4f,
#endif
#else
#if DEPTHS
    @location(2) uv_slope: vec4f,
    @location(3) slopes: vec4f,
#endif
#endif
) -> Vertex {
    var out: Vertex;
    out.position = eye_from_object(objects[index], position);
    out.clip = project(camera, out.position);
    out.plane = vec4f(turned(objects[index], plane.xyz), plane.w);
    out.object = index;
#if DEPTHS
    out.uv = uv_slope.xy;
    out.slope_u = turned(objects[index], vec3f(uv_slope.zw, slopes.x));
    out.slope_v = turned(objects[index], slopes.yzw);
#endif
#if SKY_LAMPS
    out.share_0 = share_0;
    out.share_1 = share_1;
    out.share_2 = share_2;
    out.share_3 = share_3;
#endif
    return out;
}

// Two optical depths, straight down to the depths `h`, under M and where light enters alike [eq. 12]. `first` are the first
// four depths at M.
fn optical_depths(ray: Ray, uv_m: vec2f, first: vec4f, uv_k: vec2f, h: vec2f) -> mat2x3f {
    let count = ray.stack.last - ray.stack.first;
    let deepest = max(h.x, h.y);
    var sum = mat2x3f(vec3f(0.0), vec3f(0.0));
    var top = 0.0;
    var ends = vec4f(0.0);
    for (var j = 0u; j <= count; j++) {
        if (j & 3u) == 0u {
            var at_m = first;
            if j > 0u { at_m = depths(ray, uv_m, j); }
            ends = 0.5 * (at_m + depths(ray, uv_k, j));
        }
        let bottom = select(min(deepest, max(top, ends[j & 3u])), deepest, j == count);
        let within = clamp(h - top, vec2f(0.0), vec2f(bottom - top));
        let sigma_t = strata[ray.stack.first + j].sigma_t;
        sum += mat2x3f(within.x * sigma_t, within.y * sigma_t);
        if bottom >= deepest {
            break;
        }
        top = bottom;
    }
    return sum;
}

// The plane that light comes in through on its way to the point at `s` [eq. 9]: its normal, and how far above the point
// it lies.
fn plane_above(ray: Ray, s: f32) -> vec4f {
    let t = s / ray.end;
    let normal = normalize(mix(ray.normal, ray.plane.xyz, t));
    return vec4f(normal, max(0.0, dot(t * ray.plane.w * ray.plane.xyz - s * ray.direction, normal)));
}

// The mean of exp(-x) for x from a to b, in each channel.
fn mean_exps(a: vec3f, b: vec3f) -> vec3f {
    let x = abs(b - a);
    let series = 1.0 - x * (0.5 - x * (1.0 / 6.0 - x / 24.0));
    return exp(-min(a, b)) * select((1.0 - exp(-x)) / max(x, vec3f(1e-20)), series, x < vec3f(0.03));
}

fn phase(stratum: Stratum, cos: f32) -> vec3f {
    let k = stratum.parameter;
    if stratum.is_schlick != 0u {
        return vec3f(schlick(cos, k.r), schlick(cos, k.g), schlick(cos, k.b));
    }
    return vec3f(henyey_greenstein(cos, k.r), henyey_greenstein(cos, k.g), henyey_greenstein(cos, k.b));
}

// What lamps send along the ray from its part between `start` and `to`, which lies in one layer; the optical depths along
// the ray are those of its ends.
fn scattered_between(ray: Ray, stratum: Stratum, start: f32, to: f32, near: vec3f, far: vec3f, pixel: vec2i) -> vec3f {
#if UNIFORM
    let middle = start;
#else
    let middle = 0.5 * (start + to);
#endif
    let uv_m = uv_at(ray, middle * ray.direction);
    let first_depths = depths(ray, uv_m, 0u);
    let plane = plane_above(ray, middle);
    let heights = vec2f(plane_above(ray, start).w, plane_above(ray, to).w);
    let above = ray.origin + middle * ray.direction + plane.w * plane.xyz;
    var sum = vec3f(0.0);
    for (var l = 0u; l < sources(); l++) {
        let shining = source(l, pixel);
        for (var i = 0; i < shining.samples; i++) {
            let light_in = arriving(l, i, above, plane.xyz);
            // Behind its plane a point is unlit.
            let cos_in = dot(plane.xyz, light_in.direction);
            if cos_in <= 0.0 || all(light_in.irradiance <= vec3f(0.0)) {
                continue;
            }
            let along = (light_in.direction - cos_in * plane.xyz) / ray.stack.bend;
            let cos_below = max(GRAZING, sqrt(max(0.0, 1.0 - dot(along, along))));
            let to_light = along + cos_below * plane.xyz;
            // A beam is as much wider below as it is bent.
            let width = select(cos_in / cos_below, 1.0, ray.stack.bend == 1.0);
            let enters = width * (1.0 - fresnel_dielectric(min(1.0, cos_in), ray.eta));
            let uv_k = uv_at(ray, middle * ray.direction + (plane.w / cos_below) * to_light);
            let down = optical_depths(ray, uv_m, first_depths, uv_k, heights);
            let first = near + down[0] / cos_below;
#if UNIFORM
            let through = exp(-first);
#else
            let through = mean_exps(first, far + down[1] / cos_below);
#endif
            let turned = phase(stratum, clamp(-dot(to_light, ray.direction), -1.0, 1.0));
            sum += shining.seen * enters * light_in.irradiance * turned * through;
        }
    }
    return (to - start) * stratum.sigma_s * sum;
}

@fragment
fn fragment(in: Vertex) -> @location(0) vec4f {
    let object = objects[in.object];
    let pixel = vec2i(in.clip.xy);
    var ray: Ray;
    ray.stack = stacks[in.object];
#if DEPTHS
    ray.uv = in.uv;
    ray.slope_u = in.slope_u;
    ray.slope_v = in.slope_v;
    let texels = vec2f(textureDimensions(depth_maps));
    let texels_across = max(length(dpdx(in.uv) * texels), length(dpdy(in.uv) * texels));
    ray.level = log2(max(1.0, texels_across));
#endif
#if SKY_LAMPS
    shares = array<vec4f, 4>(in.share_0, in.share_1, in.share_2, in.share_3);
#endif
    ray.eta = object.eta;
    ray.origin = in.position;
    ray.normal = unpack_direction(textureLoad(packed_map, pixel, 0).x);
    ray.plane = vec4f(normalize(in.plane.xyz), in.plane.w);
    // Where an interpolated normal turns away from the eye, the surface is seen edge on.
    let to_eye = -normalize(in.position);
    let cos_out = max(0.0, dot(ray.normal, to_eye));
    let leaves = (1.0 - fresnel_dielectric(cos_out, object.eta)) / (ray.stack.bend * ray.stack.bend);
    let along = (dot(ray.normal, to_eye) * ray.normal - to_eye) / ray.stack.bend;
    ray.direction = select(-to_eye, along - sqrt(max(0.0, 1.0 - dot(along, along))) * ray.normal, ray.stack.bend > 1.0);
    ray.fall = max(GRAZING, -dot(ray.plane.xyz, ray.direction));

#if UNIFORM
    // The paper's depth is one for all angles [eq. 15].
    let deepest = depth_of(ray, DARK, true);
#else
    let deepest = depth_of(ray, DARK * ray.fall, true);
#endif
    ray.end = max(1e-30, min(deepest / ray.fall, ray.stack.reach));

    let layers = ray.stack.last - ray.stack.first;
    var radiance = vec3f(0.0);
    var passed = vec3f(0.0);
    var start = 0.0;
    for (var k = 1u; k <= march.samples; k++) {
        let share = f32(k) / f32(march.samples);
#if UNIFORM
        let to = share * ray.end;
        let looked_at = start;
#else
        // Steps through which the same share of light is lost; the last goes on to the end.
        var to = ray.end;
        if k < march.samples {
            to = clamp(depth_of(ray, -log(1.0 - share) * ray.fall, false) / ray.fall, start, ray.end);
        }
        let looked_at = 0.5 * (start + to);
#endif
        let uv = uv_at(ray, looked_at * ray.direction);
        let at = vec2f(start, to) * ray.fall;
        var top = 0.0;
        var ends = vec4f(0.0);
        for (var j = 0u; j <= layers; j++) {
            if (j & 3u) == 0u { ends = depths(ray, uv, j); }
            let bottom = select(max(top, ends[j & 3u]), max(top, at.y), j == layers);
#if UNIFORM
            // The layer of the step's beginning is that of all of it.
            let part = select(vec2f(0.0), vec2f(start, to), at.x >= top && (at.x < bottom || j == layers));
#else
            let part = select(vec2f(0.0), clamp(vec2f(top, bottom), at.xx, at.yy) / ray.fall, bottom > top);
#endif
            if part.y > part.x {
                let stratum = strata[ray.stack.first + j];
                let far = passed + (part.y - part.x) * stratum.sigma_t;
                radiance += scattered_between(ray, stratum, part.x, part.y, passed, far, pixel);
                passed = far;
            }
            if bottom >= at.y && bottom > at.x {
                break;
            }
            top = bottom;
        }
        start = to;
    }
#if MULTIPLE
    radiance += ray.stack.bend * ray.stack.bend * scattered_often(ray, bodies[in.object], pixel);
#endif
    return vec4f(leaves * radiance, 1.0);
}
