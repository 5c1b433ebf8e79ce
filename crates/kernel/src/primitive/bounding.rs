//! Bounding volumes, which exclude primitives that rays cannot hit. They are computed in double
//! precision, with a margin for rays in single precision.

use crate::primitive::canonical::{Bounds, HalfSpace};
use crate::primitive::form::Form;
use glam::{DVec2, DVec3};

/// Upper bound of the displacement of a ray by rounding to single precision, as a fraction of the
/// largest coordinate. The true displacement is a few times 2^-24.
pub const F32_RAY_ERROR: f64 = 1e-5;

/// Sphere that contains a form, a light, or the start points of camera rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingSphere {
    /// Centre.
    pub center: DVec3,
    /// Radius; infinite for geometry without finite bounds.
    pub radius: f64,
}

/// Target of shadow rays.
#[derive(Clone, Copy, Debug)]
pub enum LightTarget {
    /// Sphere around a light, or around several, at a finite distance.
    Ball(BoundingSphere),
    /// Unit vector towards a distant light.
    Direction(DVec3),
}

impl LightTarget {
    /// Returns the target for a light without a size.
    pub fn point(center: DVec3) -> Self {
        Self::Ball(BoundingSphere { center, radius: 0.0 })
    }
}

/// All rays from one point (the apex) through a convex quadrilateral, and from all points of a lens
/// around the apex.
///
/// A ray from the apex has the direction d, with a component of 1 along `forward`. The ray from the
/// lens point apex + o with the direction d - o / f meets it at the depth f. At the depth z their
/// distance is |o (1 - z / f)|, which is largest at one end of an interval of depths.
#[derive(Clone, Copy, Debug)]
pub struct Frustum {
    /// Centre of the lens.
    pub apex: DVec3,
    /// Unit vector perpendicular to the lens.
    pub forward: DVec3,
    /// Vectors from the apex to the corners, with a component of 1 along `forward`.
    pub corners: [DVec3; 4],
    /// Radius of the lens; 0 if all rays start at the apex.
    pub lens_radius: f64,
    /// Depth f, greater than 0, at which rays through all points of the lens meet.
    pub focus: f64,
}

impl Frustum {
    /// Returns the largest distance, at depths from `near` to `far`, between a ray from the apex
    /// and a ray from the lens that meets it at the depth `focus`.
    fn blur(&self, near: f64, far: f64) -> f64 {
        if self.lens_radius == 0.0 {
            return 0.0;
        }
        let at = |depth: f64| (1.0 - depth / self.focus).abs();
        self.lens_radius * at(near.max(0.0)).max(at(far.max(0.0))) * (1.0 + F32_RAY_ERROR)
    }

    /// Returns `ball`, enlarged by the displacement of rays that lens and rounding errors cause.
    fn blurred(&self, ball: &BoundingSphere) -> BoundingSphere {
        let depth = (ball.center - self.apex).dot(self.forward);
        let radius = grown(ball).radius;
        let blur = self.blur(depth - radius, depth + radius);
        BoundingSphere { radius: ball.radius + blur + F32_RAY_ERROR * self.lens_radius, ..*ball }
    }

    /// Returns `true` if a ray of the frustum may hit `ball`. The test uses the cone around the
    /// frustum. A cone wider than a half-space is not convex; the planes through the apex and two
    /// neighbouring corners replace it.
    fn meets(&self, ball: &BoundingSphere) -> bool {
        let ball = &self.blurred(ball);
        let Self { apex, forward, corners, .. } = self;
        let axis = corners.iter().sum::<DVec3>().normalize();
        let cos = corners.iter().map(|c| c.normalize().dot(axis)).fold(1.0, f64::min);
        let to = ball.center - *apex;
        let reach = grown(ball).radius + ray_error(*apex);
        if cos > 0.0 {
            let (along, across) = along_and_across(to, axis);
            let sin = (1.0 - cos * cos).sqrt();
            return along >= -reach && across * cos - along * sin <= reach;
        }
        let is_outside = |i: usize| {
            let normal = corners[i].cross(corners[(i + 1) % 4]);
            let inward = normal * normal.dot(axis).signum();
            inward.dot(to) < -reach * normal.length()
        };
        to.dot(*forward) >= -reach && !(0..4).any(is_outside)
    }
}

