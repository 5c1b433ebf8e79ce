//! False-colour images of numbers such as depth and noise, with the scales of their colours.
//!
//! Magnitudes use the colour map *inferno* (Stéfan van der Walt and Nathaniel Smith, 2015). The
//! lightness of this map rises evenly, so that equal steps look equal, even without colour vision.

use crate::terminal::cells::Raster;

/// Mapping of a range of numbers to a colour map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Lower end of the range, which is dark unless the scale is reversed.
    pub low: f64,
    /// Upper end of the range, which is bright unless the scale is reversed.
    pub high: f64,
    /// `true` for a logarithmic scale, which requires `low` > 0. `false` for a linear one.
    pub logarithmic: bool,
    /// `true` if the scale is reversed: `low` is then bright.
    pub reversed: bool,
}

impl Scale {
    /// Creates a linear scale from `low` to `high`.
    pub fn linear(low: f64, high: f64) -> Self {
        Self { low, high, logarithmic: false, reversed: false }
    }

    /// Creates a logarithmic scale from the smallest to the largest positive finite number of
    /// `values`. The scale is from 1 to 10 if there are no such numbers.
    pub fn logarithmic(values: impl IntoIterator<Item = f64>) -> Self {
        let (mut low, mut high) = (f64::INFINITY, 0.0f64);
        for value in values.into_iter().filter(|v| *v > 0.0 && v.is_finite()) {
            low = low.min(value);
            high = high.max(value);
        }
        if low > high {
            (low, high) = (1.0, 10.0);
        }
        Self { low, high, logarithmic: true, reversed: false }
    }

    /// Returns the position of `value` in the colour map, from 0 (dark) to 1 (bright). NaN is shown
    /// like `low`.
    pub fn part(&self, value: f64) -> f64 {
        let [low, high, value] =
            [self.low, self.high, value].map(|v| if self.logarithmic { v.ln() } else { v });
        let part = if high > low { (value - low) / (high - low) } else { 1.0 };
        let part = if part.is_nan() { 0.0 } else { part.clamp(0.0, 1.0) };
        if self.reversed { 1.0 - part } else { part }
    }

    /// Returns the number at position `part` of the colour map. `part` is from 0 (dark) to 1
    /// (bright).
    pub fn value(&self, part: f64) -> f64 {
        let part = if self.reversed { 1.0 - part } else { part };
        if self.logarithmic {
            self.low * (self.high / self.low).powf(part)
        } else {
            self.low + (self.high - self.low) * part
        }
    }

    /// Returns the colour of `value` on this scale.
    pub fn color(&self, value: f64) -> [u8; 3] {
        magnitude(self.part(value))
    }
}

/// Returns the colour at position `part` of the colour map, from 0 (dark) to 1 (bright). Other
/// values are clamped.
pub fn magnitude(part: f64) -> [u8; 3] {
    let color = colorous::INFERNO.eval_continuous(part.clamp(0.0, 1.0));
    [color.r, color.g, color.b]
}

/// Colour of a difference of 0.
const DIFFERENCE_MIDDLE: [u8; 3] = [24, 24, 27];

/// Returns the colour of a signed difference: blue for -1 (darker), nearly black for 0, orange for
/// 1 (brighter).
pub fn difference(part: f64) -> [u8; 3] {
    const LESS: [u8; 3] = [96, 178, 255];
    const MORE: [u8; 3] = [255, 152, 64];
    let part = if part.is_nan() { 0.0 } else { part.clamp(-1.0, 1.0) };
    let end = if part < 0.0 { LESS } else { MORE };
    [0, 1, 2].map(|c| {
        let (from, to) = (f64::from(DIFFERENCE_MIDDLE[c]), f64::from(end[c]));
        (from + (to - from) * part.abs()).round() as u8
    })
}

/// Returns the colour of the object with number `id`. Consecutive numbers have distant hues.
pub fn object_color(id: u32) -> [u8; 3] {
    // The hue advances by the golden angle, so that no hue is repeated. Lightness and chroma take
    // turns, so that colours of similar hue differ as well.
    let hue = (f64::from(id) * 0.618_033_988_749_895).fract() * std::f64::consts::TAU;
    let lightness = [0.74, 0.58, 0.86][id as usize % 3];
    let chroma = [0.13, 0.15, 0.09][id as usize % 3];
    displayable(lightness, chroma, hue)
}

/// Converts OKLab in polar form to sRGB. Chroma is lowered until the colour is within the gamut.
fn displayable(lightness: f64, chroma: f64, hue: f64) -> [u8; 3] {
    let mut chroma = chroma;
    loop {
        let linear = linear_from_oklab(lightness, chroma * hue.cos(), chroma * hue.sin());
        if chroma < 0.005 || linear.iter().all(|c| (0.0..=1.0).contains(c)) {
            return linear.map(|c| crate::terminal::cells::oklab::code(c as f32));
        }
        chroma *= 0.95;
    }
}

