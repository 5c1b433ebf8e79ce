//! Solids that stand on a regular base: what cube, box, pyramid and prism have in common.

use super::{Form, HalfSpace};
use crate::value::sin_cos_degrees;
use glam::{DVec2, DVec3};

/// A convex solid over a horizontal base.
///
/// `base`: the base's corners as (x, z) offsets from `corner`, in order around it. `top_over_base`:
/// size of the top over that of the base, 0 (an apex) to 1 (upright sides). `rotation`: degrees about
/// the vertical through the base's centroid, counter-clockwise seen from above.
///
/// The sides' normals come from the base and the heights, never from differences of corners, so that
/// a tiny top or a place far from the origin costs them no digits.
pub(super) fn upright(
    corner: DVec3,
    base: &[DVec2],
    height: f64,
    top_over_base: f64,
    rotation: f64,
) -> Form {
    let centroid = base.iter().sum::<DVec2>() / base.len() as f64;
    let (sin, cos) = sin_cos_degrees(rotation);
    let turned = |v: DVec2| DVec2::new(v.x * cos + v.y * sin, v.y * cos - v.x * sin);
    // (b - c) + c is exact where (b + corner - c) + c would not be: an unturned cube keeps its corner.
    let place = |scale: f64, b: DVec2, y: f64| {
        let at = centroid + turned(b - centroid) * scale;
        corner + DVec3::new(at.x, y, at.y)
    };
    let mut corners: Vec<DVec3> = base.iter().map(|b| place(1.0, *b, 0.0)).collect();
    if top_over_base > 0.0 {
        corners.extend(base.iter().map(|b| place(top_over_base, *b, height)));
    } else {
        corners.push(place(0.0, centroid, height));
    }

    let through = |point: DVec3, normal: DVec3| HalfSpace { normal, offset: normal.dot(point) };
    let mut faces = vec![through(corner, DVec3::NEG_Y)];
    if top_over_base > 0.0 {
        faces.push(through(corner + DVec3::Y * height, DVec3::Y));
    }
    for (i, from) in base.iter().enumerate() {
        let to = base[(i + 1) % base.len()];
        let across = (to - from).perp().normalize();
        let reach = across.dot(from - centroid);
        let outward = turned(across * reach.signum());
        // At height y the side is `reach (1 - (1 - top_over_base) y / height)` from the axis.
        let up = reach.abs() * (1.0 - top_over_base) / height;
        let normal = DVec3::new(outward.x, up, outward.y).normalize();
        faces.push(through(corners[i], normal));
    }
    Form::Convex { faces, corners }
}
