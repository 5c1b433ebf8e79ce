//! Meshes of the reference tracer. Boxes around consecutive triangles are their only acceleration
//! structure.

use crate::harness::*;
use zerkalo_scene::shape::MeshDesc;

/// Smallest cosine between the shading normal and the direction to the viewer. Normals at a smaller
/// cosine are bent towards the viewer.
const MIN_COSINE: f64 = 0.02;

/// Triangles of a mesh, in the coordinates of their file.
pub struct Triangles {
    corners: Vec<[DVec3; 3]>,
    /// Normals of the corners of each triangle; empty for flat shading.
    normals: Vec<[DVec3; 3]>,
    /// Colours of the triangles; empty if the file has none.
    colors: Vec<DVec3>,
    /// Texture coordinates of the corners of each triangle; empty if the file has none.
    uvs: Vec<[DVec2; 3]>,
    /// Lowest and highest corner of the box around each [`GROUP`] consecutive triangles.
    boxes: Vec<[DVec3; 2]>,
    /// Lowest and highest corner of the box around all triangles.
    bounds: [DVec3; 2],
}

/// Number of consecutive triangles in a box.
const GROUP: usize = 16;

/// Returns lowest and highest corner of the box around some triangles.
fn bounds(triangles: &[[DVec3; 3]]) -> [DVec3; 2] {
    let all = || triangles.iter().flatten().copied();
    [all().fold(DVec3::INFINITY, DVec3::min), all().fold(DVec3::NEG_INFINITY, DVec3::max)]
}

/// Returns `true` if a line misses a box.
fn misses([low, high]: &[DVec3; 2], origin: DVec3, direction: DVec3) -> bool {
    let (a, b) = ((low - origin) / direction, (high - origin) / direction);
    // If the line lies in the plane of a side of the box, a distance is NaN, which is ignored.
    a.min(b).max_element() > a.max(b).min_element()
}

/// Returns the normals at the corners of all triangles. Each is the normalised sum of the unit
/// normals of adjacent triangles, weighted by their angles at the corner. Only triangles
/// count that are reached around the corner by sides whose triangles differ by at most
/// `crease_angle` \[degrees\].
fn around(corners: &[[DVec3; 3]], crease_angle: f64) -> Vec<[DVec3; 3]> {
    let key = |p: DVec3| p.to_array().map(|x| (x + 0.0).to_bits());
    let normal =
        |t: usize| (corners[t][1] - corners[t][0]).cross(corners[t][2] - corners[t][0]).normalize();
    let mut at: HashMap<[u64; 3], Vec<usize>> = HashMap::new();
    for (t, triangle) in corners.iter().enumerate() {
        triangle.iter().for_each(|p| at.entry(key(*p)).or_default().push(t));
    }
    let angle = |t: usize, p: DVec3| {
        let i = corners[t].iter().position(|q| key(*q) == key(p)).unwrap();
        let [a, b, c] = [0, 1, 2].map(|k| corners[t][(i + k) % 3]);
        (b - a).angle_between(c - a)
    };
    let shared = |a: usize, b: usize| {
        corners[a].iter().filter(|p| corners[b].iter().any(|q| key(**p) == key(*q))).count()
    };
    let of = |t: usize, p: DVec3| -> DVec3 {
        let all = &at[&key(p)];
        let mut reached = vec![t];
        for next in 0.. {
            let Some(from) = reached.get(next).copied() else { break };
            for u in all {
                let bend = normal(from).angle_between(normal(*u)).to_degrees();
                if !reached.contains(u) && shared(from, *u) == 2 && bend < crease_angle + 1e-4 {
                    reached.push(*u);
                }
            }
        }
        reached.iter().map(|u| normal(*u) * angle(*u, p)).sum()
    };
    (0..corners.len()).map(|t| corners[t].map(|p| of(t, p).normalize())).collect()
}

impl Triangles {
    pub fn new(file: &MeshDesc) -> Self {
        let Form::Mesh(MeshForm { mesh, scene_from_mesh, normals }) = file.form() else {
            unreachable!("a mesh description has a mesh form")
        };
        let mesh = &mesh.mesh;
        let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        let place = |i: u32| scene_from_mesh.transform_point3(vector(mesh.positions[i as usize]));
        let corners: Vec<_> = mesh.triangles.iter().map(|t| t.map(place)).collect();
        let normals = match (normals, &mesh.normals) {
            (MeshNormals::Flat, _) => Vec::new(),
            (MeshNormals::Creased(degrees), _) => around(&corners, degrees),
            (MeshNormals::OfVertices, Some(given)) => {
                mesh.triangles.iter().map(|t| t.map(|i| vector(given[i as usize]))).collect()
            }
            (MeshNormals::OfVertices, None) => unreachable!("the form has normals of its file"),
        };
        let pair = |i: u32, given: &[[f32; 2]]| DVec2::from(given[i as usize].map(f64::from));
        let uvs = mesh
            .uvs
            .iter()
            .flat_map(|given| mesh.triangles.iter().map(|t| t.map(|i| pair(i, given))));
        Self {
            boxes: corners.chunks(GROUP).map(bounds).collect(),
            bounds: bounds(&corners),
            colors: (0..corners.len()).filter_map(|i| mesh.color(i)).map(vector).collect(),
            uvs: uvs.collect(),
            normals,
            corners,
        }
    }

