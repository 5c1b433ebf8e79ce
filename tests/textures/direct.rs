//! Direct evaluation of a textured object in double precision: camera ray, intersection in object
//! space, mapping formula, texture lookup, Lambert's law. It has no code in common with the
//! program.

use crate::harness::*;

/// Width and height of the pictures in pixels.
pub const SIZE: [u32; 2] = [60, 48];

/// Direction from the object to the light, not normalised.
pub const TO_LIGHT: DVec3 = DVec3::new(0.5, 0.7, 0.9);

/// Shape of the object, in object space.
#[derive(Clone, Copy, Debug)]
pub enum Solid {
    /// Sphere: centre, radius.
    Sphere(DVec3, f64),
    /// Box: centre, lengths of the sides.
    Block(DVec3, DVec3),
    /// Upright cylinder: base, height along y, radius.
    Pillar(DVec3, f64, f64),
    /// Rectangle that faces +z: centre, width, height.
    Sheet(DVec3, f64, f64),
    /// Plane that faces +y: a point on it.
    Floor(DVec3),
}

/// Placement of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lay {
    pub mapping: &'static str,
    pub axis: Option<char>,
    pub scale: [f64; 2],
    pub offset: [f64; 2],
    pub clamp: bool,
    pub nearest: bool,
}

impl Lay {
    pub const fn new(mapping: &'static str) -> Self {
        let (scale, offset) = ([1.0; 2], [0.0; 2]);
        Self { mapping, axis: None, scale, offset, clamp: false, nearest: false }
    }
}

/// Object with its texture and bump map, for the direct evaluation.
#[derive(Clone, Debug)]
pub struct TexturedObject<'a> {
    pub solid: Solid,
    pub scene_from_object: DAffine3,
    pub lay: Lay,
    /// Colours of the texture; `None` for white.
    pub colors: Option<Colors<'a>>,
    /// Bump map: image of heights, and the height of white above black.
    pub bump: Option<(&'a RgbImage, f64)>,
}

#[derive(Clone, Debug)]
pub enum Colors<'a> {
    Image(&'a RgbImage),
    Checker([DVec3; 2]),
}

impl Solid {
    /// Returns the two opposite corners of the object's bounding box.
    fn corners(&self) -> [DVec3; 2] {
        match *self {
            Self::Sphere(c, r) => [c - r, c + r],
            Self::Block(c, size) => [c - 0.5 * size, c + 0.5 * size],
            Self::Pillar(b, h, r) => [b - DVec3::new(r, 0.0, r), b + DVec3::new(r, h, r)],
            Self::Sheet(c, w, h) => {
                let half = 0.5 * DVec3::new(w, h, 0.0);
                [c - half, c + half]
            }
            Self::Floor(p) => [p; 2],
        }
    }

