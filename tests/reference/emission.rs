//! Emissive objects in the reference tracer. For direct light, points are sampled uniformly over
//! the area of emissive spheres, polygons and triangles. The emission of other shapes counts when a
//! ray hits them. There is no importance sampling.

use crate::harness::*;
use crate::reference::compounds::Body;
use crate::reference::surfaces::Piece;

/// Surface of an emissive object from which points are sampled.
pub enum Shine {
    Sphere(DVec3, f64),
    /// Triangles. Each has its corners, counter-clockwise as seen from the front, and the sum of
    /// the areas of all triangles up to and including itself.
    Triangles(Vec<([DVec3; 3], f64)>),
}

impl Shine {
    /// Returns the surface of an emissive object from which points are sampled. Returns `None` if
    /// only rays find the object's emission.
    pub fn new(body: &Body) -> Option<Self> {
        let leaf = body.simple()?;
        let place = leaf.scene_from_own();
        let (mut corners, mut sum) = (Vec::new(), 0.0);
        let mut add = |triangle: [DVec3; 3]| {
            let [a, b, c] = triangle;
            sum += 0.5 * (b - a).cross(c - a).length();
            corners.push((triangle, sum));
        };
        for piece in &leaf.pieces {
            match piece {
                Piece::Sphere(center, radius) => {
                    let scale = similarity(&place)?;
                    return Some(Self::Sphere(place.transform_point3(*center), radius * scale));
                }
                Piece::Polygon(polygon, normal) => {
                    let normal = leaf.scene_normal(*normal);
                    let all: Vec<_> = polygon.iter().map(|p| place.transform_point3(*p)).collect();
                    for pair in all[1..].windows(2) {
                        let [a, b, c] = [all[0], pair[0], pair[1]];
                        let front = (b - a).cross(c - a).dot(normal) > 0.0;
                        add(if front { [a, b, c] } else { [a, c, b] });
                    }
                }
                _ => return None,
            }
        }
        for triangle in leaf.mesh.iter().flat_map(|mesh| mesh.corners()) {
            let [a, b, c] = triangle.map(|p| place.transform_point3(p));
            add(if place.matrix3.determinant() > 0.0 { [a, b, c] } else { [a, c, b] });
        }
        (!corners.is_empty()).then_some(Self::Triangles(corners))
    }

    /// Returns three values: a uniform random point of the surface, the unit normal of the
    /// surface's front at this point, and the area of the surface.
    pub fn point(&self, numbers: &mut Numbers) -> (DVec3, DVec3, f64) {
        match self {
            Self::Sphere(center, radius) => {
                let normal = numbers.direction();
                (center + normal * *radius, normal, 4.0 * PI * radius * radius)
            }
            Self::Triangles(triangles) => {
                let area = triangles.last().map_or(0.0, |last| last.1);
                let chosen = numbers.unit() * area;
                let found = triangles.iter().find(|(_, sum)| *sum > chosen);
                let [a, b, c] = found.unwrap_or(&triangles[0]).0;
                // A uniform point of the parallelogram. Points beyond its diagonal are mirrored
                // into the triangle.
                let (mut x, mut y) = (numbers.unit(), numbers.unit());
                if x + y > 1.0 {
                    (x, y) = (1.0 - x, 1.0 - y);
                }
                (a + (b - a) * x + (c - a) * y, (b - a).cross(c - a).normalize(), area)
            }
        }
    }
}

/// Returns the scale factor of a similarity, a map of spheres to spheres. Returns `None` for other
/// maps.
fn similarity(map: &DAffine3) -> Option<f64> {
    let m = map.matrix3;
    let scale = m.x_axis.length();
    let close = |x: f64, y: f64| (x - y).abs() < 1e-9 * scale * scale;
    let keeps = close(m.y_axis.length_squared(), scale * scale)
        && close(m.z_axis.length_squared(), scale * scale)
        && close(m.x_axis.dot(m.y_axis), 0.0)
        && close(m.y_axis.dot(m.z_axis), 0.0)
        && close(m.z_axis.dot(m.x_axis), 0.0);
    keeps.then_some(scale)
}
