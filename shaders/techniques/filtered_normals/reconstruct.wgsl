// Filtered normals from their modes, one kernel at a time [Patro2007, eqs. 8-10]: an edit of the kernel runs this and
// nothing before it.

#include "lib/element.wgsl"

// What needs no mode: the mean over the component, and what all modes miss.
struct Ends {
    low: vec3f,
    // Which sample the vertex belongs to.
    sample: u32,
    high: vec3f,
}

const NOWHERE: u32 = 0xffffffffu;

@group(0) @binding(0) var<storage, read> ends: array<Ends>;
// Two halves a word: modes 2p and 2p + 1 of every sample, then the next two.
@group(0) @binding(1) var<storage, read> modes: array<u32>;
// The weights of both ends, then what is to be added of each mode.
@group(0) @binding(2) var<storage, read> weights: array<vec4f>;
#if UNIT
@group(0) @binding(3) var<storage, read> unfiltered: array<f32>;
#endif
@group(0) @binding(4) var<storage, read_write> normals: array<f32>;

@compute @workgroup_size(64)
fn compute(@builtin(global_invocation_id) id: vec3u) {
    let i = element(id);
    if i >= arrayLength(&ends) {
        return;
    }
    let vertex = ends[i];
    var sum = weights[0].x * vertex.low + weights[0].y * vertex.high;
    let count = arrayLength(&weights) - 1u;
    if vertex.sample != NOWHERE && count > 0u {
        let pairs = (count + 1u) / 2u;
        let stride = arrayLength(&modes) / pairs;
        for (var p = 0u; p < pairs; p++) {
            let values = unpack2x16float(modes[p * stride + vertex.sample]);
            sum += values.x * weights[2u * p + 1u].xyz;
            // The last pair may be half of one.
            sum += values.y * weights[min(2u * p + 2u, count)].xyz;
        }
    }
#if UNIT
    // Where normals cancelled there is no direction to keep.
    let size = length(sum);
    let own = vec3f(unfiltered[3u * i], unfiltered[3u * i + 1u], unfiltered[3u * i + 2u]);
    sum = select(own, sum / size, size > 0.0);
#endif
    normals[3u * i] = sum.x;
    normals[3u * i + 1u] = sum.y;
    normals[3u * i + 2u] = sum.z;
}
