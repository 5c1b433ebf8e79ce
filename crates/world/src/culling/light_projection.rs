//! Projections from a light to the cells of its light buffer: cube map, perspective or
//! orthographic.

use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Float, Mask, SimdFloat, Vec3};
use zerkalo_kernel::primitive::{BoundingSphere, LightTarget};

/// Largest magnitude of the coordinates of spheres in a perspective projection, on the plane at
/// unit distance from the light. If a coordinate is larger, the light has a cube map.
const MAX_TANGENT: f64 = 3.0;

/// Projection of points, as seen from a light, onto one or more faces with coordinates from 0 to 1.
pub(crate) enum LightProjection<S> {
    /// Cube map, for a point light that has primitives on several sides.
    CubeMap,
    /// Perspective projection for a point light that has all primitives on one side, or
    /// orthographic projection for a directional light. The third axis points away from the light.
    /// `low` and `scale` map coordinates on the face to 0..=1.
    Planar { is_perspective: bool, axes: [[S; 3]; 3], low: [S; 2], scale: [S; 2] },
}

impl<S: Float> LightProjection<S> {
    pub fn faces(&self) -> usize {
        if matches!(self, Self::CubeMap) { 6 } else { 1 }
    }

    /// Returns the index of the cell onto which each ray's origin is projected, and the depth of
    /// the origin (see the field `near` of the light buffer's entries). Origins outside the
    /// projection get an arbitrary cell. `limit` is the distance between origin and light. `side`
    /// is the number of cells along a side of a face.
    #[inline(always)]
    pub fn lookup<L: SimdFloat<Scalar = S>>(&self, ray: &Ray<L>, limit: L, side: usize) -> (L, L) {
        let side = L::from_f64(side as f64);
        // Adding this number to a smaller one and subtracting it again rounds the smaller one to an
        // integer, because the sum has no fraction bits. The smaller number must be below 2^22 in
        // single precision, 2^51 in double precision.
        let rounder = L::from_f64(1.5 / L::EPSILON);
        let half = L::from_f64(0.5);
        let cell_index = |x: L| {
            let x = x.mul_add(side, -half).max(L::zero()).min(side - L::one());
            (x + rounder) - rounder
        };
        let d = -ray.direction;
        match self {
            Self::CubeMap => {
                let size = Vec3::new(d.x.abs(), d.y.abs(), d.z.abs());
                let x = size.x.ge(size.y) & size.x.ge(size.z);
                let y = size.y.ge(size.z).and_not(x);
                let pick = |of_x, of_y, of_z| L::select(x, of_x, L::select(y, of_y, of_z));
                let major = pick(d.x, d.y, d.z);
                let scale = half / major.abs();
                let (u, v) = (pick(d.y, d.z, d.x), pick(d.z, d.x, d.y));
                let face = pick(L::zero(), L::from_f64(2.0), L::from_f64(4.0))
                    + L::one().masked(major.lt(L::zero()));
                let (u, v) =
                    (cell_index(u.mul_add(scale, half)), cell_index(v.mul_add(scale, half)));
                (face.mul_add(side, v).mul_add(side, u), limit)
            }
            Self::Planar { is_perspective, axes, low, scale } => {
                let projected = if *is_perspective { d } else { ray.origin };
                let [a, b, c] = axes.map(|axis| projected.dot(Vec3::splat(axis)));
                let (inverse, depth) =
                    if *is_perspective { (L::one() / c, limit) } else { (L::one(), c) };
                let along = |x: L, i: usize| {
                    cell_index(x.mul_add(inverse, -L::splat(low[i])) * L::splat(scale[i]))
                };
                (along(b, 1).mul_add(side, along(a, 0)), depth)
            }
        }
    }
}

/// Bounding rectangle of a projected sphere on a face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FaceRect {
    face: usize,
    low: DVec2,
    high: DVec2,
}

impl FaceRect {
    /// Returns the indices of the cells that the rectangle overlaps, on faces of `side` x `side`
    /// cells.
    pub fn cells(&self, side: usize) -> impl Iterator<Item = usize> + use<> {
        // The conversion to an integer saturates, so negative coordinates become cell 0.
        let cell = |x: f64| ((x * side as f64) as usize).min(side - 1);
        let span = |low: f64, high: f64| -> Range<usize> { cell(low)..cell(high) + 1 };
        let (columns, rows) = (span(self.low.x, self.high.x), span(self.low.y, self.high.y));
        let first = self.face * side * side;
        rows.flat_map(move |row| columns.clone().map(move |column| first + row * side + column))
    }
}

/// Projection from a light, and the rectangles of each sphere.
type Projected<S> = (LightProjection<S>, Vec<Vec<FaceRect>>);

