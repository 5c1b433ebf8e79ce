//! Traits of primitives that are compiled for one SIMD type, and points on their surfaces.

use crate::bvh::{Hit, Ray};
use crate::lanes::{SimdFloat, Vec3};

/// Point on the surface of a primitive in each lane.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<L> {
    /// Hit point, projected onto the surface as exactly as the precision of the lanes allows.
    pub point: Vec3<L>,
    /// Unit geometric normal, out of a solid or on the front of a flat shape.
    pub normal: Vec3<L>,
    /// Largest magnitude of the coordinates from which `point` was computed. The rounding error of
    /// `point` is a few units in the last place of this value.
    pub max_coordinate: L,
}

/// Texture coordinates of a point. Their unit is one repetition of the image. The gradients are
/// with respect to the position in texture space.
#[derive(Clone, Copy, Debug)]
pub struct TexCoord<L> {
    /// Coordinate to the right in the image.
    pub u: L,
    /// Coordinate upwards in the image.
    pub v: L,
    /// Gradient of u.
    pub grad_u: Vec3<L>,
    /// Gradient of v.
    pub grad_v: Vec3<L>,
}

impl<L: SimdFloat> SurfacePoint<L> {
    /// Returns the distance from the surface at which secondary rays start: a few rounding errors
    /// of [`SurfacePoint::max_coordinate`].
    #[inline(always)]
    pub fn ray_offset(&self) -> L {
        self.max_coordinate.max(self.point.max_abs()) * L::from_f64(8.0 * L::EPSILON)
    }
}

/// Primitive compiled for the kernels of one SIMD type.
pub trait Primitive<L: SimdFloat> {
    /// Replaces `hit` in the lanes whose ray hits the primitive nearer than `hit`. `id` is the id
    /// of the primitive.
    fn closest(&self, id: u32, ray: &Ray<L>, hit: &mut Hit<L>);

    /// Returns the lanes whose ray hits the primitive at a distance between 0 and `limit`; `None`
    /// if there are none. Lanes outside `wanted` are undefined.
    fn occluded(&self, ray: &Ray<L>, limit: L, wanted: L::Mask) -> Option<L::Mask>;

    /// Projects `point` onto the surface; see [`surface`](crate::primitive::Aggregate::surface).
    fn surface(&self, triangle: L, point: Vec3<L>) -> SurfacePoint<L>;

    /// Returns the primitive's own texture coordinates at `point`; `None` without any.
    fn uv(&self, triangle: L, point: Vec3<L>) -> Option<TexCoord<L>>;
}

/// Primitive whose intersections are computed by a formula, without a search.
pub trait AnalyticPrimitive<L: SimdFloat> {
    /// Returns the smallest distance at which each ray hits the primitive, and the lanes that hit
    /// it; `None` if no lane hits. Only distances greater than 0 are hits.
    fn intersect(&self, ray: &Ray<L>) -> Option<(L, L::Mask)>;

    /// Returns the projection of `point` onto the surface, with the normal there. `point` is the
    /// computed hit point of a ray, with rounding errors.
    fn surface(&self, point: Vec3<L>) -> SurfacePoint<L>;

    /// Returns the texture coordinates of the primitive's own parametrisation; `None` without one.
    fn uv(&self, _point: Vec3<L>) -> Option<TexCoord<L>> {
        None
    }
}
