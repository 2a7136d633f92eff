//! The bibliography. Comments and manuals cite these keys: `[Patro2007, eq. 3]`.

/// A work that this project builds on.
pub struct Paper {
    pub key: &'static str,
    pub text: &'static str,
}

const fn paper(key: &'static str, text: &'static str) -> Paper {
    Paper { key, text }
}

pub const PAPERS: &[Paper] = &[
    paper(
        "Andersson2020",
        "P. Andersson et al. FLIP: A Difference Evaluator for Alternating Images. Proc. ACM CGIT 3(2), 2020",
    ),
    paper("Chandrasekhar1960", "S. Chandrasekhar. Radiative Transfer. Dover, 1960"),
    paper(
        "Cigolle2014",
        "Z. Cigolle et al. A Survey of Efficient Representations for Independent Unit Vectors. JCGT 3(2), 2014",
    ),
    paper(
        "dEon2011",
        "E. d'Eon & G. Irving. A Quantized-Diffusion Model for Rendering Translucent Materials. SIGGRAPH 2011",
    ),
    paper(
        "Francois2006",
        "G. François, S. Pattanaik, K. Bouatouch & G. Breton. Subsurface Texture Mapping. IRISA PI 1806, 2006",
    ),
    paper("Green2004", "S. Green. Real-Time Approximations to Subsurface Scattering. GPU Gems 1, chapter 16, 2004"),
    paper(
        "Heitz2014",
        "E. Heitz. Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs. JCGT 3(2), 2014",
    ),
    paper(
        "Jensen2001",
        "H. W. Jensen, S. Marschner, M. Levoy & P. Hanrahan. A Practical Model for Subsurface Light Transport. SIGGRAPH 2001",
    ),
    paper("Karis2013", "B. Karis. Real Shading in Unreal Engine 4. SIGGRAPH 2013 course on physically based shading"),
    paper(
        "Maisch2020",
        "S. Maisch & T. Ropinski. Interactive Subsurface Scattering for Materials With High Scattering Distances. CGF 39(6), 2020",
    ),
    paper("OpenPBR2024", "Academy Software Foundation. OpenPBR Surface 1.1, 2024"),
    paper("Ottosson2020", "B. Ottosson. A Perceptual Color Space for Image Processing. 2020"),
    paper("Patro2007", "R. Patro. Real-Time Approximate Subsurface Scattering. 2007"),
    paper(
        "Ramamoorthi2001",
        "R. Ramamoorthi & P. Hanrahan. An Efficient Representation for Irradiance Environment Maps. SIGGRAPH 2001",
    ),
    paper(
        "Tomaszewska2012",
        "A. Tomaszewska & K. Stefanowski. Real-Time Spherical Harmonics Based Subsurface Scattering. ICIAR 2012",
    ),
    paper("Walter2007", "B. Walter et al. Microfacet Models for Refraction through Rough Surfaces. EGSR 2007"),
    paper(
        "Wang2004",
        "Z. Wang, A. Bovik, H. Sheikh & E. Simoncelli. Image Quality Assessment: From Error Visibility to Structural Similarity. IEEE TIP 13(4), 2004",
    ),
];
