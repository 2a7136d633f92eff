// What is left of light that crosses a thickness, per channel: a table over the square root of the thickness.

struct Transmittance {
    rgb: vec3f,
}

@group(0) @binding(15) var<storage, read> transmittances: array<Transmittance>;

// `share` of the table's end.
fn transmittance(share: f32) -> vec3f {
    let last = arrayLength(&transmittances) - 1u;
    let at = sqrt(clamp(share, 0.0, 1.0)) * f32(last);
    let low = min(u32(at), last - 1u);
    return mix(transmittances[low].rgb, transmittances[low + 1u].rgb, at - f32(low));
}

// How much light from behind counts, for the cosine between the normal and the way to the lamp.
fn behind(cos: f32) -> f32 {
    let half = 0.5 * (1.0 - clamp(cos, -1.0, 1.0));
    return half * half * half;
}
