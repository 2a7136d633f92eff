// How much stands in the way of light that goes straight through: the sum of sigma_t along the ray, back faces minus
// front faces. The ray is not bent where it enters.

#include "frame/scene.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> objects: array<Object>;

struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) @interpolate(flat) object: u32,
}

@vertex
fn vertex(@builtin(instance_index) index: u32, @location(0) position: vec3f) -> Vertex {
    var out: Vertex;
    out.position = eye_from_object(objects[index], position);
    out.clip = project(camera, out.position);
    out.object = index;
    return out;
}

// More than any light gets through, and small enough to be added up in halves.
const OPAQUE: f32 = 1000.0;

@fragment
fn fragment(in: Vertex, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let object = objects[in.object];
    if (object.flags & TRANSLUCENT) == 0u {
        return vec4f(OPAQUE, OPAQUE, OPAQUE, 0.0);
    }
    // Distances are counted from the object's middle, so that their differences survive as halves.
    let distance = length(in.position) - object.distance;
    return vec4f(object.sigma_t * distance * select(1.0, -1.0, front), 0.0);
}