    /// Passes every crossing of a line with a triangle to `take`: distance, and index of the
    /// triangle.
    pub fn meet(&self, origin: DVec3, direction: DVec3, mut take: impl FnMut(f64, usize)) {
        if misses(&self.bounds, origin, direction) {
            return;
        }
        for (group, bounds) in self.boxes.iter().enumerate() {
            if misses(bounds, origin, direction) {
                continue;
            }
            let first = group * GROUP;
            let end = (first + GROUP).min(self.corners.len());
            for (i, [p, q, r]) in (first..end).zip(&self.corners[first..end]) {
                let (u, v) = (q - p, r - p);
                let across = direction.cross(v);
                let volume = across.dot(u);
                let f = across.dot(origin - p) / volume;
                let aside = (origin - p).cross(u);
                let g = aside.dot(direction) / volume;
                if f >= 0.0 && g >= 0.0 && f + g <= 1.0 {
                    take(aside.dot(v) / volume, i);
                }
            }
        }
    }

    pub fn normal(&self, i: usize) -> DVec3 {
        let [p, q, r] = self.corners[i];
        (q - p).cross(r - p).normalize()
    }

    /// Returns the interpolated normal at a point of triangle `i`. Returns `None` for flat shading.
    pub fn smooth(&self, i: usize, point: DVec3) -> Option<DVec3> {
        let normals = self.normals.get(i)?;
        let shares = self.shares(i, point);
        Some((0..3).map(|k| normals[k] * shares[k]).sum())
    }

    /// Returns the three corners of triangle `i`: for each, the barycentric coordinate of a point,
    /// the position, and the normal. Returns `None` for flat shading.
    pub fn ends(&self, i: usize, point: DVec3) -> Option<[(f64, DVec3, DVec3); 3]> {
        let (normals, shares) = (self.normals.get(i)?, self.shares(i, point));
        Some([0, 1, 2].map(|k| (shares[k], self.corners[i][k], normals[k])))
    }

    /// Returns the barycentric coordinates of a point in the plane of triangle `i`.
    fn shares(&self, i: usize, point: DVec3) -> [f64; 3] {
        let [a, b, c] = self.corners[i];
        let normal = (b - a).cross(c - a);
        let area = |a: DVec3, b: DVec3| (a - point).cross(b - point).dot(normal);
        [(b, c), (c, a), (a, b)].map(|(a, b)| area(a, b) / normal.length_squared())
    }

    /// Iterates over the triangles: the three corners of each.
    pub fn corners(&self) -> impl Iterator<Item = [DVec3; 3]> {
        self.corners.iter().copied()
    }

    /// Returns `true` if the file has texture coordinates.
    pub fn has_uv(&self) -> bool {
        !self.uvs.is_empty()
    }

    /// Returns the texture coordinates at a point in the plane of triangle `i`. Returns `None` if
    /// the file has none.
    pub fn uv(&self, i: usize, point: DVec3) -> Option<DVec2> {
        let uvs = self.uvs.get(i)?;
        let shares = self.shares(i, point);
        Some((0..3).map(|k| uvs[k] * shares[k]).sum())
    }

    /// Iterates over the corners of all triangles, one by one.
    pub fn points(&self) -> impl Iterator<Item = DVec3> {
        self.corners.iter().flatten().copied()
    }

    /// Returns the colour that the mesh file gives triangle `i`; white without colours in the file.
    pub fn color(&self, i: usize) -> DVec3 {
        self.colors.get(i).copied().unwrap_or(DVec3::ONE)
    }
}

/// Returns the shading normal: `smooth`, turned to the side of the geometric normal `own`, and bent
/// towards a viewer who looks along `direction`.
pub fn seen(smooth: DVec3, own: DVec3, direction: DVec3) -> DVec3 {
    let smooth = smooth.normalize() * smooth.dot(own).signum();
    let short = (MIN_COSINE + smooth.dot(direction)).max(0.0);
    let bent = (smooth - direction * short).normalize();
    if bent.dot(own) > 0.0 { bent } else { own }
}
