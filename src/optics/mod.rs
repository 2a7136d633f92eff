//! Light and matter: what a medium and its boundary do to light, in scalar f64.
//!
//! Lengths are millimetres and coefficients 1/mm, angles are given by their cosines. Nothing here reads a file or knows
//! a GPU. What a shader must evaluate per pixel has a twin of the same name and argument order in `shaders/optics`, in
//! the file of the same stem; all else is computed here and travels as a table.
//!
//! | module | what |
//! |---|---|
//! | [`medium`] | coefficients, all that derives from them, and every spelling of a medium |
//! | [`presets`] | measured media by name |
//! | [`half_space`] | the exact multiple-scattering albedo under a Fresnel boundary, and its inverse |
//! | [`fresnel`] | reflectance of a dielectric boundary and its moments |
//! | [`microfacet`] | the glossy lobe of a rough boundary, and how much it reflects in all |
//! | [`phase`] | where a scattered photon goes |
//! | [`profile`] | how far from where it entered light leaves: dipoles, photon beams, normalised diffusion |
//! | [`sh`] | real spherical harmonics and what convolution does to them |
//! | [`strata`] | how much light layers over a half space send back |
//! | [`slab`] | how much light comes out behind a slab |
//! | [`quadrature`] | Gauss-Legendre rules, plain and crowded at an end or a peak, and a double exponential one |

pub mod fresnel;
pub mod half_space;
pub mod medium;
pub mod microfacet;
pub mod phase;
pub mod presets;
pub mod profile;
pub mod quadrature;
mod root;
pub mod sh;
pub mod slab;
pub mod strata;

/// One value per channel, linear Rec.709; arithmetic is channel by channel.
pub type Rgb = glam::DVec3;

#[cfg(test)]
mod tests {
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    fn validate(source: &str) -> Result<naga::Module, String> {
        let module = naga::front::wgsl::parse_str(source).map_err(|e| e.emit_to_string(source))?;
        Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(&module)
            .map_err(|e| e.emit_to_string(source))?;
        Ok(module)
    }

    #[test]
    fn every_twin_is_valid_wgsl_and_has_its_functions() {
        for (source, functions) in [
            (include_str!("../../shaders/optics/fresnel.wgsl"), &["fresnel_dielectric"][..]),
            (include_str!("../../shaders/optics/microfacet.wgsl"), &["ggx_d", "smith_g2", "ggx_lobe"]),
            (
                include_str!("../../shaders/optics/strata.wgsl"),
                &["admittance", "mean_exp", "below_all", "on_top", "often"],
            ),
            (include_str!("../../shaders/optics/sh.wgsl"), &["sh_basis_3", "sh_basis_8"]),
        ] {
            let module = validate(source).unwrap_or_else(|e| panic!("{e}"));
            let found: Vec<_> = module.functions.iter().filter_map(|(_, f)| f.name.as_deref()).collect();
            assert_eq!(found, functions);
        }
        assert!(validate("fn f() -> f32 { return 1u; }").is_err());
    }
}
