//! How close a point is to the surfaces of things.

use crate::asset::Mesh;
use crate::bvh::LEAF_FLAG;
use crate::primitive::Form;
use glam::{DAffine3, DMat3, DVec3};
use std::f64::consts::TAU;

/// The distance of `point` from the surfaces of `forms`, or less: outside of a box it is taken for the thing.
pub(super) fn clearance(forms: &[Form], point: DVec3) -> f64 {
    forms.iter().filter_map(|form| clearance_of(form, point)).fold(f64::INFINITY, f64::min)
}

/// The same of one form; `None`: it is a compound without parts.
pub(super) fn clearance_of(form: &Form, point: DVec3) -> Option<f64> {
    let inside = || match form {
        Form::Ellipsoid { scene_from_unit } => from_ellipsoid(scene_from_unit, point),
        Form::ConicalFrustum { scene_from_unit, top_radius: top } => {
            from_tapered(scene_from_unit, *top, point)
        }
        Form::Mesh { mesh, scene_from_mesh, .. } => from_mesh(mesh, scene_from_mesh, point),
        _ => 0.0,
    };
    match form {
        Form::Sphere { center, radius } => Some((point.distance(*center) - radius).abs()),
        Form::Plane { normal, offset } => Some((normal.dot(point) - offset).abs()),
        Form::ConvexPolyhedron { faces, .. } => {
            let beyond = faces.iter().map(|f| f.normal.dot(point) - f.offset);
            Some(beyond.fold(f64::NEG_INFINITY, f64::max).abs())
        }
        Form::Parallelogram { corner, u, v } => Some(from_parallelogram([*corner, *u, *v], point)),
        Form::Csg(compound) => {
            let parts = compound.parts.iter().filter_map(|part| clearance_of(part, point));
            parts.reduce(f64::min)
        }
        Form::Ellipsoid { .. } | Form::ConicalFrustum { .. } | Form::Mesh { .. } => {
            Some(box_distance(form, point).filter(|d| *d > 0.0).unwrap_or_else(inside))
        }
    }
}

/// How far `point` is from the form's box: 0 inside it; `None`: the form has no end.
pub(super) fn box_distance(form: &Form, point: DVec3) -> Option<f64> {
    let (low, high) = form.bounds()?;
    Some((low - point).max(point - high).max(DVec3::ZERO).length())
}

fn from_segment([a, b]: [DVec3; 2], point: DVec3) -> f64 {
    let along = b - a;
    let length2 = along.length_squared();
    let t = if length2 > 0.0 { ((point - a).dot(along) / length2).clamp(0.0, 1.0) } else { 0.0 };
    point.distance(a + along * t)
}

/// A corner and two edges.
fn from_parallelogram([corner, u, v]: [DVec3; 3], point: DVec3) -> f64 {
    let (normal, to) = (u.cross(v), point - corner);
    let size2 = normal.length_squared();
    let (a, b) = (to.cross(v).dot(normal) / size2, u.cross(to).dot(normal) / size2);
    if (0.0..=1.0).contains(&a) && (0.0..=1.0).contains(&b) {
        return normal.dot(to).abs() / size2.sqrt();
    }
    let corners = [corner, corner + u, corner + u + v, corner + v];
    (0..4)
        .map(|i| from_segment([corners[i], corners[(i + 1) % 4]], point))
        .fold(f64::INFINITY, f64::min)
}

fn from_triangle([a, b, c]: [DVec3; 3], point: DVec3) -> f64 {
    let (u, v, to) = (b - a, c - a, point - a);
    let normal = u.cross(v);
    let size2 = normal.length_squared();
    let (s, t) = (to.cross(v).dot(normal) / size2, u.cross(to).dot(normal) / size2);
    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        return normal.dot(to).abs() / size2.sqrt();
    }
    [[a, b], [b, c], [c, a]]
        .map(|edge| from_segment(edge, point))
        .into_iter()
        .fold(f64::INFINITY, f64::min)
}

