// Sums over squares of pixels that one object covers: of m A E, m A, m A x and m, with m the object's mask, A a pixel's
// area, E its irradiance and x its place. Level l has squares of 2^(l + 1) pixels.

struct Sums {
    light: vec3f,
    area: f32,
    place: vec3f,
    pixels: f32,
}

struct Level {
    offset: u32,
    width: u32,
    height: u32,
}
