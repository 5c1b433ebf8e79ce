//! OKLab: a colour space in which distances approximate visible differences.
//!
//! Björn Ottosson, "A perceptual color space for image processing" (2020), with the matrices for
//! linear sRGB as he published them in 2021.

use std::sync::LazyLock;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Oklab {
    /// Lightness, from 0 (black) to 1 (white).
    pub l: f32,
    /// Green (negative) to red (positive), within sRGB -0.24..=0.28.
    pub a: f32,
    /// Blue (negative) to yellow (positive), within sRGB -0.32..=0.2.
    pub b: f32,
}

/// Linear light of each 8-bit sRGB level (IEC 61966-2-1).
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|level| match level as f64 / 255.0 {
        level if level <= 0.04045 => (level / 12.92) as f32,
        level => ((level + 0.055) / 1.055).powf(2.4) as f32,
    })
});

/// Converts 8-bit sRGB to linear light, 0..=1.
pub fn linear(rgb: [u8; 3]) -> [f32; 3] {
    let table = &*LINEAR;
    rgb.map(|level| table[usize::from(level)])
}

/// Returns the 8-bit sRGB level whose linear light is nearest to `linear`, clamped to 0..=1.
pub fn level(linear: f32) -> u8 {
    let table = &*LINEAR;
    let above = table.partition_point(|l| *l < linear).min(255);
    let below = above.saturating_sub(1);
    if linear - table[below] < table[above] - linear { below as u8 } else { above as u8 }
}

impl Oklab {
    /// Converts 8-bit sRGB to OKLab.
    pub fn of(rgb: [u8; 3]) -> Self {
        Self::of_linear(linear(rgb))
    }

    /// Converts linear sRGB to OKLab.
    pub fn of_linear(rgb: [f32; 3]) -> Self {
        Self::of_linear_by(rgb, f32::cbrt)
    }

    fn of_linear_by([r, g, b]: [f32; 3], cube_root: impl Fn(f32) -> f32) -> Self {
        let l = cube_root(0.412_221_47 * r + 0.536_332_54 * g + 0.051_445_993 * b);
        let m = cube_root(0.211_903_5 * r + 0.680_699_5 * g + 0.107_396_96 * b);
        let s = cube_root(0.088_302_46 * r + 0.281_718_84 * g + 0.629_978_7 * b);
        Self {
            l: 0.210_454_26 * l + 0.793_617_8 * m - 0.004_072_047 * s,
            a: 1.977_998_5 * l - 2.428_592_2 * m + 0.450_593_7 * s,
            b: 0.025_904_037 * l + 0.782_771_77 * m - 0.808_675_77 * s,
        }
    }

    /// Converts 8-bit sRGB with an error of at most 1e-4, several times as fast as [`Self::of`].
    pub(crate) fn nearly(pixels: &[[u8; 3]]) -> Vec<Self> {
        let table: &[f32; 256] = &LINEAR;
        let cube_root = |x: f32| {
            // A third of the exponent, and a step of Halley's method.
            let y = f32::from_bits(x.to_bits() / 3 + 0x2a51_37a0);
            let cube = y * y * y;
            y * (cube + 2.0 * x) / (2.0 * cube + x)
        };
        let linear = |rgb: &[u8; 3]| rgb.map(|level| table[usize::from(level)]);
        pixels.iter().map(|rgb| Self::of_linear_by(linear(rgb), cube_root)).collect()
    }

    /// Returns the Euclidean distance. It is 1 between black and white; about 0.02 is just visible
    /// side by side.
    pub fn distance(self, other: Self) -> f32 {
        self.distance_squared(other).sqrt()
    }

    pub(crate) fn distance_squared(self, other: Self) -> f32 {
        let (l, a, b) = (self.l - other.l, self.a - other.a, self.b - other.b);
        l * l + a * a + b * b
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(got: Oklab, [l, a, b]: [f32; 3], tolerance: f32) {
        let worst = (got.l - l).abs().max((got.a - a).abs()).max((got.b - b).abs());
        assert!(worst < tolerance, "{got:?}, not {:?}", [l, a, b]);
    }

    /// Checks the conversion from XYZ to OKLab against the pairs of colours in the publication of
    /// OKLab, which gives them rounded to three places.
    #[test]
    fn oklab_matches_published_pairs() {
        // Linear sRGB from CIE XYZ at D65 (IEC 61966-2-1).
        let from_xyz = |[x, y, z]: [f32; 3]| {
            [
                3.240_625_5 * x - 1.537_208 * y - 0.498_628_6 * z,
                -0.968_930_7 * x + 1.875_756_1 * y + 0.041_517_524 * z,
                0.055_710_12 * x - 0.204_021_05 * y + 1.056_995_9 * z,
            ]
        };
        for (xyz, lab) in [
            ([0.950, 1.000, 1.089], [1.000, 0.000, 0.000]),
            ([1.000, 0.000, 0.000], [0.450, 1.236, -0.019]),
            ([0.000, 1.000, 0.000], [0.922, -0.671, 0.263]),
            ([0.000, 0.000, 1.000], [0.153, -1.415, -0.449]),
        ] {
            near(Oklab::of_linear(from_xyz(xyz)), lab, 2e-3);
        }
    }

    /// Checks the OKLab values of the sRGB primaries against CSS Color 4 and its test suite.
    #[test]
    fn oklab_of_primaries_matches_css() {
        near(Oklab::of([255, 255, 255]), [1.0, 0.0, 0.0], 1e-4);
        near(Oklab::of([0, 0, 0]), [0.0, 0.0, 0.0], 1e-6);
        near(Oklab::of([255, 0, 0]), [0.627_96, 0.224_86, 0.125_85], 1e-4);
        near(Oklab::of([0, 255, 0]), [0.866_44, -0.233_89, 0.179_5], 1e-4);
        near(Oklab::of([0, 0, 255]), [0.452_01, -0.032_46, -0.311_53], 1e-4);
    }

    #[test]
    fn fast_conversion_is_close() {
        let colors: Vec<_> =
            (0..4096).map(|i| [i / 256, i / 16 % 16, i % 16].map(|c| (c * 17) as u8)).collect();
        for (fast, rgb) in Oklab::nearly(&colors).into_iter().zip(colors) {
            assert!(fast.distance(Oklab::of(rgb)) < 1e-4, "{rgb:?}");
        }
    }

    #[test]
    fn levels_and_linear_light_round_trip() {
        for c in 0..=255u8 {
            assert_eq!(level(linear([c; 3])[0]), c);
        }
        assert_eq!([level(-1.0), level(2.0), level(f32::NAN)], [0, 255, 0]);
        // The threshold between two levels is the midpoint of their linear light.
        let [low, high] = [100, 101].map(|c| linear([c; 3])[0]);
        assert_eq!([level(0.51 * low + 0.49 * high), level(0.49 * low + 0.51 * high)], [100, 101]);
    }
}
