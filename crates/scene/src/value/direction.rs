//! Directions as users write them: of any length but 0.

use glam::DVec3;

/// Magnitude of a vector's largest component below which the vector is scaled up, because squares
/// could underflow. Above the reciprocal of this magnitude it is scaled down.
const MIN_EXACT: f64 = 1e-100;

/// Scale factor, a power of two (2^600), so that scaling is exact.
const RESCALE: f64 = f64::from_bits((1023 + 600) << 52);

/// Returns `direction` scaled to length 1; `None` if it is zero or not finite.
pub fn unit(direction: impl Into<DVec3>) -> Option<DVec3> {
    let v = direction.into();
    let largest = v.abs().max_element();
    let near_one = if largest < MIN_EXACT {
        v * RESCALE
    } else if largest > MIN_EXACT.recip() {
        v / RESCALE
    } else {
        v
    };
    near_one.try_normalize()
}

#[cfg(test)]
mod tests {
    use super::unit;
    use glam::DVec3;

    #[test]
    fn unit_is_exact_for_every_power_of_two_length() {
        for v in [DVec3::new(0.3, -0.2, 0.9), DVec3::new(1.0, 1e-9, 0.0), DVec3::splat(-1.0)] {
            let expected = v.normalize();
            for exponent in [-980, -900, -664, -400, -333, -1, 0, 1, 332, 400, 664, 1022] {
                let scaled = v * f64::from(exponent).exp2();
                assert_eq!(unit(scaled), Some(expected), "{v} x 2^{exponent}");
            }
        }
        // These lengths are not powers of two, so the length of the result is rounded. The first
        // length is subnormal with 11 significant bits, so the result's direction is accurate only
        // to 1e-3.
        for length in [1e-320, 1e-200, 1e-101, 1e101, 1e200, 1.7e308] {
            let found = unit([0.0, -length, length]).unwrap();
            assert!((found - DVec3::new(0.0, -0.5f64.sqrt(), 0.5f64.sqrt())).length() < 1e-3);
            assert!((found.length() - 1.0).abs() < 1e-15, "{length}");
        }
        assert_eq!(unit([0.0, 5e-324, 0.0]), Some(DVec3::Y));
        let longest = unit([f64::MAX; 3]).unwrap();
        assert!((longest - DVec3::splat(3f64.sqrt().recip())).length() < 1e-15, "{longest}");
    }

    #[test]
    fn unit_of_zero_or_non_finite_vector_is_none() {
        for v in [[0.0; 3], [f64::NAN, 1.0, 0.0], [f64::INFINITY, 0.0, 0.0]] {
            assert_eq!(unit(v), None, "{v:?}");
        }
    }
}
