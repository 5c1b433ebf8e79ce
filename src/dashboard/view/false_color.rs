//! False-colour images of numbers.
//!
//! Magnitudes use the colour map *inferno* (Stéfan van der Walt and Nathaniel Smith, 2015), whose
//! lightness rises evenly. Equal steps therefore look equal, even to viewers without colour vision.

/// Logarithmic mapping of positive numbers to the colours of a colour map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Lower end, which is dark unless the scale is reversed.
    pub low: f64,
    /// Upper end, which is bright unless the scale is reversed.
    pub high: f64,
    pub reversed: bool,
}

impl Scale {
    /// Creates a scale from the smallest to the largest positive finite number of `values`, or from
    /// 1 to 10 if there is none.
    pub fn logarithmic(values: impl IntoIterator<Item = f64>) -> Self {
        let (low, high) = positive_range(values).unwrap_or((1.0, 10.0));
        Self { low, high, reversed: false }
    }

    /// Returns the position of `value` in the colour map, from 0 (dark) to 1 (bright). NaN is shown
    /// like `low`.
    pub fn part(&self, value: f64) -> f64 {
        let [low, high, value] = [self.low, self.high, value].map(f64::ln);
        let part = if high > low { (value - low) / (high - low) } else { 1.0 };
        let part = if part.is_nan() { 0.0 } else { part.clamp(0.0, 1.0) };
        if self.reversed { 1.0 - part } else { part }
    }

    /// Returns the number at the position `part` of the colour map.
    pub fn value(&self, part: f64) -> f64 {
        let part = if self.reversed { 1.0 - part } else { part };
        self.low * (self.high / self.low).powf(part)
    }

    pub fn color(&self, value: f64) -> [u8; 3] {
        magnitude(self.part(value))
    }
}

/// Returns the smallest and the largest positive finite number of `values`.
pub fn positive_range(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    let values = values.into_iter().filter(|v| *v > 0.0 && v.is_finite()).map(|v| (v, v));
    values.reduce(|(low, high), (value, _)| (low.min(value), high.max(value)))
}

/// Returns the colour at a position of the colour map, clamped to 0 (dark) to 1 (bright).
pub fn magnitude(part: f64) -> [u8; 3] {
    let color = colorous::INFERNO.eval_continuous(part.clamp(0.0, 1.0));
    [color.r, color.g, color.b]
}

/// False colour of a difference of 0.
const DIFFERENCE_MIDDLE: [u8; 3] = [24, 24, 27];

/// Returns the colour of a signed difference, clamped: blue at -1, nearly black at 0, orange at 1.
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
    // The hue advances by the golden section, so that no hue is repeated.
    let hue = (f64::from(id) * 0.618_033_988_749_895).fract();
    let color = colorous::SINEBOW.eval_continuous(hue);
    [color.r, color.g, color.b]
}

/// Colour of a pixel whose camera ray hits no object.
pub const NO_HIT: [u8; 3] = [14, 14, 16];

/// Returns the colour of a unit normal: components from -1 to 1 become channels from 0 to 255.
pub fn normal_color(normal: [f32; 3]) -> [u8; 3] {
    normal.map(|n| (255.0 * (0.5 * n + 0.5)).round().clamp(0.0, 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerkalo_terminal::cells::Oklab;

    #[test]
    fn scale_and_its_inverse_agree() {
        let log = Scale::logarithmic([0.0, 8.0, f64::INFINITY, 0.5, f64::NAN]);
        assert_eq!((log.low, log.high), (0.5, 8.0));
        for scale in [log, Scale { reversed: true, ..log }] {
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
        // If all values are equal, the scale shows them bright.
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
        // The colours of any two of the first 12 numbers must differ by more than 0.06 in OKLab.
        // Those of two consecutive numbers must differ by more than 0.15.
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
    fn normals_and_distances_map_to_colors() {
        assert_eq!(normal_color([1.0, 0.0, -1.0]), [255, 128, 0]);
        let scale = Scale { reversed: true, ..Scale::logarithmic([1.0, 4.0]) };
        assert_eq!([1.0, 4.0].map(|d| scale.color(d)), [1.0, 0.0].map(magnitude));
    }
}
