// What is seen: position, normals, object, colour and roughness of every pixel.

#include "lib/octahedron.wgsl"
#include "frame/scene.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> objects: array<Object>;
#if TEXTURES
@group(0) @binding(2) var textures: texture_2d_array<f32>;
@group(0) @binding(3) var repeat: sampler;
#endif

struct Vertex {
    @invariant @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) @interpolate(flat) object: u32,
#if TEXTURES
    @location(3) uv: vec2f,
#endif
}

@vertex
fn vertex(
    @builtin(instance_index) index: u32,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
#if TEXTURES
    @location(2) uv: vec2f,
#endif
) -> Vertex {
    var out: Vertex;
    out.position = eye_from_object(objects[index], position);
    out.clip = project(camera, out.position);
    out.normal = turned(objects[index], normal);
    out.object = index;
#if TEXTURES
    out.uv = uv;
#endif
    return out;
}

struct Surface {
    // Eye space; w is 1 + the object's place, 0 where there is nothing.
    @location(0) position: vec4f,
    // Shading normal, geometric normal, colour and roughness as halves.
    @location(1) packed: vec4u,
}

@fragment
fn fragment(in: Vertex) -> Surface {
    let object = objects[in.object];
    // The triangle is flat, so its normal is exact wherever two neighbours see it. It turns to where the shading
    // normal points: a mesh seen from inside keeps its outside.
    var flat_normal = normalize(cross(dpdx(in.position), dpdy(in.position)));
    flat_normal *= select(-1.0, 1.0, dot(flat_normal, in.normal) >= 0.0);
    var color = object.color;
    var roughness = object.roughness;
#if TEXTURES
    // v runs upwards, rows run downwards.
    let uv = vec2f(in.uv.x, 1.0 - in.uv.y);
    if object.color_layer >= 0 { color *= textureSampleLevel(textures, repeat, uv, object.color_layer, 0.0).rgb; }
    if object.roughness_layer >= 0 { roughness *= textureSampleLevel(textures, repeat, uv, object.roughness_layer, 0.0).r; }
#endif
    return Surface(
        vec4f(in.position, f32(in.object + 1u)),
        vec4u(
            pack_direction(normalize(in.normal)),
            pack_direction(flat_normal),
            pack2x16float(color.rg),
            pack2x16float(vec2f(color.b, roughness)),
        ),
    );
}
