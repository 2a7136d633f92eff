//! The bakes and passes of filtered normals.

use crate::geometry::laplacian::Areas;
use crate::geometry::mesh::Mesh;
use crate::geometry::neighbours;
use crate::geometry::spectrum::kernel::Kernel;
use crate::geometry::spectrum::{Band, Basis, harmonic_normals, krylov_normals};
use crate::gpu::{Buffer, Gpu};
use crate::problem::Problem;
use crate::store::{Bake, Run, Slot, Step};
use glam::Vec3;
use half::f16;
use serde::Serialize;

pub(super) const CODE: &[&str] = &["src/geometry/", "src/techniques/filtered_normals/"];

/// Normals after Patro's neighbour kernel.
#[derive(Serialize)]
pub(super) struct NeighbourNormals {
    pub mesh: Slot<Mesh>,
    pub mm_per_unit: f64,
    pub kernel: neighbours::Kernel,
    pub length: neighbours::Length,
}

impl Step for NeighbourNormals {
    type Output = Vec<Vec3>;
    fn name(&self) -> &'static str {
        "filtered_normals.neighbours"
    }
    fn about(&self) -> String {
        match self.kernel.sigma_tr > 0.0 {
            true => format!(
                "normals averaged over neighbours, weights falling by e in {:.3} mm",
                1.0 / self.kernel.sigma_tr
            ),
            false => "normals averaged over all neighbours alike".into(),
        }
    }
    fn run(&self, run: &Run) -> Result<Vec<Vec3>, Problem> {
        let mesh = run.get(self.mesh);
        let tick = |share| run.tick(share);
        let normals = neighbours::filter_normals(&mesh, self.mm_per_unit, &self.kernel, self.length, &tick)?;
        Ok(normals.iter().map(|normal| normal.as_vec3()).collect())
    }
}

impl Bake for NeighbourNormals {
    const CODE: &'static [&'static str] = CODE;
}

/// Normals in a basis that is made for them, for smooth kernels.
#[derive(Serialize)]
pub(super) struct KrylovNormals {
    pub mesh: Slot<Mesh>,
    pub laplacian: Areas,
    /// Where kernels have their knees: a coarse step, so that most edits of a kernel find the same basis.
    pub band: Band,
}

impl Step for KrylovNormals {
    type Output = Basis;
    fn name(&self) -> &'static str {
        "filtered_normals.krylov"
    }
    fn about(&self) -> String {
        format!("the normals in a basis of their own, for smooth kernels around {}", self.band)
    }
    fn run(&self, run: &Run) -> Result<Basis, Problem> {
        krylov_normals(&run.get(self.mesh), self.laplacian, self.band, &|share| run.tick(share))
    }
}

impl Bake for KrylovNormals {
    const CODE: &'static [&'static str] = CODE;
}

/// Normals in the eigenpairs of the mesh.
#[derive(Serialize)]
pub(super) struct HarmonicNormals {
    pub mesh: Slot<Mesh>,
    pub laplacian: Areas,
    /// Frequencies beyond are not needed, rad per unit.
    pub highest: f64,
    #[serde(skip)]
    pub why: &'static str,
}

impl Step for HarmonicNormals {
    type Output = Basis;
    fn name(&self) -> &'static str {
        "filtered_normals.harmonics"
    }
    fn about(&self) -> String {
        format!("the normals in the mesh's eigenpairs, since {}", self.why)
    }
    fn run(&self, run: &Run) -> Result<Basis, Problem> {
        harmonic_normals(&run.get(self.mesh), self.laplacian, self.highest, &|share| run.tick(share))
    }
}

impl Bake for HarmonicNormals {
    const CODE: &'static [&'static str] = CODE;
}

/// Modes as the device has them, two halves a word: modes 2p and 2p + 1 of sample i are word p stride + i.
pub(super) fn halves(columns: &[f32], samples: usize) -> Vec<u32> {
    let mut words = Vec::with_capacity(columns.len() / 2);
    for pair in columns.chunks(2 * samples.max(1)) {
        let (low, high) = pair.split_at(samples);
        let half = |column: &[f32], i: usize| column.get(i).map_or(0, |v| f16::from_f32(*v).to_bits() as u32);
        words.extend((0..stride(samples)).map(|i| match i < samples {
            true => half(low, i) | half(high, i) << 16,
            false => 0,
        }));
    }
    words
}

/// Samples of a mode, up to a multiple of a workgroup.
pub(super) fn stride(samples: usize) -> usize {
    samples.next_multiple_of(64)
}

/// The modes of a basis on the device.
#[derive(Serialize)]
pub(super) struct UploadModes {
    pub basis: Slot<Basis>,
}

impl Step for UploadModes {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        "the modes of the normals to the device, as halves".into()
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let basis = run.get(self.basis);
        Ok(Buffer::new(run.host::<Gpu>(), bytemuck::cast_slice(&halves(&basis.columns, basis.samples))))
    }
}

/// What a filter does not need modes for, on the device.
#[derive(Serialize)]
pub(super) struct UploadEnds {
    pub basis: Slot<Basis>,
}

/// `Ends` of `shaders/techniques/filtered_normals/reconstruct.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Ends {
    low: Vec3,
    sample: u32,
    high: Vec3,
    padding: u32,
}

pub(super) const ENDS_STRIDE: u32 = size_of::<Ends>() as u32;

impl Step for UploadEnds {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        "both ends of the normals' spectrum to the device".into()
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let basis = run.get(self.basis);
        let ends = |v: usize| Ends { low: basis.low[v], sample: basis.sample[v], high: basis.high[v], padding: 0 };
        let ends: Vec<Ends> = (0..basis.sample.len()).map(ends).collect();
        Ok(Buffer::new(run.host::<Gpu>(), bytemuck::cast_slice(&ends)))
    }
}

/// A kernel as numbers on the device: the weights of both ends, then what is to be added of each mode.
#[derive(Serialize)]
pub(super) struct KernelWeights {
    pub basis: Slot<Basis>,
    pub kernel: Kernel,
    pub mm_per_unit: f64,
}

impl Step for KernelWeights {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "filtered_normals.kernel"
    }
    fn about(&self) -> String {
        format!("{:?} for each mode", self.kernel)
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let basis = run.get(self.basis);
        let weights = basis.weights(&self.kernel, self.mm_per_unit);
        let mut table = vec![[weights.low as f32, weights.high as f32, 0.0, 0.0]];
        let modes = weights.modes.iter().zip(&basis.coefficients);
        table.extend(modes.map(|(weight, c)| (*weight * *c).as_vec3().extend(0.0).to_array()));
        Ok(Buffer::new(run.host::<Gpu>(), bytemuck::cast_slice(&table)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_lie_two_halves_to_a_word() {
        let (samples, modes) = (130, 5);
        let columns: Vec<f32> = (0..samples * modes).map(|i| (1.3 * i as f32).sin()).collect();
        let words = halves(&columns, samples);
        assert_eq!(words.len(), stride(samples) * 3);
        for (k, column) in columns.chunks(samples).enumerate() {
            for (i, value) in column.iter().enumerate() {
                let bits = words[k / 2 * stride(samples) + i] >> (16 * (k % 2));
                assert_eq!(f16::from_bits(bits as u16), f16::from_f32(*value), "mode {k}, sample {i}");
            }
        }
        // What has no mode or no sample is 0.
        assert!((0..stride(samples)).all(|i| words[2 * stride(samples) + i] >> 16 == 0));
        assert!((0..3).all(|p| (samples..stride(samples)).all(|i| words[p * stride(samples) + i] == 0)));
    }
}
