//! Intervals of numbers that are valid as values of keys in scene files.

use std::fmt;

/// Interval of finite numbers; NaN and the infinities are outside every interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberRange {
    /// Lower bound of the interval; negative infinity for none.
    pub low: f64,
    /// `true` if `low` belongs to the interval.
    pub low_in: bool,
    /// Upper bound of the interval; infinity for none.
    pub high: f64,
    /// `true` if `high` belongs to the interval.
    pub high_in: bool,
}

/// Largest coordinate and largest size for which geometry is guaranteed to be accurate.
const MAX_COORDINATE: f64 = 1e9;

impl NumberRange {
    /// Range of all finite numbers.
    pub const FINITE: Self =
        Self { low: f64::NEG_INFINITY, low_in: false, high: f64::INFINITY, high_in: false };
    /// Range of coordinates: from -1e9 to 1e9.
    pub const COORDINATE: Self = Self::closed(-MAX_COORDINATE, MAX_COORDINATE);
    /// Range of sizes: greater than 0, at most 1e9.
    pub const SIZE: Self = Self::above(0.0, MAX_COORDINATE);
    /// Range of fractions: from 0 to 1.
    pub const SHARE: Self = Self::closed(0.0, 1.0);

    /// Range of coefficients and of channels of surface colours: from 0 to 1e6.
    pub const COEFFICIENT: Self = Self::closed(0.0, 1e6);
    /// Range of amounts of light, such as radiance: from 0 to 1e15.
    pub const LIGHT: Self = Self::closed(0.0, 1e15);

    /// Creates the interval from `low` to `high`, both included.
    pub const fn closed(low: f64, high: f64) -> Self {
        Self { low, low_in: true, high, high_in: true }
    }

    /// Creates the interval of the numbers greater than `low` and at most `high`.
    pub const fn above(low: f64, high: f64) -> Self {
        Self { low, low_in: false, high, high_in: true }
    }

    /// Creates the interval between `low` and `high`, both excluded.
    pub const fn between(low: f64, high: f64) -> Self {
        Self { low, low_in: false, high, high_in: false }
    }

    /// Returns `true` if `x` is in the interval.
    pub fn holds(&self, x: f64) -> bool {
        x.is_finite()
            && (x > self.low || self.low_in && x == self.low)
            && (x < self.high || self.high_in && x == self.high)
    }
}

/// Formats the interval as the continuation of the phrase `a number`, such as `from 0 to 1`.
impl fmt::Display for NumberRange {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (low, high) = (number(self.low), number(self.high));
        match (self.low_in, self.high_in) {
            _ if self.low.is_infinite() => f.write_str("other than inf and nan"),
            (true, _) => write!(f, "from {low} to {high}"),
            (false, false) => {
                write!(f, "between {low} and {high} ({low} and {high} are excluded)")
            }
            (false, true) => write!(f, "greater than {low}, at most {high}"),
        }
    }
}

/// Formats a number in short form, such as `0.5`, `-3` or `NaN`. It has an exponent, as in `1e9`,
/// if its magnitude is below 1e-4 or at least 1e6.
pub fn number(x: f64) -> String {
    let plain = x == 0.0 || !x.is_finite() || (1e-4..1e6).contains(&x.abs());
    if plain { format!("{x}") } else { format!("{x:e}") }
}

#[cfg(test)]
mod tests {
    use super::{NumberRange, number};

    #[test]
    fn bounds_are_included_as_declared() {
        for (range, inside, outside) in [
            (NumberRange::SHARE, vec![0.0, 0.5, 1.0], vec![-1e-300, 1.0 + 1e-15]),
            (NumberRange::SIZE, vec![5e-324, 1e9], vec![0.0, -1.0, 1.1e9]),
            (NumberRange::between(0.0, 180.0), vec![1e-9, 179.9], vec![0.0, 180.0]),
            (NumberRange::FINITE, vec![f64::MAX, f64::MIN], vec![]),
        ] {
            assert!(inside.iter().all(|x| range.holds(*x)), "{range}");
            for x in outside.into_iter().chain([f64::NAN, f64::INFINITY, f64::NEG_INFINITY]) {
                assert!(!range.holds(x), "{x} {range}");
            }
        }
    }

    #[test]
    fn numbers_are_formatted_short() {
        let shown: Vec<_> = [0.5, -3.0, 1e9, f64::NAN, 1e-300, 0.0].map(number).into();
        assert_eq!(shown, ["0.5", "-3", "1e9", "NaN", "1e-300", "0"]);
    }
}
