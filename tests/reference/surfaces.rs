//! Shapes of the reference tracer as simple pieces: spheres, polygons, infinite planes, discs, tori
//! and the sides of cones, in the coordinates of the shapes' descriptions. No code is shared with
//! the program.

use crate::harness::*;

/// Simple surface, in the coordinates of the shape's description, before the object's transform.
pub enum Piece {
    /// Sphere: centre, radius.
    Sphere(DVec3, f64),
    /// Polygon: corners in order, and front normal.
    Polygon(Vec<DVec3>, DVec3),
    /// Infinite plane: point and front normal.
    Plane(DVec3, DVec3),
    /// Disc: centre, normal, radius.
    Disc(DVec3, DVec3, f64),
    /// Side of a cone: start, direction and length of the axis, and the radii at both ends.
    Side(DVec3, DVec3, f64, [f64; 2]),
    /// Torus: centre, axis, and the radii of ring and tube.
    Torus(DVec3, DVec3, [f64; 2]),
}

impl Piece {
    /// Passes the distances at which a line crosses the piece to `take`, in lengths of the
    /// direction. Crossings behind the origin may be left out.
    pub fn meet(&self, origin: DVec3, direction: DVec3, mut take: impl FnMut(f64)) {
        match self {
            Self::Sphere(center, radius) => {
                let f = origin - center;
                let a = direction.dot(direction);
                let b = f.dot(direction);
                let c = f.dot(f) - radius * radius;
                let root = b * b - a * c;
                if root >= 0.0 {
                    take((-b - root.sqrt()) / a);
                    take((-b + root.sqrt()) / a);
                }
            }
            Self::Disc(center, normal, radius) => {
                let hit = flat(*center, *normal, origin, direction);
                let inside = |t: &f64| (origin + direction * *t).distance(*center) <= *radius;
                hit.filter(inside).map(take);
            }
            Self::Side(base, axis, height, [r0, r1]) => {
                let across = |v: DVec3| v - *axis * v.dot(*axis);
                let f = origin - base;
                let (p, d) = (across(f), across(direction));
                let slope = (r1 - r0) / height;
                let (r, widening) = (r0 + slope * f.dot(*axis), slope * direction.dot(*axis));
                let a = d.dot(d) - widening * widening;
                let b = p.dot(d) - r * widening;
                let c = p.dot(p) - r * r;
                let root = (b * b - a * c).sqrt();
                for t in [(-b - root) / a, (-b + root) / a] {
                    // Without a crossing, `t` and `z` are NaN, and both comparisons are false.
                    let z = (f + direction * t).dot(*axis);
                    if z >= 0.0 && z <= *height {
                        take(t);
                    }
                }
            }
            Self::Torus(center, axis, radii) => {
                let height = |t: f64| above_torus(origin + direction * t - center, *axis, *radii);
                torus_crossings(origin - center, direction, radii[0] + radii[1], &height, take);
            }
            Self::Plane(point, normal) => {
                flat(*point, *normal, origin, direction).map(take);
            }
            Self::Polygon(corners, normal) => {
                let hit = flat(corners[0], *normal, origin, direction);
                let Some(t) = hit.filter(|t| *t > 0.0) else { return };
                let p = origin + direction * t;
                // The point is on the same side of all edges, in either orientation.
                let mut a = corners[corners.len() - 1];
                let (mut left, mut right) = (true, true);
                for b in corners {
                    let side = (b - a).cross(p - a).dot(*normal);
                    (left, right) = (left && side >= 0.0, right && side <= 0.0);
                    if !left && !right {
                        return;
                    }
                    a = *b;
                }
                take(t);
            }
        }
    }

