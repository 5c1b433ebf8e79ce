//! Analytic shapes, independent of the program. Solids are implicit functions, negative inside.
//! Rectangles and triangles are intersected directly.

use crate::agreement::surfaces::map;
use crate::harness::*;

/// Implicit function: negative inside, zero on the surface, positive outside.
pub type Inside = Box<dyn Fn(DVec3) -> f64 + Sync>;
/// Function that returns the distances of all hits of the ray with the given origin and direction.
pub type Crossings = Box<dyn Fn(DVec3, DVec3) -> Vec<f64> + Sync>;

/// Analytic form of an object.
pub enum AnalyticShape {
    /// Solid: implicit function, and its largest slope; infinity if the slope is unknown.
    Solid(Inside, f64),
    Thin(Crossings),
}

impl AnalyticShape {
    /// Creates the shape of any object but a mesh.
    pub fn new(object: &Object) -> Self {
        let v = |a: [f64; 3]| DVec3::from(a);
        match &object.shape {
            Shape::HorizontalRectangle(p) => {
                let [x, z] = p.size;
                Self::Thin(rectangle(v(p.center), DVec3::X * (0.5 * x), DVec3::NEG_Z * (0.5 * z)))
            }
            Shape::Rectangle(r) => {
                let right = v(r.up).cross(v(r.normal)).normalize();
                let up = v(r.normal).cross(right).normalize();
                let [width, height] = r.size;
                Self::Thin(rectangle(v(r.center), right * (0.5 * width), up * (0.5 * height)))
            }
            shape => {
                let is_distance =
                    matches!(shape, Shape::Sphere(_) | Shape::Plane(_) | Shape::Cuboid(_))
                        && !object
                            .transform
                            .iter()
                            .any(|step| matches!(step, TransformOp::Scale(_)));
                let slope = if is_distance { 1.0 } else { f64::INFINITY };
                Self::Solid(placed(inside(shape), &object.transform), slope)
            }
        }
    }
}

/// Returns the function that intersects rays with a rectangle: the points `center` + a `u` + b `v`
/// with |a| <= 1 and |b| <= 1. The vectors `u` and `v` are perpendicular.
fn rectangle(center: DVec3, u: DVec3, v: DVec3) -> Crossings {
    let normal = u.cross(v);
    Box::new(move |origin, direction| {
        let t = normal.dot(center - origin) / normal.dot(direction);
        let offset = origin + direction * t - center;
        let within = |axis: DVec3| offset.dot(axis).abs() <= axis.length_squared();
        if t > 0.0 && within(u) && within(v) { vec![t] } else { Vec::new() }
    })
}

/// Returns the function that intersects rays with triangles. It solves origin + t direction = a + x
/// (b - a) + y (c - a), where a, b, c are the corners of a triangle.
pub fn triangles(list: Vec<[DVec3; 3]>, scene_from_mesh: DAffine3) -> Crossings {
    let placed = move |t: &[DVec3; 3]| t.map(|corner| scene_from_mesh.transform_point3(corner));
    let list: Vec<[DVec3; 3]> = list.iter().map(placed).collect();
    Box::new(move |origin, direction| {
        let intersect = |[a, b, c]: &[DVec3; 3]| {
            let (u, v) = (b - a, c - a);
            let across = direction.cross(v);
            let volume = u.dot(across);
            let x = (origin - a).dot(across) / volume;
            let turned = (origin - a).cross(u);
            let y = direction.dot(turned) / volume;
            let t = v.dot(turned) / volume;
            (x >= 0.0 && y >= 0.0 && x + y <= 1.0 && t > 0.0).then_some(t)
        };
        list.iter().filter_map(intersect).collect()
    })
}

fn placed(inside: Inside, steps: &[TransformOp]) -> Inside {
    if steps.is_empty() {
        return inside;
    }
    let object_from_scene = placement(steps).inverse();
    Box::new(move |p| inside(object_from_scene.transform_point3(p)))
}

pub fn placement(steps: &[TransformOp]) -> DAffine3 {
    steps.iter().fold(DAffine3::IDENTITY, |all, step| map(step) * all)
}

