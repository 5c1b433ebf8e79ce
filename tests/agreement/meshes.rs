//! Meshes in the plainest way: every triangle is asked, one after the other.

use glam::{DVec2, DVec3};
use std::collections::HashMap;
use zerkalo::primitive::{Form, MeshForm};
use zerkalo::shape::{MeshDesc, ShapeDesc};

/// The least cosine between the normal that light sees and the direction to the viewer.
const LEAST_COSINE: f64 = 0.02;

/// Triangles in the space of their file.
pub struct Triangles {
    corners: Vec<[DVec3; 3]>,
    /// Those of the corners; empty: light sees the triangles' own.
    normals: Vec<[DVec3; 3]>,
    /// Empty: the file names none.
    colors: Vec<DVec3>,
    /// Texture coordinates of the corners; empty: the file names none.
    uvs: Vec<[DVec2; 3]>,
    low: DVec3,
    high: DVec3,
}

/// The sum over the triangles that meet at a place of their unit normals, each times its angle there,
/// made a unit vector.
fn around(corners: &[[DVec3; 3]]) -> Vec<[DVec3; 3]> {
    let key = |p: DVec3| p.to_array().map(|x| (x + 0.0).to_bits());
    let mut sums: HashMap<[u64; 3], DVec3> = HashMap::new();
    for triangle in corners {
        for i in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|k| triangle[(i + k) % 3]);
            let normal = (b - a).cross(c - a).normalize();
            *sums.entry(key(a)).or_default() += normal * (b - a).angle_between(c - a);
        }
    }
    corners.iter().map(|triangle| triangle.map(|p| sums[&key(p)].normalize())).collect()
}

impl Triangles {
    /// What is in the file.
    pub fn new(file: &MeshDesc) -> Self {
        let Form::Mesh(MeshForm { mesh, scene_from_mesh, smooth }) = file.form() else {
            unreachable!("a mesh is a mesh")
        };
        let mesh = mesh.mesh();
        let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        let place = |i: u32| scene_from_mesh.transform_point3(vector(mesh.positions[i as usize]));
        let corners: Vec<_> = mesh.triangles.iter().map(|t| t.map(place)).collect();
        let normals = match &mesh.normals {
            _ if !smooth => Vec::new(),
            Some(given) => {
                mesh.triangles.iter().map(|t| t.map(|i| vector(given[i as usize]))).collect()
            }
            None => around(&corners),
        };
        let pair = |i: u32, given: &[[f32; 2]]| DVec2::from(given[i as usize].map(f64::from));
        let uvs = mesh
            .uvs
            .iter()
            .flat_map(|given| mesh.triangles.iter().map(|t| t.map(|i| pair(i, given))));
        let all = || corners.iter().flatten().copied();
        Self {
            low: all().fold(DVec3::INFINITY, DVec3::min),
            high: all().fold(DVec3::NEG_INFINITY, DVec3::max),
            colors: (0..corners.len()).filter_map(|i| mesh.color(i)).map(vector).collect(),
            uvs: uvs.collect(),
            normals,
            corners,
        }
    }

    /// Every triangle that the line meets: where, its normal, and which it is.
    pub fn meet(&self, origin: DVec3, direction: DVec3) -> Vec<(f64, DVec3, usize)> {
        let (a, b) = ((self.low - origin) / direction, (self.high - origin) / direction);
        // NaN where a line runs in a side of the box: it does not count.
        if a.min(b).max_element() > a.max(b).min_element() {
            return Vec::new();
        }
        let each = self.corners.iter().enumerate().filter_map(|(i, [p, q, r])| {
            let (u, v) = (q - p, r - p);
            let across = direction.cross(v);
            let volume = across.dot(u);
            let f = across.dot(origin - p) / volume;
            let aside = (origin - p).cross(u);
            let g = aside.dot(direction) / volume;
            let inside = f >= 0.0 && g >= 0.0 && f + g <= 1.0;
            inside.then(|| (aside.dot(v) / volume, u.cross(v).normalize(), i))
        });
        each.collect()
    }

    /// The mean of the corners' normals at a point of triangle `i`; `None`: light sees the triangle's own.
    pub fn smooth(&self, i: usize, point: DVec3) -> Option<DVec3> {
        let normals = self.normals.get(i)?;
        let shares = self.shares(i, point);
        Some((0..3).map(|k| normals[k] * shares[k]).sum())
    }

    /// What each corner of triangle `i` counts at a point of its plane; together 1.
    fn shares(&self, i: usize, point: DVec3) -> [f64; 3] {
        let [a, b, c] = self.corners[i];
        let normal = (b - a).cross(c - a);
        let area = |a: DVec3, b: DVec3| (a - point).cross(b - point).dot(normal);
        [(b, c), (c, a), (a, b)].map(|(a, b)| area(a, b) / normal.length_squared())
    }

    /// Whether the file has texture coordinates.
    pub fn has_uv(&self) -> bool {
        !self.uvs.is_empty()
    }

    /// Those at a point of the plane of triangle `i`; `None`: the file has none.
    pub fn uv(&self, i: usize, point: DVec3) -> Option<DVec2> {
        let uvs = self.uvs.get(i)?;
        let shares = self.shares(i, point);
        Some((0..3).map(|k| uvs[k] * shares[k]).sum())
    }

    /// All corners of all triangles.
    pub fn points(&self) -> impl Iterator<Item = DVec3> {
        self.corners.iter().flatten().copied()
    }

    /// The file's colour of triangle `i`.
    pub fn color(&self, i: usize) -> DVec3 {
        self.colors.get(i).copied().unwrap_or(DVec3::ONE)
    }
}

/// The normal that light sees: `smooth` on the side of the triangle's own, and nowhere turned away from
/// the viewer, who looks along `direction`.
pub fn seen(smooth: DVec3, own: DVec3, direction: DVec3) -> DVec3 {
    let smooth = smooth.normalize() * smooth.dot(own).signum();
    let short = (LEAST_COSINE + smooth.dot(direction)).max(0.0);
    let bent = (smooth - direction * short).normalize();
    if bent.dot(own) > 0.0 { bent } else { own }
}