    /// Returns the normal at the crossing of a line with the piece at the distance `t`.
    pub fn normal(&self, origin: DVec3, direction: DVec3, t: f64) -> DVec3 {
        match self {
            Self::Sphere(center, radius) => (origin + direction * t - center) / *radius,
            Self::Side(base, axis, height, [r0, r1]) => {
                let from_base = origin - base + direction * t;
                let from_axis = from_base - *axis * from_base.dot(*axis);
                (from_axis.normalize() - *axis * ((r1 - r0) / height)).normalize()
            }
            Self::Torus(center, axis, radii) => {
                let p = origin + direction * t - center;
                let across = p - *axis * p.dot(*axis);
                (p - across.normalize() * radii[0]).normalize()
            }
            Self::Disc(_, normal, _) | Self::Plane(_, normal) | Self::Polygon(_, normal) => *normal,
        }
    }
}

impl Piece {
    /// Returns centre and radius of a ball that contains the piece. Returns `None` for an infinite
    /// piece.
    pub fn ball(&self) -> Option<(DVec3, f64)> {
        match self {
            Self::Plane(..) => None,
            Self::Sphere(center, radius) | Self::Disc(center, _, radius) => {
                Some((*center, *radius))
            }
            Self::Polygon(corners, _) => {
                let center = corners.iter().sum::<DVec3>() / corners.len() as f64;
                let distances = corners.iter().map(|corner| corner.distance(center));
                Some((center, distances.fold(0.0, f64::max)))
            }
            Self::Side(base, axis, height, [r0, r1]) => {
                Some((*base + *axis * (0.5 * height), (0.5 * height).hypot(r0.max(*r1))))
            }
            Self::Torus(center, _, [ring, tube]) => Some((*center, ring + tube)),
        }
    }

    /// Returns `true` if a point is on the inner side of this piece of a solid's surface. A point
    /// that is on the inner side of all pieces is inside the solid, because every solid is convex
    /// or a torus, which is a single piece.
    pub fn is_behind(&self, point: DVec3) -> bool {
        match self {
            Self::Sphere(center, radius) => point.distance(*center) <= *radius,
            Self::Polygon(corners, normal) => normal.dot(point - corners[0]) <= 0.0,
            Self::Torus(center, axis, radii) => above_torus(point - center, *axis, *radii) <= 0.0,
            Self::Plane(on, normal) | Self::Disc(on, normal, _) => normal.dot(point - on) <= 0.0,
            Self::Side(base, axis, height, [r0, r1]) => {
                let z = axis.dot(point - base);
                (point - base - *axis * z).length() <= r0 + (r1 - r0) * z / height
            }
        }
    }
}

/// Returns the distance of the point `p` from the surface of a torus about the origin; it is
/// negative inside the torus.
fn above_torus(p: DVec3, axis: DVec3, [ring, tube]: [f64; 2]) -> f64 {
    let along = p.dot(axis);
    ((p - axis * along).length() - ring).hypot(along) - tube
}

/// Passes the distances at which a line crosses a torus to `take`. `from_center` is the origin of
/// the line relative to the torus's centre. The line is sampled in small steps through a ball of
/// radius `reach` around the torus. Where `height`, the distance from the surface at a point of the
/// line, changes its sign, [`root`] finds the crossing.
fn torus_crossings(
    from_center: DVec3,
    direction: DVec3,
    reach: f64,
    height: &impl Fn(f64) -> f64,
    mut take: impl FnMut(f64),
) {
    const STEPS: usize = 200;
    let length2 = direction.length_squared();
    let middle = -from_center.dot(direction) / length2;
    let nearest = (from_center + direction * middle).length_squared();
    let half = ((reach * reach - nearest) / length2).sqrt() * 1.001;
    if half.is_nan() {
        return;
    }
    let place = |i: usize| middle + half * (2.0 * i as f64 / STEPS as f64 - 1.0);
    // The height is the distance from the torus. It keeps its sign while the point on the line
    // advances by less than this distance. `steps_per_height` converts a height to a number of
    // steps. The factor 0.999 covers rounding.
    let steps_per_height = 0.999 * STEPS as f64 / (2.0 * half * length2.sqrt());
    let mut before = height(place(0));
    let mut next = 1 + (before.abs() * steps_per_height) as usize;
    let mut i = next;
    while i <= STEPS {
        let after = height(place(i));
        if (before < 0.0) != (after < 0.0) {
            let (start, end) = (place(i - 1), place(i));
            take(root(height, [start, end], [height(start), after], 1e-15 * reach));
        }
        next = i + 1 + (after.abs() * steps_per_height) as usize;
        (before, i) = (after, next);
    }
}

