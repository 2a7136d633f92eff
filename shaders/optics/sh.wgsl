// Real spherical harmonics. Twin of src/optics/sh.rs.

// The nine of bands 0 to 2 at the unit direction (x, y, z), at index l * l + l + m.
fn sh_basis_3(x: f32, y: f32, z: f32) -> array<f32, 9> {
    return array<f32, 9>(
        0.28209479177387814,
        0.4886025119029199 * y,
        0.4886025119029199 * z,
        0.4886025119029199 * x,
        1.0925484305920792 * x * y,
        1.0925484305920792 * y * z,
        0.31539156525252005 * (3.0 * z * z - 1.0),
        1.0925484305920792 * x * z,
        0.5462742152960396 * (x * x - y * y),
    );
}
