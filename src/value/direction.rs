//! Directions as users write them: of any length but 0.

use glam::DVec3;

/// Vectors whose largest component lies between this and its inverse keep their digits when they are squared.
const PLAIN: f64 = 1e-100;

/// Brings every other vector there: 2^600, so that no digit changes.
const SHIFT: f64 = f64::from_bits((1023 + 600) << 52);

/// `direction` with length 1, whatever finite length it has; `None` if that is 0.
pub fn unit(direction: impl Into<DVec3>) -> Option<DVec3> {
    let v = direction.into();
    let largest = v.abs().max_element();
    let near_one = if largest < PLAIN {
        v * SHIFT
    } else if largest > PLAIN.recip() {
        v / SHIFT
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
    fn every_length_but_zero_gives_the_same_bits() {
        for v in [DVec3::new(0.3, -0.2, 0.9), DVec3::new(1.0, 1e-9, 0.0), DVec3::splat(-1.0)] {
            let expected = v.normalize();
            for exponent in [-980, -900, -664, -400, -333, -1, 0, 1, 332, 400, 664, 1022] {
                let scaled = v * f64::from(exponent).exp2();
                assert_eq!(unit(scaled), Some(expected), "{v} x 2^{exponent}");
            }
        }
        // Lengths that are no powers of two are rounded otherwise, by no more than that.
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
    fn what_points_nowhere_has_no_direction() {
        for v in [[0.0; 3], [f64::NAN, 1.0, 0.0], [f64::INFINITY, 0.0, 0.0]] {
            assert_eq!(unit(v), None, "{v:?}");
        }
    }
}
