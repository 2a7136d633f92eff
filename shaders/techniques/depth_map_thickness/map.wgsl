// Where light from a lamp enters an object, as its distance [Green2004]. The object is drawn a little larger than it is, so
// that its silhouette does not miss, and keeps the distances that it has.

#include "frame/lights.wgsl"
#include "techniques/depth_map_thickness/distance.wgsl"

struct MapView {
    clip_from_object: mat4x4f,
    // Of the lamp.
    sample_index: i32,
    // The width of a texel: for a directional light, else at unit depth.
    texel: f32,
}

@group(0) @binding(2) var<uniform> view: MapView;

struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
}

@vertex
fn vertex(@location(0) position: vec3f, @location(1) normal: vec3f) -> Vertex {
    let grown = position + measure.grow * normal;
    return Vertex(view.clip_from_object * vec4f(grown, 1.0), position);
}

@fragment
fn fragment(in: Vertex) -> @location(0) f32 {
    return distance_from_lamp(in.position, view.sample_index);
}
