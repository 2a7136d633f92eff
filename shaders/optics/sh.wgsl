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

// The 64 of bands 0 to 7: order by order, each raised from l = m by the recurrence of normalised Legendre functions.
fn sh_basis_8(x: f32, y: f32, z: f32) -> array<f32, 64> {
    var basis: array<f32, 64>;
    var turn = vec2f(1.0, 0.0);
    var diagonal = 0.28209479177387814;
    for (var m = 0; m < 8; m++) {
        var before = 0.0;
        var value = diagonal;
        var step_before = 1.0;
        for (var l = m; l < 8; l++) {
            let centre = l * l + l;
            if m == 0 {
                basis[centre] = value;
            } else {
                basis[centre + m] = 1.4142135623730951 * value * turn.x;
                basis[centre - m] = 1.4142135623730951 * value * turn.y;
            }
            let above = f32(l + 1);
            let step = sqrt((4.0 * above * above - 1.0) / (above * above - f32(m * m)));
            let next = step * (z * value - before / step_before);
            before = value;
            value = next;
            step_before = step;
        }
        turn = vec2f(turn.x * x - turn.y * y, turn.x * y + turn.y * x);
        diagonal *= sqrt(f32(2 * m + 3) / f32(2 * m + 2));
    }
    return basis;
}
