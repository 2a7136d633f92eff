//! From linear radiance to what a display is sent, a value in [0, 1] per channel.
//!
//! Exposure comes first: radiance times 2^`exposure_ev`. Then the curve.

use serde::{Deserialize, Serialize};

/// A tone curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Tone {
    /// Linear values cut off at 0 and 1 and stored as they are, for measuring in the file: 8-bit level 128 is a radiance
    /// of 128/255. It looks too dark unless the viewer honours the file's gamma chunk.
    Clamp,
    /// Cut off at 0 and 1, then the sRGB transfer function: what is not too bright is shown as it is.
    #[default]
    Srgb,
    /// A toe and a shoulder, then the sRGB transfer function: highlights roll off to white instead of being cut, and hue
    /// is kept. The curve is the Khronos PBR Neutral tone mapper [Khronos2024].
    Filmic,
}

impl Tone {
    /// The display value of a linear colour. Light below 0 is 0. All three channels must be finite.
    pub fn display(self, exposure_ev: f32, rgb: [f32; 3]) -> [f32; 3] {
        let exposed = rgb.map(|v| (v * exposure_ev.exp2()).max(0.0));
        match self {
            Tone::Clamp => exposed.map(|v| v.min(1.0)),
            Tone::Srgb => exposed.map(|v| srgb_from_linear(v.min(1.0))),
            Tone::Filmic => neutral(exposed).map(srgb_from_linear),
        }
    }
}

/// Linear in [0, inf) to linear in [0, 1], per colour and not per channel, so that a bright red stays red.
fn neutral(rgb: [f32; 3]) -> [f32; 3] {
    const F90: f32 = 0.04;
    const START: f32 = 0.8 - F90;
    const DESATURATION: f32 = 0.15;
    // A number above every radiance that matters; beyond it `peak + …` overflows and gives inf / inf.
    let rgb = rgb.map(|v| v.min(1e30));

    // The toe takes the veil of a 4 % reflection off the darks, quadratically where there is less than that to take.
    let low = rgb[0].min(rgb[1]).min(rgb[2]);
    let veil = if low < 2.0 * F90 { low - low * low / (4.0 * F90) } else { F90 };
    let rgb = rgb.map(|v| v - veil);
    let peak = rgb[0].max(rgb[1]).max(rgb[2]);
    if peak < START {
        return rgb;
    }
    // The shoulder: a hyperbola that leaves the straight line with its slope and tends to 1; far up it fades to white.
    let shoulder = 1.0 - START;
    let compressed = 1.0 - shoulder * shoulder / (peak + shoulder - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    rgb.map(|v| {
        let v = v * (compressed / peak);
        (v + (compressed - v) * white).min(1.0)
    })
}

/// The sRGB transfer function (IEC 61966-2-1) of a value in [0, 1].
pub fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.0031308 { 12.92 * linear } else { (1.055 * f64::from(linear).powf(1.0 / 2.4) - 0.055) as f32 }
}

/// The inverse of [`srgb_from_linear`].
pub fn linear_from_srgb(srgb: f32) -> f32 {
    if srgb <= 0.04045 { srgb / 12.92 } else { ((f64::from(srgb) + 0.055) / 1.055).powf(2.4) as f32 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TONES: [Tone; 3] = [Tone::Clamp, Tone::Srgb, Tone::Filmic];
    const COLOURS: [[f32; 3]; 5] =
        [[1.0, 1.0, 1.0], [1.0, 0.1, 0.0], [0.2, 0.9, 0.4], [0.01, 0.02, 1.0], [0.3, 0.3, 0.0]];

    #[test]
    fn the_transfer_function_has_its_knots_and_its_inverse() {
        assert_eq!([srgb_from_linear(0.0), srgb_from_linear(1.0)], [0.0, 1.0]);
        assert_eq!([linear_from_srgb(0.0), linear_from_srgb(1.0)], [0.0, 1.0]);
        assert!((srgb_from_linear(0.0031308) - 0.04045).abs() < 1e-6);
        // Both sides of the knot meet, and a published value: mid grey 0.18 is 0.46135.
        assert!((srgb_from_linear(0.0031309) - srgb_from_linear(0.0031308)).abs() < 3e-6);
        assert!((srgb_from_linear(0.18) - 0.461356).abs() < 1e-5);
        assert!((linear_from_srgb(0.5) - 0.214041).abs() < 1e-6);
        for level in 0..=255_u8 {
            let encoded = f32::from(level) / 255.0;
            assert_eq!((srgb_from_linear(linear_from_srgb(encoded)) * 255.0).round() as u8, level);
        }
    }

    #[test]
    fn every_curve_starts_at_black_grows_with_exposure_and_stays_within_the_display() {
        for tone in TONES {
            assert_eq!(tone.display(3.0, [0.0; 3]), [0.0; 3]);
            for colour in COLOURS {
                let mut last = [0.0; 3];
                for step in -1600..=1600 {
                    let shown = tone.display(step as f32 * 0.02, colour);
                    for c in 0..3 {
                        assert!((0.0..=1.0).contains(&shown[c]), "{tone:?} {colour:?} {step}: {shown:?}");
                        assert!(shown[c] >= last[c] - 2e-6, "{tone:?} {colour:?} {step}: {last:?} then {shown:?}");
                    }
                    last = shown;
                }
                if tone == Tone::Filmic {
                    assert!(last.iter().all(|&v| v > 0.999), "highlights end in white: {last:?}");
                }
            }
        }
        assert_eq!(Tone::Filmic.display(0.0, [f32::MAX; 3]), [1.0; 3]);
        assert_eq!(Tone::Srgb.display(0.0, [-1.0, 0.0, 7.0]), [0.0, 0.0, 1.0]);
    }

    #[test]
    fn clamp_is_linear_and_one_stop_doubles() {
        assert_eq!(Tone::Clamp.display(0.0, [0.25, 0.5, 3.0]), [0.25, 0.5, 1.0]);
        assert_eq!(Tone::Clamp.display(1.0, [0.25, 0.125, -1.0]), [0.5, 0.25, 0.0]);
        assert_eq!(Tone::Srgb.display(-1.0, [1.0; 3]), [srgb_from_linear(0.5); 3]);
    }

    #[test]
    fn the_shoulder_leaves_the_line_smoothly_and_keeps_the_order_of_channels() {
        // Below the shoulder and above the toe the curve is the line less 0.04; at its start, value and slope agree.
        let grey = |v: f32| neutral([v; 3])[0];
        assert!((grey(0.5) - 0.46).abs() < 1e-6);
        let slope = (grey(0.802) - grey(0.8)) / 0.002;
        assert!((grey(0.8) - 0.76).abs() < 1e-6 && (slope - 1.0).abs() < 0.02, "{slope}");
        let [r, g, b] = Tone::Filmic.display(2.0, [1.0, 0.3, 0.1]);
        assert!(r > g && g > b && g < 0.95, "a bright orange is not white: {r} {g} {b}");
        assert_ne!(Tone::Filmic.display(0.0, [0.9; 3]), Tone::Srgb.display(0.0, [0.9; 3]));
    }
}
