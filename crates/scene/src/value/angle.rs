//! Angles as users write them: in degrees.

/// Returns sine and cosine of an angle in degrees, exact at multiples of 90.
pub fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    let angle = degrees.rem_euclid(360.0);
    match angle {
        0.0 | 360.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        _ => angle.to_radians().sin_cos(),
    }
}

#[cfg(test)]
mod tests {
    use super::sin_cos_degrees;

    #[test]
    fn sin_cos_of_quarter_turns_is_exact() {
        for k in -9i32..9 {
            let (s, c) = sin_cos_degrees(90.0 * f64::from(k));
            assert_eq!((s.abs() + c.abs(), s * c), (1.0, 0.0), "{k} quarter turns");
            for degrees in [1.0, 30.0, 45.0, 89.5] {
                let angle = 90.0 * f64::from(k) + degrees;
                let (s, c) = sin_cos_degrees(angle);
                let (t, d) = angle.to_radians().sin_cos();
                assert!((s - t).abs() < 1e-13 && (c - d).abs() < 1e-13, "{angle} degrees");
            }
        }
    }
}
