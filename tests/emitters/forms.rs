//! Closed forms of the irradiance by spheres, polygons and disks.

use crate::harness::*;

/// Returns the irradiance by a sphere of unit radiance on a surface at the origin with the given
/// normal. The surface is outside of the sphere.
///
/// Lagarde and de Rousiers 2014, *Moving Frostbite to Physically Based Rendering*, equations 25 and
/// 26. The second one holds where the horizon of the surface cuts the sphere.
pub fn sphere(center: DVec3, radius: f64, normal: DVec3) -> f64 {
    let distance = center.length();
    let cos = normal.dot(center) / distance;
    let sin2 = (radius / distance).powi(2);
    if cos * cos > sin2 * (1.0 - 1e-12) {
        return PI * sin2 * cos.max(0.0);
    }
    let sin = (1.0 - cos * cos).sqrt();
    let x = (1.0 / sin2 - 1.0).sqrt();
    let y = -x * cos / sin;
    let root = sin * (1.0 - y * y).max(0.0).sqrt();
    sin2 * (cos * y.acos() - x * root) + (root / x).atan()
}

/// Returns the irradiance by a polygon of unit radiance on a surface at the origin with the given
/// normal, by Lambert's formula for the part of the polygon above the horizon.
pub fn polygon(corners: &[DVec3], normal: DVec3) -> f64 {
    let above = clipped(corners, normal);
    let side = |i: usize| {
        let (a, b) = (above[i].normalize(), above[(i + 1) % above.len()].normalize());
        let cross = a.cross(b);
        let sin = cross.length();
        if sin > 0.0 { sin.atan2(a.dot(b)) * cross.dot(normal) / sin } else { 0.0 }
    };
    (0.5 * (0..above.len()).map(side).sum::<f64>()).abs()
}

/// Cuts a polygon by the plane through the origin with the normal `normal`. Returns the part on the
/// side to which `normal` points.
pub fn clipped(corners: &[DVec3], normal: DVec3) -> Vec<DVec3> {
    let mut out = Vec::new();
    for (i, a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        let (height_a, height_b) = (normal.dot(*a), normal.dot(b));
        if height_a >= 0.0 {
            out.push(*a);
        }
        if height_a * height_b < 0.0 {
            out.push(a.lerp(b, height_a / (height_a - height_b)));
        }
    }
    out
}

/// Returns the irradiance by a disk of unit radiance at a point of a parallel surface. The point is
/// at the distance `height` from the disk's plane and at the distance `aside` from the disk's axis.
///
/// Howell, Mengüç, Siegel, *Thermal Radiation Heat Transfer*, configuration B-15.
pub fn parallel_disk(radius: f64, height: f64, aside: f64) -> f64 {
    let (h, r) = (height * height, radius * radius);
    let sum = aside * aside + h + r;
    let root = (sum * sum - 4.0 * r * aside * aside).sqrt();
    0.5 * PI * (1.0 - (sum - 2.0 * r) / root)
}
