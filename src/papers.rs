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
    paper(
        "Bekaert2002",
        "P. Bekaert, M. Sbert & J. Halton. Accelerating Path Tracing by Re-Using Paths. Eurographics Workshop on Rendering 2002",
    ),
    paper(
        "Bobenko2007",
        "A. Bobenko & B. Springborn. A Discrete Laplace-Beltrami Operator for Simplicial Surfaces. DCG 38(4), 2007",
    ),
    paper("Botsch2004", "M. Botsch & L. Kobbelt. A Remeshing Approach to Multiresolution Modeling. SGP 2004"),
    paper("Chandrasekhar1960", "S. Chandrasekhar. Radiative Transfer. Dover, 1960"),
    paper(
        "Christensen2015",
        "P. Christensen & B. Burley. Approximate Reflectance Profiles for Efficient Subsurface Scattering. Pixar TM 15-04, 2015",
    ),
    paper(
        "Cigolle2014",
        "Z. Cigolle et al. A Survey of Efficient Representations for Independent Unit Vectors. JCGT 3(2), 2014",
    ),
    paper(
        "dEon2011",
        "E. d'Eon & G. Irving. A Quantized-Diffusion Model for Rendering Translucent Materials. SIGGRAPH 2011",
    ),
    paper("dEon2012", "E. d'Eon. A Better Dipole. 2012"),
    paper(
        "Doi1991",
        "A. Doi & A. Koide. An Efficient Method of Triangulating Equi-Valued Surfaces by Using Tetrahedral Cells. IEICE E74, 1991",
    ),
    paper(
        "Donner2005",
        "C. Donner & H. W. Jensen. Light Diffusion in Multi-Layered Translucent Materials. SIGGRAPH 2005",
    ),
    paper("Dupuy2023", "J. Dupuy & A. Benyoub. Sampling Visible GGX Normals with Spherical Caps. CGF 42(8), 2023"),
    paper(
        "Edelsbrunner1990",
        "H. Edelsbrunner & E. Mücke. Simulation of Simplicity: A Technique to Cope with Degenerate Cases. ACM TOG 9(1), 1990",
    ),
    paper(
        "Ericsson1980",
        "T. Ericsson & A. Ruhe. The Spectral Transformation Lanczos Method for the Numerical Solution of Large Sparse Generalized Symmetric Eigenvalue Problems. Mathematics of Computation 35, 1980",
    ),
    paper(
        "Felzenszwalb2012",
        "P. Felzenszwalb & D. Huttenlocher. Distance Transforms of Sampled Functions. Theory of Computing 8(19), 2012",
    ),
    paper(
        "Francois2006",
        "G. François, S. Pattanaik, K. Bouatouch & G. Breton. Subsurface Texture Mapping. IRISA PI 1806, 2006",
    ),
    paper("Green2004", "S. Green. Real-Time Approximations to Subsurface Scattering. GPU Gems 1, chapter 16, 2004"),
    paper(
        "Grimes1994",
        "R. Grimes, J. Lewis & H. Simon. A Shifted Block Lanczos Algorithm for Solving Sparse Symmetric Generalized Eigenproblems. SIAM J. Matrix Anal. Appl. 15(1), 1994",
    ),
    paper("Guettel2013", "S. Güttel. Rational Krylov Approximation of Matrix Functions. GAMM-Mitteilungen 36(1), 2013"),
    paper(
        "Habel2013",
        "R. Habel, P. Christensen & W. Jarosz. Photon Beam Diffusion: A Hybrid Monte Carlo Method for Subsurface Scattering. CGF 32(4), 2013",
    ),
    paper(
        "Heitz2014",
        "E. Heitz. Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs. JCGT 3(2), 2014",
    ),
    paper("Henyey1941", "L. Henyey & J. Greenstein. Diffuse Radiation in the Galaxy. Astrophysical Journal 93, 1941"),
    paper(
        "Jensen2001",
        "H. W. Jensen, S. Marschner, M. Levoy & P. Hanrahan. A Practical Model for Subsurface Light Transport. SIGGRAPH 2001",
    ),
    paper("Karis2013", "B. Karis. Real Shading in Unreal Engine 4. SIGGRAPH 2013 course on physically based shading"),
    paper("Keinert2015", "B. Keinert et al. Spherical Fibonacci Mapping. ACM TOG 34(6), 2015"),
    paper("Khronos2024", "Khronos Group. Khronos PBR Neutral Tone Mapper, 2024"),
    paper("King2013", "A. King, C. Kulla, A. Conty & M. Fajardo. BSSRDF Importance Sampling. SIGGRAPH 2013 talks"),
    paper(
        "Lafortune1996",
        "E. Lafortune & Y. Willems. Rendering Participating Media with Bidirectional Path Tracing. EGWR 1996",
    ),
    paper(
        "Maisch2020",
        "S. Maisch & T. Ropinski. Interactive Subsurface Scattering for Materials With High Scattering Distances. CGF 39(6), 2020",
    ),
    paper("Meisters1975", "G. H. Meisters. Polygons Have Ears. American Mathematical Monthly 82(6), 1975"),
    paper(
        "Miller2019",
        "B. Miller, I. Georgiev & W. Jarosz. A Null-Scattering Path Integral Formulation of Light Transport. ACM TOG 38(4), 2019",
    ),
    paper(
        "Novak2014",
        "J. Novák, A. Selle & W. Jarosz. Residual Ratio Tracking for Estimating Attenuation in Participating Media. ACM TOG 33(6), 2014",
    ),
    paper("OpenPBR2024", "Academy Software Foundation. OpenPBR Surface 1.1, 2024"),
    paper("Ottosson2020", "B. Ottosson. A Perceptual Color Space for Image Processing. 2020"),
    paper("Patro2007", "R. Patro. Real-Time Approximate Subsurface Scattering. 2007"),
    paper("Pharr2016", "M. Pharr, W. Jakob & G. Humphreys. Physically Based Rendering, third edition. 2016"),
    paper(
        "Ramamoorthi2001",
        "R. Ramamoorthi & P. Hanrahan. An Efficient Representation for Irradiance Environment Maps. SIGGRAPH 2001",
    ),
    paper("Sharp2020", "N. Sharp & K. Crane. A Laplacian for Nonmanifold Triangle Meshes. CGF 39(5), 2020"),
    paper(
        "Takahasi1974",
        "H. Takahasi & M. Mori. Double Exponential Formulas for Numerical Integration. Publ. RIMS 9(3), 1974",
    ),
    paper(
        "Thurmer1998",
        "G. Thürmer & C. Wüthrich. Computing Vertex Normals from Polygonal Facets. Journal of Graphics Tools 3(1), 1998",
    ),
    paper(
        "Tomaszewska2012",
        "A. Tomaszewska & K. Stefanowski. Real-Time Spherical Harmonics Based Subsurface Scattering. ICIAR 2012",
    ),
    paper("Vallet2008", "B. Vallet & B. Lévy. Spectral Geometry Processing with Manifold Harmonics. CGF 27(2), 2008"),
    paper(
        "Veach1997",
        "E. Veach. Robust Monte Carlo Methods for Light Transport Simulation. PhD thesis, Stanford, 1997",
    ),
    paper("Walter2007", "B. Walter et al. Microfacet Models for Refraction through Rough Surfaces. EGSR 2007"),
    paper(
        "Walter2009",
        "B. Walter, S. Zhao, N. Holzschuch & K. Bala. Single Scattering in Refractive Media with Triangle Mesh Boundaries. SIGGRAPH 2009",
    ),
    paper(
        "Wang2004",
        "Z. Wang, A. Bovik, H. Sheikh & E. Simoncelli. Image Quality Assessment: From Error Visibility to Structural Similarity. IEEE TIP 13(4), 2004",
    ),
    paper("Wilkie2014", "A. Wilkie et al. Hero Wavelength Spectral Sampling. EGSR 2014"),
];
