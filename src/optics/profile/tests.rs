use super::*;

fn channel(sigma_a: f64, sigma_s: f64, g: f64) -> Channel {
    Channel { sigma_a, sigma_s, g, phase: Phase::HenyeyGreenstein }
}

#[test]
fn golden_values() {
    let medium = channel(0.1, 0.9, 0.0);
    let profile = |model| Profile::new(model, medium, 1.33);
    let (beam, dipole, better) =
        (profile(Model::PhotonBeamDiffusion), profile(Model::Dipole), profile(Model::BetterDipole));
    let normalized = NormalizedDiffusion::of_albedo(0.9);
    for (r, ms, ss, classical, b, n) in [
        (0.01, 0.2796250, 4.587758, 0.06495735, 0.03317756, 6.810453),
        (0.1, 0.1055553, 0.2612586, 0.06395592, 0.03277093, 0.6433651),
        (0.5, 0.02942649, 0.01069718, 0.04563528, 0.02512811, 0.1009103),
        (1.0, 0.01266397, 0.001103233, 0.02149017, 0.01406736, 0.03807123),
        (2.0, 0.003858759, 3.38675e-5, 0.00476386, 0.004412329, 0.01158049),
        (5.0, 0.0002788982, 7.212957e-9, 0.0002401625, 0.0003050149, 0.001447996),
        (10.0, 7.354803e-6, 2.660923e-14, 5.998901e-6, 7.863486e-6, 0.0001413353),
    ] {
        let found = [beam.multiple(r), beam.single(r), dipole.r_d(r), better.r_d(r), normalized.value(r)];
        for (found, exact) in found.into_iter().zip([ms, ss, classical, b, n]) {
            println!("{r} {found:e} {exact:e} {:e}", found / exact - 1.0);
        }
    }
    println!("{} {} {}", beam.albedo(), dipole.albedo(), better.albedo());
}