/// Bounding volume of the canonical form of one object.
#[derive(Clone, Copy, Debug)]
pub struct BoundingVolume {
    /// Sphere that contains the object.
    pub ball: BoundingSphere,
    /// Plane that contains flat geometry.
    plane: Option<HalfSpace>,
    /// Largest distance between the end of a shadow ray and the position of its light.
    slack: f64,
}

impl BoundingSphere {
    /// Returns the sphere through the corners of a box; `None` stands for an infinite box.
    pub fn around_box(bounds: Option<Bounds>) -> Self {
        let Some((low, high)) = bounds else {
            return Self { center: DVec3::ZERO, radius: f64::INFINITY };
        };
        Self { center: 0.5 * (low + high), radius: 0.5 * low.distance(high) }
    }

    /// Returns a sphere around the mean of `points` that contains them.
    pub fn around(points: &[DVec3]) -> Self {
        let center = points.iter().sum::<DVec3>() / points.len() as f64;
        let radius = points.iter().map(|p| p.distance(center)).fold(0.0, f64::max);
        Self { center, radius }
    }

    /// Returns `true` if the spheres may overlap, with a margin for the rounding errors of rays
    /// that start in `other`.
    pub fn overlaps(&self, other: &Self) -> bool {
        let errors = ray_error(self.center) + ray_error(other.center);
        self.center.distance(other.center)
            <= self.radius + errors + other.radius * (1.0 + F32_RAY_ERROR)
    }
}

fn ray_error(point: DVec3) -> f64 {
    F32_RAY_ERROR * point.abs().max_element()
}

impl BoundingVolume {
    /// Creates the bounding volume of `form`.
    pub fn new(form: &Form) -> Self {
        Self { ball: form.bounding_sphere(), plane: form.plane(), slack: 0.0 }
    }

    /// Returns `true` if the object is flat. A ray that leaves a flat object cannot hit it again.
    pub fn is_flat(&self) -> bool {
        self.plane.is_some()
    }

    /// Returns a sphere that contains the part of the object that rays of `frustum` can hit; `None`
    /// if they cannot hit the object.
    pub fn clip_to(&self, frustum: &Frustum) -> Option<BoundingSphere> {
        let Frustum { apex, forward, corners, .. } = frustum;
        let ball = self.ball;
        if ball.radius.is_finite() && !frustum.meets(&ball) {
            return None;
        }
        let lens_error = F32_RAY_ERROR * frustum.lens_radius;
        let room = ray_error(*apex) + lens_error + ray_error(ball.center);
        // Depths along `forward` between which the object lies.
        let middle = (ball.center - *apex).dot(*forward);
        let (mut near, mut far) = (middle - ball.radius - room, middle + ball.radius + room);
        if let Some(HalfSpace { normal, offset }) = self.plane {
            // A ray from the apex with the direction c meets the plane at the depth `height` /
            // (`toward` . c). The divisor, called the slope, is linear in c. If the rays through
            // all corners meet the plane in front of the apex, the extreme depths are therefore at
            // corners. `slack` and `slope_error` allow for rounding errors and for the tilt of the
            // lens towards the plane.
            let tilt = frustum.lens_radius * normal.reject_from_normalized(*forward).length();
            let height = offset - normal.dot(*apex);
            let (height, toward) = (height.abs(), normal * height.signum());
            let slack = self.ray_error(*apex) + lens_error + tilt;
            let slope_error = (tilt + lens_error) / frustum.focus;
            let slopes = corners.map(|c| (toward.dot(c), F32_RAY_ERROR * c.length() + slope_error));
            if height <= slack {
                // The apex may be on either side of the plane.
            } else if slopes.iter().all(|(slope, ray_error)| slope > ray_error) {
                let nearest =
                    slopes.map(|(slope, ray_error)| (height - slack) / (slope + ray_error));
                let farthest =
                    slopes.map(|(slope, ray_error)| (height + slack) / (slope - ray_error));
                near = near.max(nearest.into_iter().fold(f64::INFINITY, f64::min));
                far = far.min(farthest.into_iter().fold(0.0, f64::max));
            } else if slopes.iter().all(|(slope, ray_error)| *slope < -ray_error) {
                return None;
            }
        }
        if !far.is_finite() {
            return Some(ball);
        }
        let near = near.max(0.0);
        let far = far.max(near);
        let ends: [DVec3; 8] =
            std::array::from_fn(|i| *apex + corners[i % 4] * if i < 4 { near } else { far });
        let part = BoundingSphere::around(&ends);
        let blur = frustum.blur(near, far);
        let part = BoundingSphere { radius: part.radius + room + blur, ..part };
        Some(if part.radius < ball.radius { part } else { ball })
    }

