// Light of one lamp that gets through the boundary, shadows aside.

#include "frame/lights.wgsl"
#include "optics/fresnel.wgsl"

// Transmitted irradiance at a point whose surface faces along `normal`. A filtered normal may be shorter than 1: it dims,
// and points where it points.
fn entering(light: Light, point: vec3f, normal: vec3f, eta: f32) -> vec3f {
    let inverse_length = 1.0 / max(length(normal), 1e-20);
    var sum = vec3f(0.0);
    for (var i = 0; i < light_samples(light); i++) {
        let light_in = incident(light, i, point);
        let cos_length = max(0.0, dot(normal, light_in.direction));
        let enters = 1.0 - fresnel_dielectric(min(1.0, cos_length * inverse_length), eta);
        sum += cos_length * enters * light_in.irradiance;
    }
    return sum;
}
