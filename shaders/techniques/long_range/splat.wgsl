// A patch of surface, and what of it sends light: none of it, all of it as one disk, or up to four disks. Eye space.

struct Splat {
    // Transmitted irradiance.
    light: vec3f,
    normal: vec3f,
    // Each disk's middle (xyz) and area (w); 0 for no more of them.
    disks: array<vec4f, 4>,
}