/// Returns an argument between `low` and `high` at which the magnitude of `f` is at most
/// `tolerance`. Uses the Illinois method: false position that halves the value at an end which
/// stays a second time. `f_low` and `f_high` are the values of `f` at the ends, of different signs.
fn root(
    f: &impl Fn(f64) -> f64,
    [mut low, mut high]: [f64; 2],
    [mut f_low, mut f_high]: [f64; 2],
    tolerance: f64,
) -> f64 {
    let (mut t, mut moved) = (low, 0);
    // Rounding of `f` may be above the tolerance.
    for _ in 0..60 {
        t = low + (high - low) * (f_low / (f_low - f_high));
        let value = f(t);
        if value.abs() <= tolerance {
            break;
        }
        if (value < 0.0) == (f_low < 0.0) {
            (low, f_low) = (t, value);
            f_high *= if moved == -1 { 0.5 } else { 1.0 };
            moved = -1;
        } else {
            (high, f_high) = (t, value);
            f_low *= if moved == 1 { 0.5 } else { 1.0 };
            moved = 1;
        }
    }
    t
}

/// Returns the distance at which a line crosses a plane, in lengths of the direction. Returns
/// `None` for a parallel line.
fn flat(point: DVec3, normal: DVec3, origin: DVec3, direction: DVec3) -> Option<f64> {
    let speed = normal.dot(direction);
    (speed != 0.0).then(|| normal.dot(point - origin) / speed)
}

pub fn map(step: &TransformOp) -> DAffine3 {
    let rotation = |axis: DVec3, degrees: f64| {
        DAffine3::from_axis_angle(axis.normalize(), degrees.to_radians())
    };
    match step {
        TransformOp::Translate(by) => DAffine3::from_translation(DVec3::from(*by)),
        TransformOp::RotateX(degrees) => rotation(DVec3::X, *degrees),
        TransformOp::RotateY(degrees) => rotation(DVec3::Y, *degrees),
        TransformOp::RotateZ(degrees) => rotation(DVec3::Z, *degrees),
        TransformOp::Rotate(r) => rotation(DVec3::from(r.axis), r.degrees),
        TransformOp::Scale(s) => DAffine3::from_mat3(DMat3::from_diagonal(DVec3::from(s.0))),
    }
}

