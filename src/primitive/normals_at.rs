//! The surfaces that a point lies on.

use crate::primitive::form::Form;
use glam::DVec3;
use std::f64::consts::TAU;

/// At the tip of a cone so many normals stand for the circle of them.
pub(crate) const AROUND_TIP: u32 = 64;

impl Form {
    /// Unit normals of the form's surfaces that pass `point` within `slack`, once for each convex solid that
    /// it is made of; empty: none does.
    pub fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>> {
        let solid = |sides: Vec<(f64, DVec3)>| {
            // Within a convex solid, or near, the farthest outside of its sides is the distance.
            let near = sides.iter().all(|(height, _)| *height <= slack);
            let on = sides.into_iter().filter(|(height, _)| near && *height >= -slack);
            let normals: Vec<DVec3> = on.map(|(_, normal)| normal).collect();
            if normals.is_empty() { Vec::new() } else { vec![normals] }
        };
        match self {
            Self::Sphere { center, radius } => {
                let from_center = point - center;
                let distance = from_center.length();
                solid(vec![(distance - radius, from_center / distance)])
            }
            Self::Ellipsoid { scene_from_unit } => {
                let unit_from_scene = scene_from_unit.inverse();
                let on_unit = unit_from_scene.transform_point3(point);
                let distance = on_unit.length();
                let steepness = unit_from_scene.matrix3.transpose() * (on_unit / distance);
                solid(vec![((distance - 1.0) / steepness.length(), steepness.normalize())])
            }
            Self::ConvexPolyhedron { faces, .. } => {
                solid(faces.iter().map(|f| (f.normal.dot(point) - f.offset, f.normal)).collect())
            }
            Self::ConicalFrustum { scene_from_unit, top_radius: top } => {
                let unit_from_scene = scene_from_unit.inverse();
                let normal_of = |n: DVec3| unit_from_scene.matrix3.transpose() * n;
                let p = unit_from_scene.transform_point3(point);
                let (rho, slope) = (p.x.hypot(p.y), top - 1.0);
                let up = normal_of(DVec3::Z);
                let (height, up) = (up.length().recip(), up.normalize());
                let mut sides = vec![(-p.z * height, -up)];
                if *top > 0.0 {
                    sides.push(((p.z - 1.0) * height, up));
                }
                let mut side = |out: DVec3| {
                    let normal = normal_of(DVec3::new(out.x, out.y, -slope));
                    let beside = (rho - (1.0 + slope * p.z)) / normal.length();
                    sides.push((beside, normal.normalize()));
                };
                let across = normal_of(DVec3::new(p.x, p.y, 0.0) / rho).length();
                if rho > 2.0 * slack * across {
                    side(DVec3::new(p.x / rho, p.y / rho, 0.0));
                } else {
                    for i in 0..AROUND_TIP {
                        let (sin, cos) = (TAU * f64::from(i) / f64::from(AROUND_TIP)).sin_cos();
                        side(DVec3::new(cos, sin, 0.0));
                    }
                }
                solid(sides)
            }
            Self::Csg(compound) => {
                compound.parts.iter().flat_map(|part| part.normals_at(point, slack)).collect()
            }
            Self::Mesh { mesh, scene_from_mesh, .. } => {
                let Some((low, high)) = self.bounds() else { return Vec::new() };
                if point.cmplt(low - slack).any() || point.cmpgt(high + slack).any() {
                    return Vec::new();
                }
                let mesh = mesh.mesh();
                let corner = |i: u32| {
                    let position = mesh.positions[i as usize].map(f64::from);
                    scene_from_mesh.transform_point3(DVec3::from(position))
                };
                let mut normals: Vec<DVec3> = Vec::new();
                for triangle in &mesh.triangles {
                    let Some(normal) = normal_of_triangle(triangle.map(corner), point, slack)
                    else {
                        continue;
                    };
                    if normals.iter().all(|known| known.distance(normal) > 1e-3) {
                        normals.push(normal);
                    }
                }
                if normals.is_empty() { Vec::new() } else { vec![normals] }
            }
            Self::Parallelogram { corner, u, v } => {
                let normal = u.cross(*v).normalize();
                let Some((low, high)) = self.bounds() else { return Vec::new() };
                let away = (low - point).max(point - high).max_element();
                let on = normal.dot(point - corner).abs() <= slack && away <= slack;
                if on { vec![vec![normal]] } else { Vec::new() }
            }
            Self::Plane { normal, offset } => {
                let on = (normal.dot(point) - offset).abs() <= slack;
                if on { vec![vec![*normal]] } else { Vec::new() }
            }
        }
    }
}

/// The unit normal of a triangle that passes `point` within `slack`.
fn normal_of_triangle([a, b, c]: [DVec3; 3], point: DVec3, slack: f64) -> Option<DVec3> {
    let normal = (b - a).cross(c - a).try_normalize()?;
    if normal.dot(point - a).abs() > slack {
        return None;
    }
    // Beyond an edge by no more than the slack.
    let inside = [(a, b), (b, c), (c, a)].into_iter().all(|(from, to)| {
        let inward = normal.cross(to - from);
        inward.dot(point - from) >= -slack * inward.length()
    });
    inside.then_some(normal)
}
