// The surroundings by direction: a constant, or an image in longitude and latitude with its blurred copies.

struct Sky {
    radiance: vec3f,
    // About y, radians.
    rotation: f32,
}

@group(0) @binding(16) var<uniform> sky: Sky;
#if SKY_IMAGE
@group(0) @binding(17) var sky_image: texture_2d<f32>;
@group(0) @binding(18) var around: sampler;
#endif
#if SKY_BLURRED
// One layer per step of roughness from 0.2 to 1.
@group(0) @binding(19) var sky_blurred: texture_2d_array<f32>;
#endif

const PI: f32 = 3.14159265358979;

// Where an image holds a direction: x to the right from -z through +x, y downwards from +y.
fn sky_uv(direction: vec3f) -> vec2f {
    let turned = atan2(direction.x, -direction.z) + sky.rotation;
    return vec2f(0.5 + turned / (2.0 * PI), acos(clamp(direction.y, -1.0, 1.0)) / PI);
}

fn sky_seen(direction: vec3f) -> vec3f {
#if SKY_IMAGE
    return sky.radiance * textureSampleLevel(sky_image, around, sky_uv(direction), 0.0).rgb;
#else
    return sky.radiance;
#endif
}

fn sky_reflected(direction: vec3f, roughness: f32) -> vec3f {
#if SKY_BLURRED
    let uv = sky_uv(direction);
    let level = clamp(roughness * 5.0, 0.0, 5.0);
    let below = i32(floor(level));
    let lower = textureSampleLevel(sky_blurred, around, uv, max(0, below - 1), 0.0).rgb;
    let upper = textureSampleLevel(sky_blurred, around, uv, min(4, below), 0.0).rgb;
    let sharp = textureSampleLevel(sky_image, around, uv, 0.0).rgb;
    return sky.radiance * mix(select(lower, sharp, below == 0), upper, level - f32(below));
#else
    return sky.radiance;
#endif
}
