//! Shading normals, bent so that they face the viewer.

use crate::lanes::{SimdFloat, Vec3};

/// Cosine between a shading normal and the direction to the viewer below which the normal is bent
/// towards the viewer.
const LEAST_COSINE: f64 = 0.02;

/// Returns `shading` as a unit vector on the side of `normal`, bent towards the viewer if it does
/// not face the viewer. `normal` is the geometric normal on the viewer's side, and `direction` is
/// the direction of the rays. If the result is not finite or not on the side of `normal`, `normal`
/// replaces it.
#[inline(always)]
pub fn keep_visible<L: SimdFloat>(
    shading: Vec3<L>,
    normal: Vec3<L>,
    direction: Vec3<L>,
) -> Vec3<L> {
    let side = shading.dot(normal);
    let shading = Vec3::select(side.lt(L::zero()), -shading, shading);
    let short = (L::from_f64(LEAST_COSINE) + shading.dot(direction)).max(L::zero());
    let bent = direction.mul_add(-short, shading);
    let bent = bent * (L::one() / bent.length_squared().sqrt());
    let sound = bent.dot(normal).gt(L::zero());
    Vec3::select(sound, bent, normal)
}
