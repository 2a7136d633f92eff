// Phase functions, 1/sr, by the cosine between two directions that both point away. Twin of src/optics/phase.rs.

// For the mean cosine g.
fn henyey_greenstein(cos: f32, g: f32) -> f32 {
    // 1 + g^2 + 2 g cos, arranged so that nothing cancels in the peak.
    let a = abs(g);
    let q = (1.0 - a) * (1.0 - a) + 2.0 * a * max(0.0, 1.0 + sign(g) * cos);
    return 0.07957747154594767 * (1.0 - a) * (1.0 + a) / (q * sqrt(q));
}

// For a k that is not the mean cosine.
fn schlick(cos: f32, k: f32) -> f32 {
    let a = abs(k);
    let q = 1.0 - a + a * max(0.0, 1.0 + sign(k) * cos);
    return 0.07957747154594767 * (1.0 - a) * (1.0 + a) / (q * q);
}