/// From the image of the unit sphere. With Q = (M M^T)^-1 and p from the centre, the nearest point q of
/// q^T Q q = 1 is (I + l Q)^-1 p for the only l at which it lies there and I + l Q is positive definite: q^T Q q
/// falls with l. (Eberly 2013, *Distance from a Point to an Ellipse, an Ellipsoid, or a Hyperellipsoid*.)
fn from_ellipsoid(scene_from_unit: &DAffine3, point: DVec3) -> f64 {
    let inverse = scene_from_unit.matrix3.inverse();
    let q = inverse.transpose() * inverse;
    let size = q.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
    // In the middle several points are the nearest; a little aside one of them is.
    let aside = DVec3::new(0.6, 0.5, 0.7) * (1e-8 / size.sqrt());
    let p = point - scene_from_unit.translation + aside;
    // The smallest half-axis is at least 1 / sqrt(size) and at most 3^(1/4) times that.
    let (mut low, mut high) = (-1.8 / size, 0.25 * p.length_squared() + 1.0 / size);
    let mut nearest = p;
    for _ in 0..160 {
        let middle = 0.5 * (low + high);
        let matrix = DMat3::IDENTITY + q * middle;
        let [x, y, _] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
        let definite = x.x > 0.0 && x.x * y.y - x.y * y.x > 0.0 && matrix.determinant() > 0.0;
        if definite {
            nearest = matrix.inverse() * p;
        }
        if !definite || nearest.dot(q * nearest) > 1.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    nearest.distance(p)
}

/// From the image of a tapered cylinder (see [`Form::Tapered`]): its surface is made of outlines of three
/// segments, from the middle of the base over both rims to the middle of the cap, one for each angle.
fn from_tapered(scene_from_unit: &DAffine3, top: f64, point: DVec3) -> f64 {
    const ANGLES: usize = 64;
    let place = |x, y, z| scene_from_unit.transform_point3(DVec3::new(x, y, z));
    let (base, cap) = (place(0.0, 0.0, 0.0), place(0.0, 0.0, 1.0));
    let at = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        let (low, high) = (place(cos, sin, 0.0), place(top * cos, top * sin, 1.0));
        let sides = [[base, low], [low, high], [high, cap]];
        sides.map(|side| from_segment(side, point)).into_iter().fold(f64::INFINITY, f64::min)
    };
    let step = TAU / ANGLES as f64;
    let sampled: Vec<f64> = (0..ANGLES).map(|i| at(i as f64 * step)).collect();
    let mut least = f64::INFINITY;
    for i in 0..ANGLES {
        let beside = sampled[(i + 1) % ANGLES].min(sampled[(i + ANGLES - 1) % ANGLES]);
        if sampled[i] > beside {
            continue;
        }
        // The least value lies between the neighbours.
        let (mut low, mut high) = ((i as f64 - 1.0) * step, (i as f64 + 1.0) * step);
        for _ in 0..80 {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if at(a) < at(b) { high = b } else { low = a }
        }
        least = least.min(sampled[i]).min(at(0.5 * (low + high)));
    }
    least
}

