// Depth from a light: reversed, 1 near.

struct Caster {
    clip_from_object: mat4x4f,
}

@group(0) @binding(0) var<storage, read> casters: array<Caster>;

@vertex
fn vertex(@builtin(instance_index) index: u32, @location(0) position: vec3f) -> @builtin(position) vec4f {
    return casters[index].clip_from_object * vec4f(position, 1.0);
}
