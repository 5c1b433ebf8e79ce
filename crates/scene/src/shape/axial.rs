//! Shared code of cylinder, cone and tapered cylinder: an axis between two points.

use crate::shape::texture_space::around_axis;
use crate::value::{ValidationError, Validator, unit};
use glam::{DAffine3, DMat3, DVec3};
use zerkalo_kernel::primitive::Form;

/// Returns the frustum from `base` to `top`, which differ. The radii are at least 0 and not both 0.
pub(super) fn frustum_between(
    base: [f64; 3],
    top: [f64; 3],
    base_radius: f64,
    top_radius: f64,
) -> Form {
    let (base, top) = (DVec3::from_array(base), DVec3::from_array(top));
    // The wider end becomes the canonical base, which has radius 1.
    let (start, end, wide, narrow) = if base_radius >= top_radius {
        (base, top, base_radius, top_radius)
    } else {
        (top, base, top_radius, base_radius)
    };
    let axis = end - start;
    let (u, v) = unit(axis).unwrap_or(DVec3::Y).any_orthonormal_pair();
    let linear = DMat3::from_cols(u * wide, v * wide, axis);
    Form::conical_frustum(DAffine3::from_mat3_translation(linear, start), narrow / wide)
}

/// Methods of [`ShapeDesc`](crate::shape::ShapeDesc) that depend only on the axis from `$base` to
/// `$top`.
macro_rules! by_axis {
    ($base:ident, $top:ident, radius) => {
        fn fit(&mut self, base: glam::DVec3, size: glam::DVec3) {
            let top = base + glam::DVec3::Y * size.y;
            let radius = size.x.min(size.z) / 2.0;
            *self = Self { $base: base.to_array(), $top: top.to_array(), radius };
        }

        $crate::shape::axial::by_axis!($base, $top);
    };
    ($base:ident, $top:ident) => {
        fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
            vec![&mut self.$base, &mut self.$top]
        }

        /// Changes nothing. Returns `true` if the axis is vertical, where the rotation has no
        /// effect; `false` otherwise, because the keys cannot express it.
        fn rotate_y(&mut self, _: f64) -> bool {
            self.$base[0] == self.$top[0] && self.$base[2] == self.$top[2]
        }

        fn texture_axes(&self) -> glam::DMat3 {
            $crate::shape::axial::axes_between(self.$base, self.$top)
        }
    };
}
pub(super) use by_axis;

/// Returns texture axes whose y axis points from `base` to `top`.
pub(super) fn axes_between(base: [f64; 3], top: [f64; 3]) -> DMat3 {
    let axis = DVec3::from_array(top) - DVec3::from_array(base);
    around_axis(unit(axis).unwrap_or(DVec3::Y))
}

/// Returns the errors of `checks`, of an axis without length, and of coordinates that are more than
/// 1e12 times the axis or one of `sizes`. `name` is the key of `top`.
pub(super) fn axis_faults(
    checks: Validator,
    [base, top]: [[f64; 3]; 2],
    name: &'static str,
    mut sizes: Vec<(&'static str, f64)>,
) -> Vec<ValidationError> {
    let no_axis = (base == top).then(|| {
        let found = format!("{name} is the same point as base");
        ValidationError::new(name, found, "a point away from base")
    });
    sizes.push((name, DVec3::from_array(base).distance(DVec3::from_array(top))));
    checks.and(no_axis).ratio(&sizes, &[base, top].concat()).errors()
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerkalo_kernel::primitive::ConicalFrustumForm;

    fn ends(form: &Form) -> (DVec3, DVec3, f64) {
        let Form::ConicalFrustum(ConicalFrustumForm { scene_from_unit: m, top_radius: top }) = form
        else {
            panic!("{form:?}")
        };
        (m.translation, m.translation + m.matrix3.z_axis, *top)
    }

    #[test]
    fn wider_end_becomes_canonical_base() {
        let (a, b) = ([0.0, 1.0, 0.0], [2.0, 1.0, -3.0]);
        let narrowing = frustum_between(a, b, 2.0, 0.5);
        assert_eq!(ends(&narrowing), (a.into(), b.into(), 0.25));
        let widening = frustum_between(a, b, 0.5, 2.0);
        assert_eq!(ends(&widening), (b.into(), a.into(), 0.25));
        let (low, high) = narrowing.bounds().unwrap();
        let (low2, high2) = frustum_between(b, a, 0.5, 2.0).bounds().unwrap();
        assert!((low - low2).length() < 1e-15 && (high - high2).length() < 1e-15);
    }

    #[test]
    fn canonical_frustum_may_widen() {
        let map = DAffine3::from_translation(DVec3::X);
        for s in [0.0, 0.3, 1.0, 4.0] {
            let form = Form::conical_frustum(map, s);
            let (low, high) = form.bounds().unwrap();
            let r = s.max(1.0);
            assert!((low - DVec3::new(1.0 - r, -r, 0.0)).length() < 1e-15, "{s}: {low}");
            assert!((high - DVec3::new(1.0 + r, r, 1.0)).length() < 1e-15, "{s}: {high}");
            // The rim at z = 1 has radius `s`. If `s` is greater than 1, this is the wider end, and
            // therefore the base (z = 0) of the canonical form.
            let Form::ConicalFrustum(ConicalFrustumForm { scene_from_unit: m, top_radius: top }) =
                form
            else {
                panic!("{form:?}")
            };
            let at_one = if s > 1.0 { DVec3::X } else { DVec3::new(top, 0.0, 1.0) };
            let rim = m.transform_point3(at_one);
            assert!((rim - DVec3::new(1.0 + s, 0.0, 1.0)).length() < 1e-15, "{s}: {rim}");
        }
    }
}
