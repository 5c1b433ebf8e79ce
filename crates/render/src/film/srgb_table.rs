//! Lookup table for the sRGB encoding. A lookup is many times faster than the power function of the
//! exact encoding.

use std::sync::LazyLock;
use zerkalo_scene::value::srgb_from_linear;

/// Binary logarithm of the number of segments per octave (factor of 2) of linear light.
const SEGMENTS_LOG2: u32 = 7;
/// First octave of the table, which begins at 2^-9. Smaller values are in the linear part of the
/// sRGB encoding, which ends at 0.0031308.
const FIRST_OCTAVE: i32 = -9;
const SHIFT: u32 = 52 - SEGMENTS_LOG2;
/// Number that is subtracted from the upper bits of a double to get its index in the table. Entry 0
/// is the linear part of the encoding; entry 1 begins at 2^[`FIRST_OCTAVE`].
const BASE: u64 = (((1023 + FIRST_OCTAVE) as u64) << SEGMENTS_LOG2) - 1;
const ENTRIES: usize = ((-FIRST_OCTAVE as usize) << SEGMENTS_LOG2) + 2;

/// Largest difference between the sRGB table and the exact encoding, in 8-bit levels.
const MAX_ERROR: f64 = 5.5e-4;

/// Piecewise linear approximation of the sRGB encoding, exact at 128 points per octave of linear
/// light.
pub(super) struct SrgbTable {
    /// Line through each segment: its level at linear light 0, and its slope in levels.
    chords: [[f64; 2]; ENTRIES],
}

pub(super) static SRGB_TABLE: LazyLock<SrgbTable> = LazyLock::new(SrgbTable::tabulated);

impl SrgbTable {
    fn tabulated() -> Self {
        let mut chords = [[0.0; 2]; ENTRIES];
        chords[0] = [0.0, 255.0 * 12.92];
        let node = |i: usize| f64::from_bits((BASE + i as u64) << SHIFT);
        for (i, chord) in chords.iter_mut().enumerate().skip(1) {
            let (from, to) = (node(i), node(i + 1));
            let (low, high) = (255.0 * srgb_from_linear(from), 255.0 * srgb_from_linear(to));
            let slope = (high - low) / (to - from);
            *chord = [low - slope * from, slope];
        }
        Self { chords }
    }

    /// Encodes linear light 0..=1 as an unrounded 8-bit level, with an error below [`MAX_ERROR`].
    #[inline(always)]
    pub fn level(&self, linear: f64) -> f64 {
        let entry = (linear.to_bits() >> SHIFT).saturating_sub(BASE) as usize;
        let [at_zero, slope] = self.chords[entry.min(ENTRIES - 1)];
        at_zero + slope * linear
    }

    /// Encodes linear light 0..=1 as the nearest 8-bit level of the exact encoding.
    #[inline]
    pub fn level_8(&self, linear: f64) -> u8 {
        let above = self.level(linear) + 0.5;
        let nearest = above.floor();
        if (above - nearest - 0.5).abs() >= 0.5 - MAX_ERROR {
            return quantised_8(255.0 * srgb_from_linear(linear));
        }
        nearest as u8
    }
}

/// Rounds a level to the nearest of 0..=255; NaN becomes 0.
pub fn quantised_8(level: f64) -> u8 {
    level.round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerkalo_scene::value::linear_from_srgb;

    #[test]
    fn table_error_is_within_its_bound() {
        let mut worst = 0.0f64;
        for i in 0..=1_000_000 {
            let even = f64::from(i) * 1e-6;
            for linear in [even, even * even * even] {
                let exact = 255.0 * srgb_from_linear(linear);
                worst = worst.max((SRGB_TABLE.level(linear) - exact).abs());
            }
        }
        assert!(worst < MAX_ERROR, "{worst}");
        assert!(worst > MAX_ERROR / 2.0, "the stated bound is too loose: {worst}");
    }

    #[test]
    fn eight_bit_values_equal_the_exact_encoding() {
        let exact = |linear| quantised_8(255.0 * srgb_from_linear(linear));
        for i in 0..=200_000 {
            let linear = f64::from(i) * 5e-6;
            assert_eq!(SRGB_TABLE.level_8(linear), exact(linear), "{linear}");
        }
        // Tests values whose relative distance from a border between two 8-bit values is at most
        // 2e-5.
        for border in (0..255).map(|level| (f64::from(level) + 0.5) / 255.0) {
            let linear = linear_from_srgb(border);
            for step in -2000..=2000 {
                let linear = linear * (1.0 + f64::from(step) * 1e-8);
                assert_eq!(SRGB_TABLE.level_8(linear), exact(linear), "{linear}");
            }
        }
    }

    #[test]
    fn table_is_exact_at_both_ends() {
        assert_eq!(SRGB_TABLE.level(0.0), 0.0);
        assert!((SRGB_TABLE.level(1.0) - 255.0).abs() < 1e-12);
        assert_eq!(SRGB_TABLE.level(f64::MIN_POSITIVE), 255.0 * 12.92 * f64::MIN_POSITIVE);
    }
}