    /// Returns the bounding volume enlarged by `by`, for shadow rays that end within this distance
    /// of their lights.
    pub fn grown(self, by: f64) -> Self {
        let ball = BoundingSphere { radius: self.ball.radius + by, ..self.ball };
        Self { ball, slack: self.slack + by, ..self }
    }

    /// Returns the error of the height of `point` above the plane of this flat object. A ray from
    /// or to a point within this height may hit the object.
    fn ray_error(&self, point: DVec3) -> f64 {
        let BoundingSphere { center, radius } = self.ball;
        let reach = if radius.is_finite() { center.abs().max_element() + radius } else { 0.0 };
        let offset = self.plane.map_or(0.0, |plane| plane.offset.abs());
        self.slack + ray_error(point) + F32_RAY_ERROR * reach.max(offset)
    }

    /// Returns `true` if the object is flat, and a light and all points of the sphere `lit` are on
    /// the same side of the object's plane. `above` returns the height of the light above the
    /// plane, and the error of this height.
    fn is_beside(&self, lit: &BoundingSphere, above: impl Fn(HalfSpace) -> (f64, f64)) -> bool {
        let Some(plane) = self.plane else { return false };
        let height = plane.height(lit.center);
        let (beyond, unsure) = above(plane);
        let sure = height.abs() > lit.radius + self.ray_error(lit.center) && beyond.abs() > unsure;
        let radius = lit.radius + ray_error(lit.center) + F32_RAY_ERROR * lit.radius;
        sure && height.abs() > radius && height * beyond > 0.0
    }

    /// Returns `true` if the object may be between some point of the sphere `lit` and some point of
    /// `light`.
    pub fn may_occlude(&self, lit: &BoundingSphere, light: &LightTarget) -> bool {
        let above = |plane: HalfSpace| match light {
            LightTarget::Ball(light) => {
                (plane.height(light.center), light.radius + self.ray_error(light.center))
            }
            LightTarget::Direction(direction) => (plane.normal.dot(*direction), F32_RAY_ERROR),
        };
        if self.is_beside(lit, above) {
            return false;
        }
        if !lit.radius.is_finite() || !self.ball.radius.is_finite() {
            return true;
        }
        match light {
            LightTarget::Ball(light) => {
                let distance = distance_to_hull(self.ball.center, &grown(light), &grown(lit));
                distance <= grown(&self.ball).radius
            }
            LightTarget::Direction(direction) => {
                let (along, across) = along_and_across(self.ball.center - lit.center, *direction);
                let radius = grown(lit).radius + self.ball.radius;
                let both = radius * (1.0 + F32_RAY_ERROR) + ray_error(self.ball.center);
                across <= both && along >= -both
            }
        }
    }
}

/// Returns `ball` enlarged by the rounding errors of rays from or to it.
fn grown(ball: &BoundingSphere) -> BoundingSphere {
    let radius = ball.radius * (1.0 + F32_RAY_ERROR) + ray_error(ball.center);
    BoundingSphere { radius, ..*ball }
}

/// Returns the distance between `point` and the convex hull of the spheres `a` and `b`, the union
/// of all spheres interpolated between them; negative inside.
fn distance_to_hull(point: DVec3, a: &BoundingSphere, b: &BoundingSphere) -> f64 {
    let axis = b.center - a.center;
    let length = axis.length().max(f64::MIN_POSITIVE);
    let direction = axis / length;
    let (along, across) = along_and_across(point - a.center, direction);
    // Distance between the point and the interpolated ball with the centre at `x` on the axis, a
    // convex function. It is least where the sine of the angle between the line from the centre to
    // the point and the perpendicular to the axis is `slope`.
    let slope = (b.radius - a.radius) / length;
    let distance = |x: f64| DVec2::new(across, along - x).length() - (a.radius + slope * x);
    let ends = distance(0.0).min(distance(length));
    if slope.abs() >= 1.0 {
        // One ball contains the other.
        return ends;
    }
    let nearest = along + across * slope / (1.0 - slope * slope).sqrt();
    distance(nearest.clamp(0.0, length)).min(ends)
}

