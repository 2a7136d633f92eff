// How much light a stack of layers over a half space sends back, by diffusion. Twin of src/optics/strata.rs.

const CLEAREST: f32 = 1e-3;

fn admittance(sigma_a: f32, sigma_s_prime: f32) -> f32 {
    return select(1.0, max(CLEAREST, sqrt(sigma_a / (sigma_a + sigma_s_prime))), sigma_a + sigma_s_prime > 0.0);
}

// The mean of exp(-x) for x from a to b.
fn mean_exp(a: f32, b: f32) -> f32 {
    let x = abs(b - a);
    let series = 1.0 - x * (0.5 - x * (1.0 / 6.0 - x / 24.0));
    return exp(-min(a, b)) * select((1.0 - exp(-x)) / max(x, 1e-20), series, x < 0.03);
}

// Admittance and what is returned of a half space, for light that goes down at `cos`.
fn below_all(sigma_a: f32, sigma_s_prime: f32, cos: f32) -> array<f32, 2> {
    let q = admittance(sigma_a, sigma_s_prime);
    return array<f32, 2>(q, sigma_s_prime / max(1e-30, sigma_a + sigma_s_prime) / (1.0 + 1.7320508 * q * cos));
}

// The same of a layer on top of what has `q` and `returned`.
fn on_top(sigma_a: f32, sigma_s_prime: f32, thickness: f32, cos: f32, q: f32, returned: f32) -> array<f32, 2> {
    let own = admittance(sigma_a, sigma_s_prime);
    let tau = (sigma_a + sigma_s_prime) * thickness;
    // In the layer the chance to leave is e^(-k z) and what the layer's end reflects of it.
    let k = 1.7320508 * own * tau;
    let reflected = (own - q) / (own + q);
    let down = tau / cos;
    let there_and_back = reflected * exp(-2.0 * k);
    let at_top = 1.0 + there_and_back;
    let scattered = sigma_s_prime * thickness / cos;
    let within = scattered * (mean_exp(0.0, down + k) + reflected * mean_exp(2.0 * k, down + k)) / at_top;
    let through = exp(-down - k) * (1.0 + reflected) / at_top;
    return array<f32, 2>(own * (1.0 - there_and_back) / at_top, within + through * returned);
}

// Of light that comes back, `all` by diffusion, the share that was scattered more than once: `once` comes back after one
// event, and `once_white` would without absorption.
fn often(all: f32, once: f32, once_white: f32, survival: f32) -> f32 {
    let more = (1.0 - once_white) * survival;
    return all * more / (once + more);
}