/// Returns the pieces of a simple shape other than a mesh.
///
/// # Errors
///
/// Names a shape that this tracer does not support.
#[allow(unreachable_patterns, reason = "kinds that this tracer does not support may be added")]
pub fn pieces(shape: &Shape) -> Result<Vec<Piece>, String> {
    let v = |a: [f64; 3]| DVec3::from(a);
    let square = |side: f64| vec![[0.0, 0.0], [side, 0.0], [side, -side], [0.0, -side]];
    Ok(match shape {
        Shape::Sphere(s) => vec![Piece::Sphere(v(s.center), s.radius)],
        Shape::Plane(p) => vec![Piece::Plane(v(p.point), v(p.normal).normalize())],
        Shape::HorizontalRectangle(p) => {
            let half = DVec3::new(0.5 * p.size[0], 0.0, 0.5 * p.size[1]);
            let corner = |x: f64, z: f64| v(p.center) + half * DVec3::new(x, 0.0, z);
            let corners =
                vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            vec![Piece::Polygon(corners, DVec3::Y)]
        }
        Shape::Rectangle(r) => {
            let front = v(r.normal).normalize();
            let right = v(r.up).cross(front).normalize();
            let up = front.cross(right);
            let corner = |x: f64, y: f64| {
                v(r.center) + right * (0.5 * x * r.size[0]) + up * (0.5 * y * r.size[1])
            };
            let corners =
                vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            vec![Piece::Polygon(corners, front)]
        }
        Shape::Cylinder(c) => round(v(c.base), v(c.top), [c.radius; 2]),
        Shape::Cone(c) => round(v(c.base), v(c.apex), [c.radius, 0.0]),
        Shape::TaperedCylinder(c) => round(v(c.base), v(c.top), [c.base_radius, c.top_radius]),
        Shape::UnitFrustum(c) => round(DVec3::ZERO, DVec3::Z, [1.0, c.s]),
        Shape::Torus(t) => {
            vec![Piece::Torus(v(t.center), v(t.axis).normalize(), [t.ring, t.tube])]
        }
        Shape::Cuboid(b) => {
            let [x, y, z] = b.size;
            let base = vec![[0.0, 0.0], [x, 0.0], [x, -z], [0.0, -z]];
            let corner = v(b.center) + DVec3::new(-0.5 * x, -0.5 * y, 0.5 * z);
            frustum(corner, &base, y, 1.0, 0.0)
        }
        Shape::Cube(c) => frustum(v(c.corner), &square(c.edge), c.edge, 1.0, c.rotation),
        Shape::Prism(p) => {
            let third = [0.5 * p.side, -0.5 * 3f64.sqrt() * p.side];
            let base = vec![[0.0, 0.0], [p.side, 0.0], third];
            frustum(v(p.corner), &base, p.height, 1.0, p.rotation)
        }
        Shape::Pyramid(p) => {
            let height = p.height.min(p.apex_height);
            let top = 1.0 - height / p.apex_height;
            frustum(v(p.corner), &square(p.side), height, top, p.rotation)
        }
        other => return Err(format!("a shape it has no pieces for: {other:?}")),
    })
}

/// Returns the two ends and the side of a solid of revolution.
fn round(base: DVec3, top: DVec3, radii: [f64; 2]) -> Vec<Piece> {
    let axis = (top - base).normalize();
    vec![
        Piece::Disc(base, -axis, radii[0]),
        Piece::Disc(top, axis, radii[1]),
        Piece::Side(base, axis, base.distance(top), radii),
    ]
}

/// Returns base, top and sides of an upright solid. `base` has the corners as x and z relative to
/// `corner`; the top is `top` times as large as the base. The base is rotated about its centroid,
/// counter-clockwise as seen from above.
fn frustum(corner: DVec3, base: &[[f64; 2]], height: f64, top: f64, degrees: f64) -> Vec<Piece> {
    let base: Vec<DVec2> = base.iter().map(|b| DVec2::from(*b)).collect();
    let middle = base.iter().sum::<DVec2>() / base.len() as f64;
    let (sin, cos) = degrees.to_radians().sin_cos();
    let ring = |scale: f64, y: f64| -> Vec<DVec3> {
        let place = |b: &DVec2| {
            let d = (*b - middle) * scale;
            let rotated = DVec2::new(d.x * cos + d.y * sin, -d.x * sin + d.y * cos);
            corner + DVec3::new(middle.x + rotated.x, y, middle.y + rotated.y)
        };
        base.iter().map(place).collect()
    };
    let (low, high) = (ring(1.0, 0.0), ring(top, height));
    let inner = (low.iter().sum::<DVec3>() + high.iter().sum::<DVec3>()) / (2 * low.len()) as f64;
    let mut faces = vec![low.clone()];
    if top > 0.0 {
        faces.push(high.clone());
    }
    for i in 0..low.len() {
        let j = (i + 1) % low.len();
        let mut face = vec![low[i], low[j], high[j]];
        if top > 0.0 {
            face.push(high[i]);
        }
        faces.push(face);
    }
    let outward = |face: &Vec<DVec3>| {
        let normal = (face[1] - face[0]).cross(face[2] - face[0]).normalize();
        if normal.dot(face[0] - inner) > 0.0 { normal } else { -normal }
    };
    faces
        .into_iter()
        .map(|face| {
            let n = outward(&face);
            Piece::Polygon(face, n)
        })
        .collect()
}