/// Returns the signed length of the part of `v` along the unit vector `axis`, and the length of the
/// part perpendicular to it.
fn along_and_across(v: DVec3, axis: DVec3) -> (f64, f64) {
    let along = v.dot(axis);
    (along, (v - axis * along).length())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitive::{ParallelogramForm, PlaneForm, SphereForm};

    fn ball(center: [f64; 3], radius: f64) -> Form {
        Form::Sphere(SphereForm { center: center.into(), radius })
    }

    /// Returns a square of side 2 with the centre `center` and the normal +y.
    fn tile(center: [f64; 3]) -> Form {
        let corner = DVec3::from(center) - DVec3::new(1.0, 0.0, 1.0);
        Form::Parallelogram(ParallelogramForm { corner, u: DVec3::Z * 2.0, v: DVec3::X * 2.0 })
    }

    /// Returns a frustum from (0, 0, 5) along -z that extends 0.1 to each side at unit distance.
    fn frustum() -> Frustum {
        let corners = [(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)];
        Frustum {
            apex: DVec3::Z * 5.0,
            forward: DVec3::NEG_Z,
            corners: corners.map(|(x, y)| DVec3::new(x, y, -1.0)),
            lens_radius: 0.0,
            focus: 1.0,
        }
    }

    #[test]
    fn frustum_meets_what_is_in_front_of_it() {
        let part = |form: &Form| BoundingVolume::new(form).clip_to(&frustum());
        assert!(part(&ball([0.0, 0.0, 0.0], 1.0)).is_some());
        assert!(part(&ball([1.4, 0.0, 0.0], 1.0)).is_some());
        assert!(part(&ball([2.0, 0.0, 0.0], 1.0)).is_none());
        assert!(part(&ball([0.0, 0.0, 7.0], 1.0)).is_none());
        let wall = Form::Plane(PlaneForm { normal: DVec3::Z, offset: 0.0 });
        let seen = part(&wall).unwrap();
        // The visible part is a square with half-sides of 0.5.
        assert!(seen.center.length() < 1e-3 && (seen.radius - 0.5f64.sqrt()).abs() < 1e-3);
        assert!(part(&Form::Plane(PlaneForm { normal: DVec3::Z, offset: 6.0 })).is_none());
        // A plane that reaches the horizon: its visible part is infinite.
        let floor = part(&Form::Plane(PlaneForm { normal: DVec3::Y, offset: -0.1 })).unwrap();
        assert!(floor.radius.is_infinite());
    }

    /// Checks the distance between a point and the convex hull of two balls: no interpolated ball
    /// may be nearer to the point. The centre and the radius of an interpolated ball are between
    /// those of the two balls.
    #[test]
    fn hull_of_two_balls_holds_every_segment_between_them() {
        let mut random = 7u64;
        let mut unit = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (random >> 40) as f64 / 8_388_608.0 - 1.0
        };
        let mut apart = 0;
        for _ in 0..2000 {
            let mut ball = |size: f64| BoundingSphere {
                center: DVec3::new(unit(), unit(), unit()) * 3.0,
                radius: size * (1.0 + unit()),
            };
            let (a, b, occluder) = (ball(1.0), ball(0.5), ball(0.3));
            let distance = distance_to_hull(occluder.center, &a, &b);
            for step in 0..=64 {
                let s = f64::from(step) / 64.0;
                let center = a.center.lerp(b.center, s);
                let radius = a.radius + s * (b.radius - a.radius);
                let to_ball = center.distance(occluder.center) - radius;
                assert!(distance <= to_ball + 1e-12, "{a:?} {b:?} {occluder:?} {s}");
            }
            let bound = BoundingVolume::new(&ball_form(&occluder));
            apart += u32::from(!bound.may_occlude(&b, &LightTarget::Ball(a)));
        }
        assert!((500..1900).contains(&apart), "{apart}");
    }

    fn ball_form(ball: &BoundingSphere) -> Form {
        Form::Sphere(SphereForm { center: ball.center, radius: ball.radius })
    }

    #[test]
    fn only_what_is_between_shades() {
        let lit = BoundingSphere { center: DVec3::ZERO, radius: 0.5 };
        let lamp = LightTarget::point(DVec3::Y * 4.0);
        let sun = LightTarget::Direction(DVec3::Y);
        for (form, by_lamp, by_sun) in [
            (ball([0.0, 2.0, 0.0], 0.1), true, true),
            (ball([0.4, 2.0, 0.0], 0.1), false, true),
            (ball([0.3, 2.0, 0.0], 0.1), true, true),
            (ball([0.0, 5.0, 0.0], 0.5), false, true),
            (ball([0.0, -2.0, 0.0], 1.0), false, false),
            (tile([0.0, 1.0, 0.0]), true, true),
            (tile([0.0, -0.6, 0.0]), false, false),
            (tile([0.0, -0.4, 0.0]), true, true),
            (tile([0.0, 6.0, 0.0]), false, true),
        ] {
            let bound = BoundingVolume::new(&form);
            assert_eq!(bound.may_occlude(&lit, &lamp), by_lamp, "lamp {form:?}");
            assert_eq!(bound.may_occlude(&lit, &sun), by_sun, "sun {form:?}");
        }
    }

    /// Checks that a frustum of 175 degrees intersects every ball that one of its rays hits. One
    /// corner of the frustum is more than 90 degrees from the mean direction of its corners.
    #[test]
    fn wide_frustum_meets_balls_that_its_rays_hit() {
        let apex = DVec3::new(1.0, -2.0, 5.0);
        let edge = 87.5f64.to_radians().tan();
        let ends =
            [(-edge, edge), (0.6 * edge, edge), (0.6 * edge, -0.6 * edge), (-edge, -0.6 * edge)];
        let corners = ends.map(|(x, y)| DVec3::new(x, y, -1.0));
        let frustum =
            Frustum { apex, forward: DVec3::NEG_Z, corners, lens_radius: 0.0, focus: 1.0 };
        let meets = |center: DVec3, radius: f64| {
            BoundingVolume::new(&Form::Sphere(SphereForm { center, radius }))
                .clip_to(&frustum)
                .is_some()
        };
        let (mut outside, mut inside) = (0, 0);
        for i in 0..=40 {
            for j in 0..=40 {
                // Point of the picture plane, in the quadrilateral of the frustum or around it.
                let [x, y] = [i, j].map(|k| edge * (f64::from(k) / 16.0 - 1.25));
                let seen = x > -edge && x < 0.6 * edge && y > -0.6 * edge && y < edge;
                for distance in [0.01, 1.0, 300.0] {
                    let direction = DVec3::new(x, y, -1.0).normalize();
                    let met = meets(apex + direction * distance, 1e-4 * distance);
                    assert!(met || !seen, "{direction} at {distance}");
                    inside += u32::from(met && seen);
                    outside += u32::from(!met && !seen);
                }
            }
        }
        assert!(inside > 1000 && outside > 1000, "{inside} {outside}");
        assert!(!meets(apex + DVec3::Z, 0.5) && meets(apex + DVec3::Z, 2.0));
    }

    /// Checks that a frustum never excludes a plane through its apex. The height of the plane above
    /// the apex is lost in rounding, so that rays may hit either side.
    #[test]
    fn plane_through_apex_is_not_excluded() {
        for offset in [5.0 - 1e-7, 5.0, 5.0 + 1e-7] {
            let plane = BoundingVolume::new(&Form::Plane(PlaneForm { normal: DVec3::Z, offset }));
            assert!(plane.clip_to(&frustum()).is_some(), "{offset}");
        }
    }

    /// Checks the bounding ball of the part of a surface in a frustum: all points of the surface
    /// inside the frustum must also be inside the ball.
    #[test]
    fn clipped_ball_holds_all_visible_points() {
        let mut random = 1u64;
        let mut unit = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (random >> 40) as f64 / 16_777_216.0
        };
        let slanted =
            Form::Plane(PlaneForm { normal: DVec3::new(0.3, 0.4, 0.5).normalize(), offset: 0.2 });
        let part = BoundingVolume::new(&slanted).clip_to(&frustum()).unwrap();
        let Form::Plane(PlaneForm { normal, offset }) = slanted else { unreachable!() };
        for _ in 0..1000 {
            let toward = DVec3::new(0.2 * unit() - 0.1, 0.2 * unit() - 0.1, -1.0);
            let t = (offset - normal.dot(frustum().apex)) / normal.dot(toward);
            let hit = BoundingSphere { center: frustum().apex + toward * t, radius: 0.0 };
            assert!(t > 0.0 && part.overlaps(&hit));
        }
    }
}
