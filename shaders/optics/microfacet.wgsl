// GGX: normals of a rough boundary, their masking and shadowing. Twin of src/optics/microfacet.rs.

// Density of microfacet normals per solid angle of them; 0 for the delta of a smooth boundary.
fn ggx_d(cos_h: f32, roughness: f32) -> f32 {
    let alpha = roughness * roughness;
    let q = (1.0 - cos_h) * (1.0 + cos_h) + alpha * alpha * cos_h * cos_h;
    if cos_h <= 0.0 || q == 0.0 {
        return 0.0;
    }
    let s = alpha / q;
    return s * s / 3.14159265358979;
}

// Height-correlated share of microfacets that see both the light and the eye.
fn smith_g2(cos_i: f32, cos_o: f32, roughness: f32) -> f32 {
    if cos_i <= 0.0 || cos_o <= 0.0 {
        return 0.0;
    }
    let alpha = roughness * roughness;
    let a = alpha * alpha;
    let root_i = sqrt(a + (1.0 - a) * cos_i * cos_i);
    let root_o = sqrt(a + (1.0 - a) * cos_o * cos_o);
    return 2.0 * cos_i * cos_o / (cos_o * root_i + cos_i * root_o);
}

// The glossy lobe without Fresnel, times the light's cosine: D G2 / (4 cos_o), 1/sr.
fn ggx_lobe(cos_i: f32, cos_o: f32, cos_h: f32, roughness: f32) -> f32 {
    let alpha = roughness * roughness;
    let a = alpha * alpha;
    let root_i = sqrt(a + (1.0 - a) * cos_i * cos_i);
    let root_o = sqrt(a + (1.0 - a) * cos_o * cos_o);
    let both = cos_o * root_i + cos_i * root_o;
    if cos_i <= 0.0 || cos_o < 0.0 || both == 0.0 {
        return 0.0;
    }
    return ggx_d(cos_h, roughness) * 0.5 * cos_i / both;
}
