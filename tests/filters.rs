//! Filtered normals and filtered light in pictures: small, linear, compared with formulas.

mod studio;

use diaphane::image::Image;
use std::sync::Arc;
use studio::{Studio, mean, most_apart, share_apart, studio};

const SUN: &str = "Directional(direction: (-1, -0.5, -1), irradiance: 3, shadow: false)";
const SKY: &str = "Environment(radiance: 1)";

/// Nothing is lost at its boundary, so that light is linear in the normal.
fn wax(studio: &Studio, filter: &str) {
    studio.write(
        "wax.ron",
        format!(
            "Material(version: 1, surface: (ior: 1), medium: AlbedoMfp(albedo: (0.9, 0.8, 0.7), mfp: 1), filter: {filter})"
        ),
    );
}

/// A sphere of radius 20 mm.
fn sphere(studio: &mut Studio, lights: &str, technique: &str) -> Arc<Image> {
    studio.scattered(&format!(
        "mm_per_unit: 10, camera: (eye: (0, 0, 9), target: (0, 0, 0), fov_y_deg: 30), lights: [{lights}],
         objects: [(mesh: Sphere(radius: 2, subdivisions: 3), material: \"wax.ron\")],
         view: (technique: {technique}, size: (48, 48), antialias: 1)"
    ))
}

#[test]
fn a_sphere_is_dimmed_by_the_weight_of_its_frequency_channel_by_channel() {
    let mut studio = studio();
    let omega = 2f64.sqrt() / 20.0;
    let gaussian = |width: f64| (-0.5 * (omega * width).powi(2)).exp();
    let exponential = |width: f64| (-omega * width).exp();
    for (filter, engine, expected) in [
        ("Gaussian(width: 8)", "Auto", [gaussian(8.0); 3]),
        ("Gaussian(width: (4, 8, 16))", "Auto", [4.0, 8.0, 16.0].map(gaussian)),
        ("Gaussian(width: (0, 8, 8))", "Harmonics", [0.0, 8.0, 8.0].map(gaussian)),
        ("Exponential(width: (9, 3, 1))", "Krylov", [9.0, 3.0, 1.0].map(exponential)),
        ("Curve(points: [(0, 1), (0.2, 0)])", "Auto", [1.0 - omega / 0.2; 3]),
        ("Gaussian(width: 8, length: Unit)", "Auto", [1.0; 3]),
        ("Gaussian(width: 0)", "Auto", [1.0; 3]),
        // Between the frequencies of its normals and the next ones.
        ("Box(wavelength: 60)", "Auto", [1.0; 3]),
    ] {
        wax(&studio, filter);
        for lights in [SUN, SKY] {
            let plain = sphere(&mut studio, lights, "Opaque()");
            let found = sphere(&mut studio, lights, &format!("FilteredNormals(engine: {engine})"));
            let limit = 6e-3 * mean(&plain).max(0.1);
            for (a, b) in found.pixels.iter().zip(&plain.pixels) {
                for c in 0..3 {
                    let apart = (a[c] as f64 - expected[c] * b[c] as f64).abs();
                    assert!(
                        apart < limit,
                        "{filter}, {lights}, channel {c}: {} is not {} of {}",
                        a[c],
                        expected[c],
                        b[c]
                    );
                }
            }
            assert!(mean(&plain) > 0.02, "there is something to see");
        }
    }
}

#[test]
fn even_light_stays_as_it_is_when_light_is_filtered() {
    let mut studio = studio();
    for filter in ["Gaussian(width: (4, 8, 16))", "FromMedium()", "Gaussian(width: 0.01)"] {
        wax(&studio, filter);
        let plain = sphere(&mut studio, SKY, "Opaque()");
        let found = sphere(&mut studio, SKY, "FilteredNormals(signal: Irradiance)");
        // 256 directions know half a sky to a hundredth, and filtered light has the mean of that.
        assert!(most_apart(&found, &plain) < 0.015, "{filter}: {}", most_apart(&found, &plain));
    }
    // A kernel that is narrower than the mesh leaves any light as it is.
    wax(&studio, "Gaussian(width: 0.01)");
    let plain = sphere(&mut studio, SUN, "Opaque()");
    let found = sphere(&mut studio, SUN, "FilteredNormals(signal: Irradiance)");
    // Light at vertices and light at pixels differ by what lies between vertices.
    assert!(most_apart(&found, &plain) < 0.03, "{}", most_apart(&found, &plain));
    wax(&studio, "Gaussian(width: 20)");
    let wide = sphere(&mut studio, SUN, "FilteredNormals(signal: Irradiance)");
    assert!(most_apart(&wide, &plain) > 0.1, "a wide one does not");
}

/// A plate in the sun, 80 mm wide, with a bar's shadow across it if the bar hangs over it, from above.
fn shaded(studio: &mut Studio, technique: &str, bar: f64) -> Vec<f64> {
    let image = studio.picture(&format!(
        "mm_per_unit: 10, camera: (eye: (0, 20, 0), target: (0, 0, 0), up: (0, 0, -1), fov_y_deg: 20),
         lights: [Directional(direction: (0.5, -1, 0), irradiance: 3)],
         objects: [
            (name: \"plate\", mesh: Slab(size: (8, 8, 1), segments: (32, 32)), material: \"wax.ron\",
             transform: (translate: (0, -0.5, 0), rotate_deg: (-90, 0, 0))),
            (name: \"bar\", mesh: Box(size: (2, 0.1, 20)), material: \"wax.ron\", transform: (translate: ({bar:?}, 10, 0)))],
         view: (technique: {technique}, size: (64, 64), antialias: 1)"
    ));
    (0..64).map(|x| image.at(x, 32)[0] as f64).collect()
}

#[test]
fn light_spreads_over_the_edge_of_a_shadow_and_none_is_lost() {
    let mut studio = studio();
    wax(&studio, "Gaussian(width: 10)");
    let steepest = |row: &[f64]| row.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
    let sharp = shaded(&mut studio, "Opaque()", -6.0);
    let soft = shaded(&mut studio, "FilteredNormals(signal: Irradiance)", -6.0);
    let normals = shaded(&mut studio, "FilteredNormals()", -6.0);
    println!("steepest: {:.3} {:.3} {:.3}", steepest(&sharp), steepest(&soft), steepest(&normals));
    assert!(steepest(&sharp) > 0.2, "{}", steepest(&sharp));
    assert!(steepest(&soft) < 0.35 * steepest(&sharp), "light spreads: {}", steepest(&soft));
    assert!(steepest(&normals) > 0.7 * steepest(&sharp), "normals do not: {}", steepest(&normals));
    // Away from shadows and edges there is nothing to spread.
    let even = shaded(&mut studio, "FilteredNormals(signal: Irradiance)", -90.0);
    let flat = shaded(&mut studio, "Opaque()", -90.0);
    println!("{even:.3?} {flat:.3?}");
    assert!(even[24..40].iter().zip(&flat[24..40]).all(|(a, b)| (a / b - 1.0).abs() < 0.01));
    let sum = |row: &[f64]| row.iter().sum::<f64>();
    assert!((sum(&soft) / sum(&sharp) - 1.0).abs() < 0.15, "{} {}", sum(&soft), sum(&sharp));
}

/// Shadows are looked up above the surface: along the normals of triangles that would cut each edge into teeth.
#[test]
fn triangles_are_not_seen_at_the_edge_of_a_shadow() {
    let mut studio = studio();
    wax(&studio, "Gaussian(width: 6)");
    let mut shaded = |subdivisions: u32| {
        studio.scattered(&format!(
            "mm_per_unit: 10, camera: (eye: (0, 0, 20), target: (0, 0, 0), fov_y_deg: 6), lights: [
                Directional(direction: (0.3, -0.5, -1), irradiance: 3)],
             objects: [
                (name: \"ball\", mesh: Sphere(radius: 2, subdivisions: {subdivisions}), material: \"wax.ron\"),
                (name: \"bar\", mesh: Box(size: (20, 0.6, 0.6)), material: \"wax.ron\",
                 transform: (translate: (-0.9, 1.7, 5), rotate_deg: (0, 0, 10)))],
             view: (technique: FilteredNormals(), size: (96, 96), antialias: 1)"
        ))
    };
    let [coarse, fine] = [4, 6].map(&mut shaded);
    let apart = share_apart(&coarse, &fine, 0.25 * mean(&fine));
    println!("{apart:.4} of the pixels are apart");
    assert!(apart < 0.01, "{apart}");
}
