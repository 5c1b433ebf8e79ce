//! Spaces in which primitives have their canonical shape, such as that of the unit sphere. Rays are
//! transformed into these spaces.

use crate::bvh::Ray;
use crate::lanes::{Float, SimdFloat, Vec3};
use glam::{DMat3, DVec3};

/// Map from the scene to the space of a canonical shape.
#[derive(Clone, Copy)]
pub struct UnitSpace<S> {
    /// Origin of the space, in the scene.
    pub center: [S; 3],
    /// Rows of the linear map from the scene to the space.
    rows: [[S; 3]; 3],
}

/// Line of a ray in the space of a canonical shape. A position on the line is a signed distance
/// from `point`, so that a distant origin of the ray costs no precision.
#[derive(Clone, Copy)]
pub struct UnitLine<L> {
    /// Point of the line closest to the origin of the space.
    pub point: Vec3<L>,
    /// Unit direction.
    pub direction: Vec3<L>,
    /// Position of the ray's origin.
    pub start: L,
    /// Length in the scene of a step of length 1 on the line.
    pub scale: L,
}

/// Returns the rows of a matrix, rounded to the precision `S`.
pub fn rounded_rows<S: Float>(m: DMat3) -> [[S; 3]; 3] {
    m.transpose().to_cols_array_2d().map(|row| row.map(S::from_f64))
}

/// Returns the product of the matrix with the rows `m` and the vector `v`.
#[inline(always)]
pub fn times<L: SimdFloat>(m: &[[L::Scalar; 3]; 3], v: Vec3<L>) -> Vec3<L> {
    Vec3::new(Vec3::splat(m[0]).dot(v), Vec3::splat(m[1]).dot(v), Vec3::splat(m[2]).dot(v))
}

impl<S: Float> UnitSpace<S> {
    /// Creates the space with the origin `center` from the linear map to the scene.
    pub fn new(center: DVec3, scene_from_unit: DMat3) -> Self {
        let rows = rounded_rows(scene_from_unit.inverse());
        Self { center: center.to_array().map(S::from_f64), rows }
    }

    /// Transforms a point of the scene.
    #[inline(always)]
    pub fn point<L: SimdFloat<Scalar = S>>(&self, p: Vec3<L>) -> Vec3<L> {
        times(&self.rows, p - Vec3::splat(self.center))
    }

    /// Transforms the normal `n` to the scene. The result is not normalised.
    #[inline(always)]
    pub fn scene_normal<L: SimdFloat<Scalar = S>>(&self, n: Vec3<L>) -> Vec3<L> {
        let [x, y, z] = self.rows.map(Vec3::splat);
        x * n.x + y * n.y + z * n.z
    }

    /// Transforms rays. The directions of the result are not of unit length.
    #[inline(always)]
    pub fn ray<L: SimdFloat<Scalar = S>>(&self, ray: &Ray<L>) -> Ray<L> {
        Ray { origin: self.point(ray.origin), direction: times(&self.rows, ray.direction) }
    }

    /// Transforms the lines of rays.
    #[inline(always)]
    pub fn line<L: SimdFloat<Scalar = S>>(&self, ray: &Ray<L>) -> UnitLine<L> {
        let Ray { origin: f, direction: d } = self.ray(ray);
        let scale = L::one() / d.length_squared().sqrt();
        let direction = d * scale;
        // The second step removes the rounding error of the first step along the direction.
        let back = -f.dot(direction);
        let near = direction.mul_add(back, f);
        let again = -near.dot(direction);
        let point = direction.mul_add(again, near);
        UnitLine { point, direction, start: -(back + again), scale }
    }
}