/// Projection from a light, and the bounding rectangles of all projected spheres.
pub(crate) struct ProjectedBounds<S> {
    pub projection: LightProjection<S>,
    /// Rectangles of each sphere, one for each face that it overlaps.
    pub rects: Vec<Vec<FaceRect>>,
    /// Recommended number of cells along a side of a face.
    pub side: usize,
}

impl<S: Float> ProjectedBounds<S> {
    /// Chooses a projection for a light and projects the spheres `balls`. For a point light, their
    /// positions are relative to the light.
    pub fn new(target: &LightTarget, balls: &[BoundingSphere]) -> Self {
        let (projection, rects) = match target {
            LightTarget::Direction(direction) => orthographic(*direction, balls),
            LightTarget::Ball(_) => perspective(balls).unwrap_or_else(|| cube_map(balls)),
        };
        let finest = if matches!(projection, LightProjection::CubeMap) { 2.0 } else { 4.0 };
        let side = (finest * (balls.len() as f64).sqrt()).clamp(8.0, 128.0) as usize;
        Self { projection, rects, side }
    }
}

/// Returns the smallest and the largest quotient x / z over the points of a sphere that have z > 0.
/// The parameters `x` and `z` are the coordinates of the sphere's centre. Returns `None` if no
/// point of the sphere has z > 0.
fn tangent_range(x: f64, z: f64, radius: f64) -> Option<(f64, f64)> {
    let distance = x.hypot(z);
    if distance <= radius {
        return Some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let (middle, spread) = (x.atan2(z), (radius / distance).asin());
    let (low, high) = (middle - spread, middle + spread);
    let slope = |angle: f64| {
        if angle.abs() < FRAC_PI_2 { angle.tan() } else { f64::INFINITY.copysign(angle) }
    };
    (low < FRAC_PI_2 && high > -FRAC_PI_2).then(|| (slope(low), slope(high)))
}

/// Projects spheres to the faces of a cube map.
fn cube_map<S: Float>(balls: &[BoundingSphere]) -> Projected<S> {
    let rect_on = |ball: &BoundingSphere, face: usize| {
        let axis = |i: usize| ball.center[(face / 2 + i) % 3];
        let z = if face.is_multiple_of(2) { axis(0) } else { -axis(0) };
        let (x, y) =
            (tangent_range(axis(1), z, ball.radius)?, tangent_range(axis(2), z, ball.radius)?);
        let (low, high) = (DVec2::new(x.0, y.0), DVec2::new(x.1, y.1));
        let half = |v: DVec2| 0.5 * v.clamp(DVec2::NEG_ONE, DVec2::ONE) + 0.5;
        let is_seen = low.max_element() <= 1.0 && high.min_element() >= -1.0;
        is_seen.then(|| FaceRect { face, low: half(low), high: half(high) })
    };
    let rects = |ball: &BoundingSphere| (0..6).filter_map(|face| rect_on(ball, face)).collect();
    (LightProjection::CubeMap, balls.iter().map(rects).collect())
}

/// Projects spheres by a perspective projection. Returns `None` if they are not on one side of the
/// light, or if a coordinate would exceed [`MAX_TANGENT`].
fn perspective<S: Float>(balls: &[BoundingSphere]) -> Option<Projected<S>> {
    let forward = balls.iter().map(|b| b.center).sum::<DVec3>().try_normalize()?;
    let (right, up) = forward.any_orthonormal_pair();
    let axes = [right, up, forward];
    let tangents = |ball: &BoundingSphere| {
        let [x, y, z] = axes.map(|axis| ball.center.dot(axis));
        let (x, y) = (tangent_range(x, z, ball.radius)?, tangent_range(y, z, ball.radius)?);
        let corners = (DVec2::new(x.0, y.0), DVec2::new(x.1, y.1));
        let max_tangent = corners.0.abs().max(corners.1.abs()).max_element();
        (z > ball.radius && max_tangent <= MAX_TANGENT).then_some(corners)
    };
    let corners: Vec<_> = balls.iter().map(tangents).collect::<Option<_>>()?;
    Some(planar(true, axes, &corners))
}

/// Projects spheres along `direction`, which points to the light.
fn orthographic<S: Float>(direction: DVec3, balls: &[BoundingSphere]) -> Projected<S> {
    let (right, up) = direction.any_orthonormal_pair();
    let square = |ball: &BoundingSphere| {
        let center = DVec2::new(ball.center.dot(right), ball.center.dot(up));
        (center - ball.radius, center + ball.radius)
    };
    let corners: Vec<_> = balls.iter().map(square).collect();
    planar(false, [right, up, -direction], &corners)
}

/// Returns the projection that maps the common bounding box of rectangles to the unit square, and
/// the mapped rectangles. Each rectangle is given by its lowest and highest corner.
fn planar<S: Float>(
    is_perspective: bool,
    axes: [DVec3; 3],
    corners: &[(DVec2, DVec2)],
) -> Projected<S> {
    let low = corners.iter().map(|s| s.0).fold(DVec2::INFINITY, DVec2::min);
    let high = corners.iter().map(|s| s.1).fold(DVec2::NEG_INFINITY, DVec2::max);
    let scale = (high - low).recip();
    let mapped = |v: DVec2| (v - low) * scale;
    let rect = |s: &(DVec2, DVec2)| vec![FaceRect { face: 0, low: mapped(s.0), high: mapped(s.1) }];
    let [low, scale] = [low, scale].map(|v| v.to_array().map(S::from_f64));
    let axes = axes.map(|axis| axis.to_array().map(S::from_f64));
    let projection = LightProjection::Planar { is_perspective, axes, low, scale };
    (projection, corners.iter().map(rect).collect())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use zerkalo_kernel::lanes::{Double, Single};

    pub struct Random(pub u64);

    impl Random {
        pub fn unit(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (self.0 >> 40) as f64 / 16_777_216.0
        }

        pub fn point(&mut self, half: f64) -> DVec3 {
            DVec3::from([0; 3].map(|_| half * (2.0 * self.unit() - 1.0)))
        }
    }

    /// Checks that the cell of a point of a ball is among the cells that the ball's bounding
    /// rectangle overlaps. The random points are below the surface of the ball, by the fraction
    /// `slack` of its radius, so that rounding does not matter.
    fn check_points_of_ball<L: SimdFloat>(slack: f64) {
        let mut random = Random(2);
        let side = 64;
        for round in 0..600 {
            let light_offset =
                [DVec3::ZERO, DVec3::new(30.0, -9.0, 4.0), DVec3::Y * 20.0][round % 3];
            let center = random.point(5.0) + light_offset;
            let ball = BoundingSphere { center, radius: 0.2 + 2.0 * random.unit() };
            // A second ball keeps the first from filling the whole projection.
            let balls =
                [ball, BoundingSphere { center: center + DVec3::new(0.5, 1.0, 0.7), radius: 0.1 }];
            let (projection, rects) = match round / 3 % 3 {
                0 => cube_map::<L::Scalar>(&balls),
                1 => match perspective(&balls) {
                    Some(perspective) => perspective,
                    None => continue,
                },
                _ => orthographic(random.point(1.0).normalize(), &balls),
            };
            let cells: Vec<usize> = rects[0].iter().flat_map(|rect| rect.cells(side)).collect();
            for _ in 0..100 {
                // Random directions, an axis and a diagonal.
                let normal =
                    [random.point(1.0), DVec3::X, DVec3::ONE, DVec3::NEG_Z][round % 4].normalize();
                let point = center + normal * ball.radius * (1.0 - slack);
                let origin = Vec3::of(point.to_array());
                let direction = Vec3::of((-point.normalize()).to_array());
                let (cell, _) = projection.lookup(&Ray { origin, direction }, L::one(), side);
                let cell = cell.lane(0).to_f64();
                assert!(cells.contains(&(cell as usize)), "{round}: {ball:?}, {point}: {cell}");
            }
        }
    }

    #[test]
    fn light_projection_maps_points_into_cells_of_their_ball() {
        check_points_of_ball::<Double>(1e-9);
        check_points_of_ball::<Single>(1e-4);
    }

    /// Checks that every direction gets a valid cell. A direction for which the projection divides
    /// by zero gets an arbitrary cell.
    #[test]
    fn light_projection_has_a_cell_for_every_direction() {
        let balls = [BoundingSphere { center: DVec3::NEG_Y * 5.0, radius: 1.0 }];
        let (perspective, _) = perspective::<f32>(&balls).expect("the ball is on one side");
        for projection in [cube_map(&balls).0, perspective, orthographic(DVec3::Y, &balls).0] {
            for direction in [[1.0, 0.0, 0.0], [0.0, 1.0, -0.0], [-0.0, 0.0, -1.0], [f64::NAN; 3]] {
                let ray =
                    Ray { origin: Vec3::of(direction), direction: Vec3::<Single>::of(direction) };
                let cell = projection.lookup(&ray, Single::one(), 8).0.as_array()[0];
                assert!(
                    cell >= 0.0 && cell < (projection.faces() * 64) as f32,
                    "{direction:?}: {cell}"
                );
            }
        }
    }
}
