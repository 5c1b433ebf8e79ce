//! Display transform of radiance to pixel values: exposure, tone curve, sRGB encoding.

use crate::film::srgb_table::SRGB_TABLE;
use zerkalo_scene::Tone;
use zerkalo_scene::value::srgb_from_linear;

/// Display transform: exposure, then tone curve, then sRGB encoding.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Display {
    /// Exposure in stops; 0 leaves radiance as it is.
    pub exposure_ev: f64,
    pub tone: Tone,
}

impl Display {
    /// Converts radiance to unrounded 8-bit levels, 0..=255.
    pub fn levels(&self, radiance: [f64; 3]) -> [f64; 3] {
        self.shown(radiance).map(|c| 255.0 * srgb_from_linear(c))
    }

    /// Returns a closure that converts radiance to levels as [`Display::levels`] does, and rounds
    /// them to 8 bits. A lookup table makes it several times faster.
    pub fn to_8(&self) -> impl Fn([f64; 3]) -> [u8; 3] + use<> {
        let (tone, factor, curve) = (self.tone, self.exposure_factor(), &*SRGB_TABLE);
        move |radiance| toned(tone, radiance.map(|c| c * factor)).map(|c| curve.level_8(c))
    }

    /// Converts radiance to linear light of the display, 0..=1.
    pub fn shown(&self, radiance: [f64; 3]) -> [f64; 3] {
        toned(self.tone, radiance.map(|c| c * self.exposure_factor()))
    }

    /// Returns the factor by which the exposure multiplies radiance.
    pub fn exposure_factor(&self) -> f64 {
        self.exposure_ev.exp2()
    }
}

/// Applies `tone` to `color`, which is radiance times the exposure factor. Returns 0..=1.
#[inline(always)]
pub(super) fn toned(tone: Tone, color: [f64; 3]) -> [f64; 3] {
    match tone {
        Tone::Clip => color.map(|c| c.clamp(0.0, 1.0)),
        Tone::Neutral => neutral(color).map(|c| c.clamp(0.0, 1.0)),
    }
}

/// Applies the Khronos PBR Neutral tone mapper, with the formulas of the specification.
#[inline(always)]
fn neutral(color: [f64; 3]) -> [f64; 3] {
    const F90: f64 = 0.04;
    const START: f64 = 0.8 - F90;
    const DESATURATION: f64 = 0.15;
    let least = color[0].min(color[1]).min(color[2]);
    let offset = if least < 2.0 * F90 { least - least * least / (4.0 * F90) } else { F90 };
    let color = color.map(|c| c - offset);
    let peak = color[0].max(color[1]).max(color[2]);
    if peak < START {
        return color;
    }
    let room = 1.0 - START;
    let new_peak = 1.0 - room * room / (peak + room - START);
    let to_white = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    color.map(|c| c * (new_peak / peak)).map(|c| c + (new_peak - c) * to_white)
}

/// Converts an unrounded level, 0..=255, to a 16-bit value; 255 becomes 65535.
pub fn quantised_16(level: f64) -> u16 {
    (level * (65535.0 / 255.0)).round() as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::quantised_8;
    use zerkalo_scene::value::linear_from_srgb;

    #[test]
    fn srgb_encoding_follows_the_standard() {
        // The two pieces of the sRGB curve (linear and power) join continuously, and every 8-bit
        // value round-trips.
        let [below, above] = [0.003_130_79, 0.003_130_81].map(srgb_from_linear);
        assert!((above - below).abs() < 1e-6 && above > below);
        for level in 0..=255u8 {
            let v = f64::from(level) / 255.0;
            let linear = linear_from_srgb(v);
            let levels = Display::default().levels([linear; 3]);
            assert!((levels[0] - f64::from(level)).abs() < 1e-5, "{level}: {levels:?}");
            assert_eq!(quantised_8(levels[1]), level);
            assert_eq!(quantised_16(levels[2]), u16::from(level) * 257);
        }
        let grey = Display::default().levels([0.5, 0.214_041_14, 0.01]);
        let expected = [187.515_6, 127.5, 25.463];
        (0..3).for_each(|c| assert!((grey[c] - expected[c]).abs() < 2e-3, "{grey:?}"));
    }

    #[test]
    fn quantisation_rounds_to_nearest_and_stays_in_range() {
        assert_eq!([0.49, 0.51, 254.49, 254.51].map(quantised_8), [0, 1, 254, 255]);
        assert_eq!([-3.0, 300.0, f64::NAN].map(quantised_8), [0, 255, 0]);
        assert_eq!([0.0, 127.5, 255.0].map(quantised_16), [0, 32_768, 65_535]);
    }

    #[test]
    fn exposure_multiplies_by_powers_of_two() {
        let bright = Display { exposure_ev: 3.0, tone: Tone::Clip };
        let plain = Display::default();
        assert_eq!(bright.levels([0.01, 0.1, 2.0]), plain.levels([0.08, 0.8, 1.0]));
    }

    /// Checks the tone mapper against values of the specification's shader, evaluated by hand in
    /// double precision.
    #[test]
    fn neutral_follows_its_publication() {
        let neutral = Display { exposure_ev: 0.0, tone: Tone::Neutral };
        // The toe of the curve ends at 0.08. A grey g below it becomes 6.25 g^2; a grey above it
        // becomes g - 0.04.
        let near = |got: [f64; 3], expected: [f64; 3]| {
            (0..3).for_each(|c| assert!((got[c] - expected[c]).abs() < 1e-12, "{got:?}"));
        };
        near(neutral.shown([0.04; 3]), [0.01; 3]);
        near(neutral.shown([0.2, 0.5, 0.7]), [0.16, 0.46, 0.66]);
        // A grey of 4 has the peak 4 - 0.04 = 3.96. It is compressed to 1 - 0.24^2 / (3.96 + 0.24 -
        // 0.76) = 0.983255813953...
        let peak = 1.0 - 0.0576 / 3.44;
        near(neutral.shown([4.0; 3]), [peak; 3]);
        // The smallest channel of this colour is 0, so nothing is subtracted. The peak of 2 is
        // compressed to 1 - 0.0576 / 1.48. The colour is then mixed with white of this peak; white
        // has the weight g.
        let peak = 1.0 - 0.0576 / 1.48;
        let g = 1.0 - 1.0 / (0.15 * (2.0 - peak) + 1.0);
        near(neutral.shown([2.0, 1.0, 0.0]), [peak, peak / 2.0 * (1.0 + g), peak * g]);
    }

    #[test]
    fn tone_curves_rise_and_stay_in_range() {
        for tone in Tone::ALL {
            let name = tone.name();
            assert_eq!(Tone::from_name(name), Some(tone));
            let display = Display { exposure_ev: 0.0, tone };
            let mut last = 0.0;
            for i in 0..20_000 {
                let [r, g, b] = display.levels([f64::from(i) * 1e-3; 3]);
                assert!(r >= last && r <= 255.0 && r == g && g == b, "{name} at {i}");
                last = r;
            }
            assert!(display.levels([1e30, 1e300, 0.0]).iter().all(|c| (0.0..=255.0).contains(c)));
        }
        assert_eq!(Tone::from_name("filmic"), None);
    }
}