fn inside(shape: &Shape) -> Inside {
    let v = |a: [f64; 3]| DVec3::from(a);
    let box_of = |p: DVec3, half: DVec3| (p.abs() - half).max_element();
    match shape.clone() {
        Shape::Sphere(s) => Box::new(move |p| p.distance(v(s.center)) - s.radius),
        Shape::Plane(s) => Box::new(move |p| v(s.normal).normalize().dot(p - v(s.point))),
        Shape::Cuboid(b) => Box::new(move |p| box_of(p - v(b.center), v(b.size) / 2.0)),
        Shape::Cube(c) => {
            let half = DVec3::splat(c.edge / 2.0);
            let middle = v(c.corner) + DVec3::new(half.x, half.y, -half.z);
            Box::new(move |p| box_of(unturned(p - middle, c.rotation), half))
        }
        Shape::Pyramid(s) => {
            let foot = v(s.corner) + DVec3::new(s.side / 2.0, 0.0, -s.side / 2.0);
            let height = s.height.min(s.apex_height);
            Box::new(move |p| {
                let q = unturned(p - foot, s.rotation);
                // Half width of the cross section.
                let half = s.side / 2.0 * (1.0 - q.y / s.apex_height);
                (q.x.abs() - half).max(q.z.abs() - half).max(-q.y).max(q.y - height)
            })
        }
        Shape::Prism(s) => {
            // Distance from the centroid to each of the three sides.
            let in_radius = s.side / 12f64.sqrt();
            let foot = v(s.corner) + DVec3::new(s.side / 2.0, 0.0, -in_radius);
            let sides = [90.0, 210.0, 330.0].map(|a: f64| {
                let (z, x) = a.to_radians().sin_cos();
                DVec3::new(x, 0.0, z)
            });
            Box::new(move |p| {
                let q = unturned(p - foot, s.rotation);
                let outmost = sides.iter().map(|n| n.dot(q)).fold(f64::MIN, f64::max);
                (outmost - in_radius).max(-q.y).max(q.y - s.height)
            })
        }
        Shape::Cylinder(c) => round(v(c.base), v(c.top), [c.radius; 2]),
        Shape::Cone(c) => round(v(c.base), v(c.apex), [c.radius, 0.0]),
        Shape::TaperedCylinder(c) => round(v(c.base), v(c.top), [c.base_radius, c.top_radius]),
        // Canonical form: x^2 + y^2 = (1 + (s - 1) z)^2 between z = 0 and z = 1.
        Shape::UnitFrustum(c) => {
            Box::new(move |p| (p.x.hypot(p.y) - (1.0 + (c.s - 1.0) * p.z)).max(-p.z).max(p.z - 1.0))
        }
        Shape::Torus(t) => Box::new(move |p| {
            let (axis, q) = (v(t.axis).normalize(), p - v(t.center));
            let along = axis.dot(q);
            ((q - axis * along).length() - t.ring).hypot(along) - t.tube
        }),
        Shape::Union(u) => {
            let parts = parts(&u.of);
            Box::new(move |p| parts.iter().map(|f| f(p)).fold(f64::MAX, f64::min))
        }
        Shape::Intersection(i) => {
            let parts = parts(&i.of);
            Box::new(move |p| parts.iter().map(|f| f(p)).fold(f64::MIN, f64::max))
        }
        Shape::Difference(d) => {
            let parts = parts(&d.of);
            Box::new(move |p| parts[1..].iter().map(|f| -f(p)).fold(parts[0](p), f64::max))
        }
        other => panic!("no function for {}", other.key()),
    }
}

fn parts(operands: &[CsgOperand]) -> Vec<Inside> {
    operands.iter().map(|part| placed(inside(&part.shape), &part.transform)).collect()
}

/// Returns `p`, rotated back: the inverse of a rotation about the vertical by `degrees`,
/// counter-clockwise as seen from above.
fn unturned(p: DVec3, degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    // Seen from above x points right and z down.
    DVec3::new(p.x * cos - p.z * sin, p.y, p.x * sin + p.z * cos)
}

fn round(base: DVec3, top: DVec3, [r0, r1]: [f64; 2]) -> Inside {
    let (axis, length) = ((top - base).normalize(), base.distance(top));
    Box::new(move |p| {
        let along = axis.dot(p - base);
        let out = (p - base - axis * along).length();
        (out - (r0 + (r1 - r0) * along / length)).max(-along).max(along - length)
    })
}
