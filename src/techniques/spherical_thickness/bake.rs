//! What is baked of an object, and how it travels to the device.

use crate::geometry::mesh::Mesh;
use crate::geometry::thickness::{self, Harmonics, project};
use crate::gpu::{Buffer, Gpu};
use crate::problem::{Problem, counted};
use crate::store::{Bake, Run, Slot, Step};
use crate::techniques::attenuation::{Response, behind};
use half::f16;
use serde::Serialize;
use std::f64::consts::PI;

/// How thick an object is in every direction.
#[derive(Serialize)]
pub struct Lengths {
    pub mesh: Slot<Mesh>,
    pub directions: usize,
}

impl Step for Lengths {
    type Output = thickness::Lengths;
    fn name(&self) -> &'static str {
        "thickness.lengths"
    }
    fn about(&self) -> String {
        format!("how thick it is from each vertex, in {} directions", self.directions)
    }
    fn run(&self, run: &Run) -> Result<thickness::Lengths, Problem> {
        thickness::lengths(&run.get(self.mesh), self.directions, &|share| run.tick(share))
    }
}

impl Bake for Lengths {
    const CODE: &'static [&'static str] = &["src/geometry/"];
}

/// Its thickness as spherical harmonics, in shares of `end` scene units.
#[derive(Serialize)]
pub struct ThicknessSeries {
    pub lengths: Slot<thickness::Lengths>,
    pub end: f64,
    pub bands: usize,
}

impl Step for ThicknessSeries {
    type Output = Harmonics;
    fn name(&self) -> &'static str {
        "thickness.series"
    }
    fn about(&self) -> String {
        format!("thickness as {}", counted(self.bands * self.bands, "spherical harmonic"))
    }
    fn run(&self, run: &Run) -> Result<Harmonics, Problem> {
        let lengths = run.get(self.lengths);
        let tick = |share| run.tick(share);
        project(&lengths, None, self.bands, |span| [span.share * lengths.diagonal / self.end], &tick)
    }
}

impl Bake for ThicknessSeries {
    const CODE: &'static [&'static str] = &["src/geometry/thickness/", "src/optics/sh.rs"];
}

/// What is left of light from each direction as spherical harmonics, per channel.
#[derive(Serialize)]
pub struct TransmittanceSeries {
    pub lengths: Slot<thickness::Lengths>,
    pub mesh: Slot<Mesh>,
    pub mm_per_unit: f64,
    pub response: Response,
    pub bands: usize,
    /// Whether light counts as it does on a slab.
    pub is_balanced: bool,
}

impl Step for TransmittanceSeries {
    type Output = Harmonics;
    fn name(&self) -> &'static str {
        "thickness.transmittance"
    }
    fn about(&self) -> String {
        format!(
            "what comes through from everywhere, as {} a channel",
            counted(self.bands * self.bands, "spherical harmonic")
        )
    }
    fn run(&self, run: &Run) -> Result<Harmonics, Problem> {
        let (lengths, mesh) = (run.get(self.lengths), run.get(self.mesh));
        let left = self.response.function();
        let mm = lengths.diagonal * self.mm_per_unit;
        let tick = |share| run.tick(share);
        if !self.is_balanced {
            return project(&lengths, None, self.bands, |span| left(span.share * mm).to_array(), &tick);
        }
        // What has left another part of the object before it comes here is no light that entered once.
        let response = |span: thickness::Span| if span.inwards { left(span.share * mm).to_array() } else { [0.0; 3] };
        project(&lengths, Some((&mesh.normals, &behind)), self.bands, response, &tick)
    }
}

impl Bake for TransmittanceSeries {
    const CODE: &'static [&'static str] = &[
        "src/geometry/thickness/",
        "src/optics/",
        "src/techniques/attenuation.rs",
        "src/techniques/spherical_thickness/bake.rs",
    ];
}

/// 4-byte words that hold the coefficients of a vertex and channel as halves.
pub fn words(bands: usize) -> usize {
    (bands * bands).div_ceil(2)
}

fn halves(series: &Harmonics) -> Vec<f16> {
    let count = series.bands * series.bands;
    let padded = 2 * words(series.bands);
    let of_channel = |channel: &[f32]| {
        let mut halves: Vec<f16> = channel.iter().map(|c| f16::from_f32(*c)).collect();
        halves.resize(padded, f16::ZERO);
        halves
    };
    series.values.chunks_exact(count).flat_map(of_channel).collect()
}