/// From the nearest triangle.
fn from_mesh(mesh: &Mesh, scene_from_mesh: &DAffine3, point: DVec3) -> f64 {
    let inverse = scene_from_mesh.inverse();
    let inside = inverse.transform_point3(point);
    // Lengths in the scene are at least those in the mesh's space times this.
    let columns = inverse.matrix3.to_cols_array();
    let shrinks = columns.iter().map(|x| x * x).sum::<f64>().sqrt().recip();
    let mut least = f64::INFINITY;
    let mut todo = vec![(0u32, 0.0)];
    while let Some((branch, bound)) = todo.pop() {
        if bound >= least {
            continue;
        }
        let branch = &mesh.boxes().nodes()[branch as usize];
        let first = todo.len();
        for i in branch.children() {
            let corner =
                |from: usize| DVec3::from([0, 1, 2].map(|a| f64::from(branch.bounds[a + from][i])));
            let away = (corner(0) - inside).max(inside - corner(3)).max(DVec3::ZERO).length();
            let bound = away * shrinks;
            if bound >= least {
                continue;
            }
            if branch.child[i] & LEAF_FLAG == 0 {
                todo.push((branch.child[i], bound));
                continue;
            }
            let leaf = &mesh.leaves()[(branch.child[i] & !LEAF_FLAG) as usize];
            for place in 0..leaf.corners[0][0].len() {
                let corners = leaf.corners.map(|corner| {
                    scene_from_mesh
                        .transform_point3(DVec3::from(corner.map(|axis| f64::from(axis[place]))))
                });
                // Places without a triangle hold NaN.
                least = least.min(from_triangle(corners, point));
            }
        }
        // The nearest box last, to be looked at first.
        todo[first..].sort_by(|a, b| b.1.total_cmp(&a.1));
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    fn forms(text: &str) -> Vec<Form> {
        let scene = Scene::parse(text, "test").unwrap_or_else(|e| panic!("{e}"));
        let form = |o: &crate::scene::Object| o.shape.form().transformed(&o.scene_from_object());
        scene.objects.iter().map(form).collect()
    }

    fn near(form: &Form, point: [f64; 3], expected: f64) {
        let found = clearance_of(form, point.into()).unwrap();
        assert!(
            (found - expected).abs() <= 1e-6 * expected + 1e-7,
            "{point:?}: {found}, not {expected}"
        );
    }

    #[test]
    fn walls_around_a_point_are_as_near_as_they_are() {
        // Half-axes 1, 2 and 3.
        let ellipsoid = &forms(
            "[[object]]\nshape.sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }\n\
             transform = [{ scale = [1.0, 2.0, 3.0] }]\n",
        )[0];
        near(ellipsoid, [0.0; 3], 1.0);
        near(ellipsoid, [0.999, 0.0, 0.0], 0.001);
        near(ellipsoid, [0.0, 1.999_999, 0.0], 1e-6);
        near(ellipsoid, [0.0, 0.0, 2.99], 0.01);
        let cylinder = &forms(
            "[[object]]\nshape.cylinder = { base = [0.0, -5.0, 0.0], top = [0.0, 5.0, 0.0], radius = 2.0 }\n",
        )[0];
        near(cylinder, [1.9, 0.0, 0.0], 0.1);
        near(cylinder, [0.0, 4.75, 0.5], 0.25);
        near(cylinder, [0.0, 0.0, 0.0], 2.0);
        // In its box, but not in it.
        let corner = (2.0 * 0.95f64.powi(2) * 4.0).sqrt() - 2.0;
        near(cylinder, [1.9, 0.0, 1.9], corner);
        let cone = &forms(
            "[[object]]\nshape.cone = { base = [0.0, 0.0, 0.0], apex = [0.0, 1.0, 0.0], radius = 1.0 }\n",
        )[0];
        near(cone, [0.0, 0.4, 0.0], 0.4);
        near(cone, [0.0, 0.6, 0.0], 0.4 * 0.5f64.sqrt());
        let rectangle = &forms(
            "[[object]]\nshape.rectangle = { center = [0.0, 0.0, 0.0], size = [2.0, 2.0], \
             normal = [1.0, 1.0, 0.0] }\n",
        )[0];
        near(rectangle, [0.3, 0.3, 0.0], 0.18f64.sqrt());
        near(rectangle, [0.0, 0.0, 1.5], 0.5);
    }

    /// Needles and sheets, against many points of their surfaces.
    #[test]
    fn stretched_things_are_no_nearer_and_no_farther_than_their_points() {
        let shapes = [
            "sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }",
            "cylinder = { base = [0.0, -1.0, 0.0], top = [0.0, 1.0, 0.0], radius = 1.0 }",
        ];
        let stretches = ["[1.0, 4.0, 0.3]", "[30.0, 1.0, 1.0]", "[5.0, 0.02, 5.0]"];
        for (shape, stretch) in shapes.iter().flat_map(|s| stretches.map(|t| (s, t))) {
            let form = &forms(&format!(
                "[[object]]\nshape.{shape}\ntransform = [{{ scale = {stretch} }}, {{ rotate_x = 30.0 }}, \
                 {{ rotate_z = 20.0 }}]\n"
            ))[0];
            let surface: Vec<DVec3> = (0..400)
                .flat_map(|i| (0..400).map(move |j| (f64::from(i) / 400.0, f64::from(j) / 399.0)))
                .flat_map(|(u, v)| {
                    let (sin, cos) = (TAU * u).sin_cos();
                    match form {
                        Form::Ellipsoid { scene_from_unit: m } => {
                            let z = 2.0 * v - 1.0;
                            let r = (1.0 - z * z).sqrt();
                            vec![m.transform_point3(DVec3::new(r * cos, r * sin, z))]
                        }
                        Form::ConicalFrustum { scene_from_unit: m, .. } => {
                            [(1.0, v), (v, 0.0), (v, 1.0)]
                                .map(|(r, z)| m.transform_point3(DVec3::new(r * cos, r * sin, z)))
                                .to_vec()
                        }
                        _ => unreachable!("{form:?}"),
                    }
                })
                .collect();
            let (low, high) = form.bounds().unwrap();
            for i in 0..40 {
                let part = |k: f64| (f64::from(i) * k).fract();
                let at = DVec3::new(part(0.618), part(0.755), part(0.57));
                let point = low + (high - low) * at;
                let found = clearance_of(form, point).unwrap();
                let nearest =
                    surface.iter().map(|p| p.distance(point)).fold(f64::INFINITY, f64::min);
                let gap = 0.02 * low.distance(high);
                assert!(found <= nearest * 1.000_001, "{shape} {stretch}: {found} {nearest}");
                assert!(found >= nearest - gap, "{shape} {stretch}: {found} {nearest}");
            }
        }
    }

    #[test]
    fn the_nearest_triangle_of_a_mesh_is_found() {
        let point = DVec3::new(0.3, 0.2, 0.1);
        let [a, b, c] = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert!((from_triangle([a, b, c], point) - 0.1).abs() < 1e-15);
        assert!(
            (from_triangle([a, b, c], DVec3::new(1.0, 1.0, 0.0)) - 0.5f64.sqrt()).abs() < 1e-15
        );
        assert!((from_triangle([a, b, c], DVec3::new(-1.0, 0.0, 0.0)) - 1.0).abs() < 1e-15);
        assert!((from_triangle([a, b, c], DVec3::new(0.5, -2.0, 0.0)) - 2.0).abs() < 1e-15);
    }
}
