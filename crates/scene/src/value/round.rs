//! Rounding of computed numbers to short decimals.

/// Rounds `x` to a multiple of 10^`exponent`, as exactly as a double can represent it, but never
/// `-0`. Infinities and NaN are returned as they are.
pub fn rounded_to(x: f64, exponent: i32) -> f64 {
    if !x.is_finite() {
        return x;
    }
    let rounded = if exponent <= 0 {
        // Arithmetic with negative powers of ten is inexact: 35 * 0.01 is not 0.35.
        format!("{x:.*}", exponent.unsigned_abs().min(340) as usize).parse().unwrap_or(x)
    } else {
        let unit = 10f64.powi(exponent.min(300));
        (x / unit).round() * unit
    };
    rounded + 0.0
}

/// Rounds `x` to `digits` significant decimal digits, at least one.
pub fn round_significant(x: f64, digits: usize) -> f64 {
    if x.is_finite() { format!("{x:.*e}", digits.max(1) - 1).parse().unwrap_or(x) } else { x }
}

/// Returns the exponent of the largest power of ten not above |`x`|; 0 if `x` is 0 or not finite.
pub fn floor_log10(x: f64) -> i32 {
    if x == 0.0 || !x.is_finite() {
        return 0;
    }
    // The formatter is exact at powers of ten; a logarithm is off by one at some of them.
    format!("{:e}", x.abs()).rsplit_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0)
}

/// Rounds `x` to a multiple of 10^-4 P, where P is the largest power of ten that is at most
/// `scale`, the size of the object or scene.
pub fn round_nice(x: f64, scale: f64) -> f64 {
    rounded_to(x, floor_log10(scale) - 4)
}

/// Rounds `x` like [`round_nice`], but to a multiple of 10^-6 P.
pub fn round_fine(x: f64, scale: f64) -> f64 {
    rounded_to(x, floor_log10(scale) - 6)
}

/// Rotates `v` by `degrees` about the vertical, counter-clockwise seen from above. The heading is
/// rounded to thousandths of a degree, so that errors do not add up over repeated rotations.
pub fn rotated_y(v: [f64; 3], degrees: f64) -> [f64; 3] {
    let [x, y, z] = v;
    let horizontal = x.hypot(z);
    if horizontal == 0.0 || !horizontal.is_finite() {
        return v;
    }
    let heading = rounded_to((x.atan2(z).to_degrees() + degrees).rem_euclid(360.0), -3);
    let (sin, cos) = crate::value::sin_cos_degrees(heading);
    let digits = floor_log10(horizontal) - 6;
    [rounded_to(horizontal * sin, digits), y, rounded_to(horizontal * cos, digits)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_gives_nearest_decimal() {
        for (x, exponent, expected) in [
            (0.1 + 0.2, -4, 0.3),
            (0.34999, -2, 0.35),
            (-0.00001, -4, 0.0),
            (12345.0, 2, 12300.0),
            (1e-300, -302, 1e-300),
        ] {
            assert_eq!(rounded_to(x, exponent), expected, "{x}");
        }
        assert!(rounded_to(-1e-9, -2).is_sign_positive());
        assert!(rounded_to(f64::NAN, -2).is_nan());
        assert_eq!(round_significant(1.0 / 3.0, 3), 0.333);
        assert_eq!(round_significant(0.0, 3), 0.0);
        assert_eq!(round_significant(-123456.0, 2), -120000.0);
    }

    #[test]
    fn floor_log10_is_exact_at_powers_of_ten() {
        for e in -300..300 {
            let x: f64 = format!("1e{e}").parse().unwrap();
            assert_eq!((floor_log10(x), floor_log10(x * 9.99)), (e, e));
        }
        assert_eq!((floor_log10(0.0), floor_log10(f64::INFINITY)), (0, 0));
    }

    #[test]
    fn repeated_rotations_return_to_start() {
        let start = [0.3, -0.2, 0.7];
        let mut v = start;
        for _ in 0..7200 {
            v = rotated_y(v, 5.0);
        }
        for i in 0..3 {
            assert!((v[i] - start[i]).abs() < 2e-5, "{v:?}");
        }
        assert_eq!(rotated_y([0.0, 0.0, 1.0], 90.0), [1.0, 0.0, 0.0]);
        assert_eq!(rotated_y([0.0, 1.0, 0.0], 33.0), [0.0, 1.0, 0.0]);
    }
}
