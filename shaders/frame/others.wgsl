// How much of a lamp's light other things let through to a point of an object that is not in its own way. Object space.

struct OthersView {
    clip_from_object: mat4x4f,
    // Views of one sample of the lamp: 1, or the 6 faces of a cube.
    per_sample: u32,
}

@group(0) @binding(12) var<storage, read> others_views: array<OthersView>;
@group(0) @binding(13) var others_map: texture_depth_2d_array;
@group(0) @binding(14) var compare: sampler_comparison;

// Of the lamp's sample i.
fn past_others(point: vec3f, i: i32) -> f32 {
    let per_sample = others_views[0].per_sample;
    for (var face = 0u; face < per_sample; face++) {
        let view = u32(i) * per_sample + face;
        let clip = others_views[view].clip_from_object * vec4f(point, 1.0);
        if clip.w > 0.0 && all(abs(clip.xy) <= vec2f(clip.w)) && clip.z > 0.0 && clip.z <= clip.w {
            let uv = vec2f(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w);
            return textureSampleCompareLevel(others_map, compare, uv, view, clip.z / clip.w);
        }
    }
    // What lies outside the map has nothing between itself and the lamp.
    return 1.0;
}