/// Coefficients on the device.
#[derive(Serialize)]
pub struct Halves {
    pub series: Slot<Harmonics>,
}

impl Step for Halves {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        "coefficients to the device, as halves".into()
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        Ok(Buffer::new(run.host::<Gpu>(), bytemuck::cast_slice(&halves(&run.get(self.series)))))
    }
}

/// The share of what enters at each vertex that does not go through: in even surroundings as much goes one way as the other,
/// and that is the first coefficient.
#[derive(Serialize)]
pub struct Kept {
    pub series: Slot<Harmonics>,
    pub is_balanced: bool,
}

impl Step for Kept {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "spherical_thickness.kept"
    }
    fn about(&self) -> String {
        "the share of light that does not go through, to the device".into()
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let series = run.get(self.series);
        let count = series.bands * series.bands;
        let kept: Vec<[f32; 4]> = series
            .values
            .chunks_exact(3 * count)
            .map(|vertex| {
                let share = |channel: usize| {
                    // ∫ f = sqrt(4 pi) c_0, of the pi that all light weighs.
                    let through = (4.0 / PI).sqrt() * f64::from(vertex[channel * count]);
                    if self.is_balanced { (1.0 - through).max(0.0) as f32 } else { 1.0 }
                };
                [share(0), share(1), share(2), 0.0]
            })
            .collect();
        Ok(Buffer::new(run.host::<Gpu>(), bytemuck::cast_slice(&kept)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes;
    use crate::geometry::thickness::antipodal_directions;
    use crate::optics::Rgb;
    use crate::optics::medium::Medium;
    use crate::optics::sh::sh_basis;

    /// As the shader sums them up, given each coefficient's number.
    fn series(basis: &[f64], at: impl Fn(usize) -> f64) -> f64 {
        basis.iter().enumerate().map(|(i, y)| y * at(i)).sum()
    }

    #[test]
    fn halves_are_good_to_a_thousandth() {
        let mesh = shapes::torus_knot(2, 3, 1.0, 0.3, (60, 10));
        let lengths = thickness::lengths(&mesh, 256, &|_| Ok(())).unwrap();
        for bands in [2, 5, 8] {
            let found =
                project(&lengths, None, bands, |span| [(-20.0 * span.share).exp(), span.share], &|_| Ok(())).unwrap();
            let halves = halves(&found);
            let (mut worst, mut most) = (0.0f64, 0.0f64);
            for v in (0..mesh.positions.len()).step_by(7) {
                for direction in antipodal_directions(64) {
                    let basis = sh_basis(direction, bands);
                    for channel in 0..2 {
                        let exact = series(&basis, |i| f64::from(found.at(v, channel)[i]));
                        let first = (2 * v + channel) * 2 * words(bands);
                        let half = series(&basis, |i| halves[first + i].to_f64());
                        (worst, most) = (worst.max((exact - half).abs()), most.max(exact.abs()));
                    }
                }
            }
            println!("{bands} bands: halves change values by {worst:.1e} of {most:.2}");
            assert!(worst < 1e-3 * most && worst > 1e-9, "{bands}: {worst} of {most}");
        }
    }

    /// In white surroundings what stays and what comes through is what went in.
    #[test]
    fn no_more_light_comes_out_than_went_in() {
        let mesh = shapes::torus(1.0, 0.3, (30, 12));
        let lengths = thickness::lengths(&mesh, 256, &|_| Ok(())).unwrap();
        for density in [1e-3, 0.1, 1.0, 10.0, 1e3] {
            let medium = Medium::coefficients(Rgb::ZERO, Rgb::splat(density), Rgb::ZERO);
            let left = Response::Slab { medium, ior: 1.4 }.function();
            let response =
                |span: thickness::Span| if span.inwards { [left(span.share * lengths.diagonal).x] } else { [0.0] };
            let found = project(&lengths, Some((&mesh.normals, &behind)), 1, response, &|_| Ok(())).unwrap();
            let shares = found.values.iter().map(|c| (4.0 / PI).sqrt() * f64::from(*c));
            let most = shares.fold(0.0, f64::max);
            println!("density {density}: at most {most:.3} goes through");
            assert!((0.0..=1.0).contains(&most), "{density}: {most}");
        }
    }
}
