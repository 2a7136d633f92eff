// Unit vectors as two numbers [Cigolle2014].

fn octahedron_fold(v: vec2f) -> vec2f {
    return (1.0 - abs(v.yx)) * select(vec2f(-1.0), vec2f(1.0), v >= vec2f(0.0));
}

fn pack_direction(n: vec3f) -> u32 {
    let v = n / (abs(n.x) + abs(n.y) + abs(n.z));
    return pack2x16snorm(select(octahedron_fold(v.xy), v.xy, v.z >= 0.0));
}

fn unpack_direction(packed: u32) -> vec3f {
    let v = unpack2x16snorm(packed);
    let z = 1.0 - abs(v.x) - abs(v.y);
    return normalize(vec3f(select(octahedron_fold(v), v, z >= 0.0), z));
}
