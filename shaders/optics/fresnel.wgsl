// Reflectance of a smooth boundary between two dielectrics. Twin of src/optics/fresnel.rs.

// cos in [0, 1]; eta: index of the far side over that of the side the light comes from.
fn fresnel_dielectric(cos: f32, eta: f32) -> f32 {
    if eta == 1.0 {
        return 0.0;
    }
    // eta^2 cos_t^2, arranged so that near eta = 1 nothing cancels.
    let squared = (eta - 1.0) * (eta + 1.0) + cos * cos;
    if squared <= 0.0 {
        return 1.0;
    }
    let far = sqrt(squared);
    let cos_t = far / eta;
    let r_s = (cos - far) / (cos + far);
    let r_p = (eta * cos - cos_t) / (eta * cos + cos_t);
    return 0.5 * (r_s * r_s + r_p * r_p);
}
