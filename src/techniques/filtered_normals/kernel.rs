//! The kernels that a material asks for, channel by channel, in mm.

use crate::geometry::neighbours;
use crate::geometry::spectrum::kernel::Kernel;
use crate::scene::{Filter, Length, Material, Substance, Triple, Weights};

/// How a material's normals are to be filtered.
pub(super) enum Kernels {
    Neighbours([neighbours::Kernel; 3]),
    Spectral([Kernel; 3]),
}

/// Scattering that reaches farther than this share of half the object's size would average the normals of a closed object
/// to nothing, as it never does with light: this is as far as the medium's own kernel goes.
const FARTHEST: f64 = 1.0 / 3.0;

impl Kernels {
    /// For an object half of whose size is `half`, mm. None for what is opaque.
    pub fn of(material: &Material, half: f64) -> Option<Kernels> {
        let each = |triple: &Triple, kernel: fn(f64) -> Kernel| Kernels::Spectral(triple.0.map(kernel));
        Some(match &material.filter {
            Filter::Neighbours(k) => Kernels::Neighbours(k.sigma_tr.0.map(|sigma_tr| neighbours::Kernel {
                sigma_tr,
                radius: k.radius,
                alpha: k.alpha,
                weights: match k.weights {
                    Weights::Area => neighbours::Weights::Area,
                    Weights::Uniform => neighbours::Weights::Uniform,
                },
            })),
            Filter::Gaussian(k) => each(&k.width, |width| Kernel::Gaussian { width }),
            Filter::Exponential(k) => each(&k.width, |width| Kernel::Exponential { width }),
            Filter::Diffusion(k) => each(&k.time_mm2, |time| Kernel::Diffusion { time }),
            Filter::Box(k) => each(&k.wavelength, |wavelength| Kernel::Box { wavelength }),
            Filter::Normalized(k) => each(&k.std, |std| Kernel::Normalized { std }),
            Filter::Curve(k) => Kernels::Spectral([0; 3].map(|_| Kernel::Curve { points: k.points.clone() })),
            Filter::FromMedium(_) => {
                let Substance::Translucent(medium) = &material.medium else { return None };
                let sigma_tr = medium.sigma_tr().to_array();
                Kernels::Spectral(sigma_tr.map(|s| Kernel::Medium { sigma_tr: s.max(1.0 / (FARTHEST * half)) }))
            }
        })
    }

    /// How far light spreads, mm, the mean of the channels. Infinite where that is the mesh's to say.
    pub fn reach(&self) -> f64 {
        let mean = |lengths: [f64; 3]| lengths.iter().sum::<f64>() / 3.0;
        match self {
            Kernels::Neighbours(kernels) => {
                mean(kernels.each_ref().map(|kernel| (1.0 / kernel.sigma_tr).min(kernel.radius)))
            }
            Kernels::Spectral(kernels) => {
                mean(kernels.each_ref().map(|kernel| kernel.knee().map_or(f64::INFINITY, |knee| 1.0 / knee)))
            }
        }
    }
}

pub(super) fn length(material: &Material) -> neighbours::Length {
    match material.filter.length() {
        Length::Keep => neighbours::Length::Keep,
        Length::Unit => neighbours::Length::Unit,
    }
}
