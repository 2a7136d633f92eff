// A patch of surface that sends light as one disk. Eye space.

struct Splat {
    place: vec3f,
    radius: f32,
    normal: vec3f,
    // The area that counts: what the camera does not see of it.
    area: f32,
    // Transmitted irradiance.
    light: vec3f,
    unused: f32,
}