    /// Returns the distance of the first intersection in front of `o`, and the outward normal
    /// there.
    fn intersect(&self, o: DVec3, d: DVec3) -> Option<(f64, DVec3)> {
        let mut hits: Vec<(f64, DVec3)> = Vec::new();
        match *self {
            Self::Sphere(c, r) => {
                let f = o - c;
                let (a, b) = (d.dot(d), f.dot(d));
                let root = b * b - a * (f.dot(f) - r * r);
                for sign in [-1.0, 1.0] {
                    let t = (-b + sign * root.sqrt()) / a;
                    hits.push((t, (f + d * t) / r));
                }
            }
            Self::Block(c, size) => {
                for axis in 0..3 {
                    for side in [-1.0, 1.0] {
                        let mut n = DVec3::ZERO;
                        n[axis] = side;
                        let t = (c[axis] + 0.5 * side * size[axis] - o[axis]) / d[axis];
                        let p = (o + d * t - c).abs() - 0.5 * size;
                        let others = [(axis + 1) % 3, (axis + 2) % 3];
                        if others.iter().all(|k| p[*k] <= 0.0) {
                            hits.push((t, n));
                        }
                    }
                }
            }
            Self::Pillar(b, h, r) => {
                let f = o - b;
                let (a, m) = (d.x * d.x + d.z * d.z, f.x * d.x + f.z * d.z);
                let root = m * m - a * (f.x * f.x + f.z * f.z - r * r);
                for sign in [-1.0, 1.0] {
                    let t = (-m + sign * root.sqrt()) / a;
                    let p = f + d * t;
                    if (0.0..=h).contains(&p.y) {
                        hits.push((t, DVec3::new(p.x, 0.0, p.z) / r));
                    }
                }
                for (y, n) in [(0.0, DVec3::NEG_Y), (h, DVec3::Y)] {
                    let t = (y - f.y) / d.y;
                    let p = f + d * t;
                    if p.x * p.x + p.z * p.z <= r * r {
                        hits.push((t, n));
                    }
                }
            }
            Self::Sheet(c, w, h) => {
                let t = (c.z - o.z) / d.z;
                let p = o + d * t - c;
                if p.x.abs() <= 0.5 * w && p.y.abs() <= 0.5 * h {
                    hits.push((t, DVec3::Z));
                }
            }
            Self::Floor(p) => hits.push(((p.y - o.y) / d.y, DVec3::Y)),
        }
        // t is NaN without an intersection.
        hits.retain(|(t, _)| *t > 0.0);
        hits.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// Returns the texture coordinates of a point before scale and offset are applied.
fn mapped(solid: &Solid, lay: &Lay, p: DVec3, n: DVec3) -> DVec2 {
    let [low, high] = solid.corners();
    let middle = 0.5 * (low + high);
    let around = |x: f64, z: f64| 0.5 + x.atan2(z) / TAU;
    let q = p - middle;
    // Coordinates along the permuted axes: to the right, along the axis of the mapping, and to the
    // front.
    let (right, up, front) = match lay.axis {
        Some('x') => (q.z, q.x, q.y),
        Some('z') => (q.y, q.z, q.x),
        _ => (q.x, q.y, q.z),
    };
    match (lay.mapping, solid) {
        ("planar", Solid::Floor(at)) => DVec2::new(p.x - at.x, at.z - p.z),
        ("planar", _) => match lay.axis {
            Some('x') => DVec2::new(high.z - p.z, p.y - low.y),
            Some('y') => DVec2::new(p.x - low.x, high.z - p.z),
            _ => DVec2::new(p.x - low.x, p.y - low.y),
        },
        ("uv", _) => DVec2::new((p.x - low.x) / (high.x - low.x), (p.y - low.y) / (high.y - low.y)),
        ("spherical", _) => {
            let r = q.length();
            DVec2::new(around(right, front), 0.5 + (up / r).asin() / PI)
        }
        ("cylindrical", _) => {
            let size = high - low;
            let height = match lay.axis {
                Some('x') => size.x,
                Some('z') => size.z,
                _ => size.y,
            };
            let inside = 1.0 / 16384.0;
            DVec2::new(around(right, front), (up / height + 0.5).clamp(inside, 1.0 - inside))
        }
        ("box", _) => {
            let a = n.abs();
            if a.z >= a.x && a.z >= a.y {
                let u = if n.z > 0.0 { p.x - low.x } else { high.x - p.x };
                DVec2::new(u, p.y - low.y)
            } else if a.y >= a.x {
                let v = if n.y > 0.0 { high.z - p.z } else { p.z - low.z };
                DVec2::new(p.x - low.x, v)
            } else {
                let u = if n.x > 0.0 { high.z - p.z } else { p.z - low.z };
                DVec2::new(u, p.y - low.y)
            }
        }
        other => panic!("{other:?}"),
    }
}

fn coordinates(object: &TexturedObject, p: DVec3, n: DVec3) -> DVec2 {
    let lay = &object.lay;
    mapped(&object.solid, lay, p, n) * DVec2::from(lay.scale) + DVec2::from(lay.offset)
}

/// Returns the pixel in column `i` and row `j`, counted from below. Both may be outside of the
/// image.
fn pixel(image: &RgbImage, clamp: bool, i: f64, j: f64) -> DVec3 {
    let (w, h) = (f64::from(image.width), f64::from(image.height));
    let wrap = |i: f64, n: f64| if clamp { i.clamp(0.0, n - 1.0) } else { i - n * (i / n).floor() };
    let (i, j) = (wrap(i, w), wrap(j, h));
    let codes = image.pixel(i as u32, (h - 1.0 - j) as u32);
    DVec3::from(codes.map(|c| f64::from(c) / 255.0))
}

/// Returns the bilinear interpolation of `value` between the four pixels nearest to `uv`.
fn bilinear(image: &RgbImage, clamp: bool, uv: DVec2, value: impl Fn(DVec3) -> DVec3) -> DVec3 {
    let (x, y) = (uv.x * f64::from(image.width) - 0.5, uv.y * f64::from(image.height) - 0.5);
    let (i, j) = (x.floor(), y.floor());
    let mut sum = DVec3::ZERO;
    for (di, wi) in [(0.0, 1.0 - (x - i)), (1.0, x - i)] {
        for (dj, wj) in [(0.0, 1.0 - (y - j)), (1.0, y - j)] {
            sum += value(pixel(image, clamp, i + di, j + dj)) * (wi * wj);
        }
    }
    sum
}

fn linear(levels: DVec3) -> DVec3 {
    let one = |c: f64| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
    levels.map(one)
}

fn color(object: &TexturedObject, uv: DVec2) -> DVec3 {
    let lay = &object.lay;
    match &object.colors {
        None => DVec3::ONE,
        Some(Colors::Checker(colors)) => {
            let square = (2.0 * uv.x).floor() + (2.0 * uv.y).floor();
            colors[square.rem_euclid(2.0) as usize]
        }
        Some(Colors::Image(image)) if lay.nearest => {
            let (w, h) = (f64::from(image.width), f64::from(image.height));
            linear(pixel(image, lay.clamp, (uv.x * w).floor(), (uv.y * h).floor()))
        }
        Some(Colors::Image(image)) => bilinear(image, lay.clamp, uv, linear),
    }
}

/// Returns the normal in object space, perturbed by the bump map. It is computed by finite
/// differences. The texture coordinates are differentiated along two directions on the surface, and
/// the heights over one pixel to both sides.
fn bumped(object: &TexturedObject, p: DVec3, n: DVec3) -> DVec3 {
    let Some((image, height)) = object.bump else { return n };
    let uv = coordinates(object, p, n);
    let at = |uv: DVec2| {
        let grey = |c: DVec3| DVec3::splat(c.element_sum() / 3.0);
        height * bilinear(image, object.lay.clamp, uv, grey).x
    };
    let (du, dv) = (1.0 / f64::from(image.width), 1.0 / f64::from(image.height));
    let (across, along) = (DVec2::new(du, 0.0), DVec2::new(0.0, dv));
    let slope = DVec2::new(
        (at(uv + across) - at(uv - across)) / (2.0 * du),
        (at(uv + along) - at(uv - along)) / (2.0 * dv),
    );
    let (s, t) = n.any_orthonormal_pair();
    let mut out = n;
    for way in [s, t] {
        let h = 1e-6;
        let grown = coordinates(object, p + way * h, n) - coordinates(object, p - way * h, n);
        // At a seam the angular coordinate jumps by one turn, which is removed here.
        let turn = object.lay.scale[0];
        let grown = grown - DVec2::new(turn * (grown.x / turn).round(), 0.0);
        out -= way * slope.dot(grown / (2.0 * h));
    }
    out.normalize()
}

/// Returns the picture from `eye` towards `target` with a vertical view angle of 40 degrees, row by
/// row. A pixel is NaN if it is seen at such a grazing angle that the program bends the normal back
/// to the viewer.
pub fn picture(object: &TexturedObject, eye: DVec3, target: DVec3) -> Vec<DVec3> {
    let view = (target - eye).normalize();
    let right = view.cross(DVec3::Y).normalize();
    let up = right.cross(view);
    let half = 20f64.to_radians().tan();
    let light = TO_LIGHT.normalize();
    let inverse = object.scene_from_object.inverse();
    let normals = inverse.matrix3.transpose();
    let mut out = Vec::new();
    for row in 0..SIZE[1] {
        for column in 0..SIZE[0] {
            let [w, h] = SIZE.map(f64::from);
            let x = (2.0 * (f64::from(column) + 0.5) - w) / h * half;
            let y = (h - 2.0 * (f64::from(row) + 0.5)) / h * half;
            let d = (view + right * x + up * y).normalize();
            let (o, inner) = (inverse.transform_point3(eye), inverse.transform_vector3(d));
            let Some((t, n)) = object.solid.intersect(o, inner) else {
                out.push(DVec3::ZERO);
                continue;
            };
            let p = o + inner * t;
            let geometric = (normals * n).normalize();
            let shading = (normals * bumped(object, p, n)).normalize();
            // Both normals are reversed on the back.
            let side = -geometric.dot(d).signum();
            let (geometric, shading) = (geometric * side, shading * side);
            if shading.dot(-d) < 0.03 {
                out.push(DVec3::NAN);
                continue;
            }
            let lit = geometric.dot(light) > 0.0;
            let cos = if lit { shading.dot(light).max(0.0) } else { 0.0 };
            out.push(color(object, coordinates(object, p, n)) * cos);
        }
    }
    out
}