/// Converts OKLab to linear sRGB (Ottosson 2020).
fn linear_from_oklab(l: f64, a: f64, b: f64) -> [f64; 3] {
    let [l, m, s] = [
        l + 0.396_337_777_4 * a + 0.215_803_757_3 * b,
        l - 0.105_561_345_8 * a - 0.063_854_172_8 * b,
        l - 0.089_484_177_5 * a - 1.291_485_548_0 * b,
    ]
    .map(|v| v * v * v);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ]
}

/// Colour of a pixel whose camera ray hits no object.
const NO_HIT: [u8; 3] = [14, 14, 16];

/// Returns an image of object numbers. `None` means that the camera ray hits no object.
pub fn objects(width: usize, height: usize, ids: &[Option<u32>]) -> Raster {
    Raster::from_fn(width, height, |i| ids.get(i).copied().flatten().map_or(NO_HIT, object_color))
}

/// Returns an image of unit normals. Each component is mapped from -1..=1 to 0..=255. `None` means
/// that the camera ray hits no object.
pub fn normals(width: usize, height: usize, normals: &[Option<[f32; 3]>]) -> Raster {
    Raster::from_fn(width, height, |i| {
        normals.get(i).copied().flatten().map_or(NO_HIT, |normal| {
            normal.map(|n| (255.0 * (0.5 * n + 0.5)).round().clamp(0.0, 255.0) as u8)
        })
    })
}

/// Returns an image of distances, and its scale. The scale is logarithmic, from the nearest
/// distance (bright) to the farthest (dark). `None` means that the camera ray hits no object.
pub fn depth(width: usize, height: usize, distances: &[Option<f32>]) -> (Raster, Scale) {
    let known = distances.iter().flatten().map(|d| f64::from(*d));
    let scale = Scale { reversed: true, ..Scale::logarithmic(known) };
    let raster = Raster::from_fn(width, height, |i| {
        distances.get(i).copied().flatten().map_or(NO_HIT, |d| scale.color(f64::from(d)))
    });
    (raster, scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terminal::cells::Oklab;

    #[test]
    fn scale_and_its_inverse_agree() {
        let log = Scale::logarithmic([0.0, 8.0, f64::INFINITY, 0.5, f64::NAN]);
        assert_eq!((log.low, log.high), (0.5, 8.0));
        for scale in [log, Scale::linear(-3.0, 9.0), Scale { reversed: true, ..log }] {
            for step in 0..=10 {
                let part = f64::from(step) / 10.0;
                assert!((scale.part(scale.value(part)) - part).abs() < 1e-12, "{scale:?}");
            }
            assert_eq!(scale.part(f64::NAN), f64::from(u8::from(scale.reversed)));
        }
        assert!((log.value(0.5) - 2.0).abs() < 1e-12);
        assert_eq!([log.part(0.1), log.part(100.0)], [0.0, 1.0]);
        let none = Scale::logarithmic([]);
        assert_eq!((none.low, none.high), (1.0, 10.0));
        // A scale over a single value shows it bright.
        assert_eq!(Scale::logarithmic([4.0]).part(4.0), 1.0);
    }

    #[test]
    fn equal_steps_of_magnitude_are_equal_steps_of_lightness() {
        let lightness: Vec<_> =
            (0..=16).map(|i| Oklab::of(magnitude(f64::from(i) / 16.0)).l).collect();
        for pair in lightness.windows(2).skip(2) {
            let step = pair[1] - pair[0];
            assert!((0.02..0.1).contains(&step), "{lightness:?}");
        }
    }

    #[test]
    fn difference_colors_are_symmetric() {
        assert_eq!(difference(0.0), DIFFERENCE_MIDDLE);
        assert_eq!(difference(f64::NAN), DIFFERENCE_MIDDLE);
        let middle = Oklab::of(DIFFERENCE_MIDDLE);
        let [less, more] = [-1.0, 1.0].map(|part| Oklab::of(difference(part)).distance(middle));
        assert!((less - more).abs() < 0.05, "{less} {more}");
    }

    #[test]
    fn object_colors_are_distinguishable() {
        // Checked for any two of the first 12 numbers, and for any two consecutive numbers.
        let distance = |a, b| Oklab::of(object_color(a)).distance(Oklab::of(object_color(b)));
        for a in 0..12 {
            for b in 0..a {
                assert!(distance(a, b) > 0.06, "{a} {b} {}", distance(a, b));
            }
        }
        for a in 0..1000 {
            assert!(distance(a, a + 1) > 0.15, "{a}");
        }
    }

    #[test]
    fn normals_depth_and_objects_map_to_colors() {
        let raster = normals(2, 1, &[Some([1.0, 0.0, -1.0]), None]);
        assert_eq!(raster.pixels, [[255, 128, 0], NO_HIT]);
        let (raster, scale) = depth(3, 1, &[Some(1.0), Some(4.0), None]);
        assert_eq!((scale.low, scale.high), (1.0, 4.0));
        assert_eq!(raster.pixels, [magnitude(1.0), magnitude(0.0), NO_HIT]);
        assert_eq!(objects(1, 1, &[None]).pixels, [NO_HIT]);
    }
}
