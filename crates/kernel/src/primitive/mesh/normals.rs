//! Vertex normals computed from the adjacent triangles.

use glam::DVec3;
use std::collections::HashMap;

/// Normals at the corners of triangles.
pub struct CornerNormals {
    /// Distinct unit normals.
    pub normals: Vec<[f32; 3]>,
    /// Indices in `normals` for the corners of each triangle.
    pub corners: Vec<[u32; 3]>,
    /// Tangent depth of the mesh with these normals.
    pub depth: f64,
}

/// Number of triangles with which each triangle at a side is compared. A side of a surface has two
/// triangles; more of them meet where surfaces touch.
const NEIGHBORS: usize = 3;

/// Returns the mean normals of the adjacent triangles at each vertex, weighted by their angles there
/// (Thürmer and Wüthrich 1998, *Computing Vertex Normals from Polygonal Facets*). Creases are sides
/// at which the normals of two triangles differ by more than `degrees`. They divide the triangles
/// around a vertex; each part has its own mean normal, or the z axis if its normals cancel.
///
/// Vertices with equal positions count as one, so that shading is smooth where a mesh is cut only
/// for its texture coordinates.
pub(super) fn creased(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    degrees: f64,
) -> CornerNormals {
    // The tolerance is the rounding error of normals in single precision. At 180 degrees there is no
    // crease.
    let least = degrees.to_radians().cos() - 1e-6;
    let welded = welded(positions);
    let vertex = |corner: u32| welded[triangles.as_flattened()[corner as usize] as usize];
    let next = |corner: u32| if corner % 3 == 2 { corner - 2 } else { corner + 1 };
    let corners = 0..3 * triangles.len() as u32;
    // Each side is named by its first corner, with its two vertices, the lower one first.
    let side = |corner| {
        let (a, b) = (vertex(corner), vertex(next(corner)));
        (a.min(b), a.max(b), corner)
    };
    let mut sides: Vec<_> = corners.clone().map(side).collect();
    sides.sort_unstable();
    let points = |triangle: usize| {
        triangles[triangle].map(|i| DVec3::from(positions[i as usize].map(f64::from)))
    };
    let normal = |corner: u32| normal(points(corner as usize / 3));
    // Forest of the corners that share a normal.
    let mut parent: Vec<u32> = corners.clone().collect();
    for (i, (low, high, first)) in sides.iter().enumerate() {
        let others = sides[i + 1..].iter().take(NEIGHBORS);
        for (.., second) in others.take_while(|(a, b, _)| (a, b) == (low, high)) {
            if normal(*first).dot(normal(*second)) < least {
                continue;
            }
            for end in [*low, *high] {
                let at_end =
                    |corner: u32| if vertex(corner) == end { corner } else { next(corner) };
                let [a, b] = [*first, *second].map(|side| root(&mut parent, at_end(side)));
                parent[a.max(b) as usize] = a.min(b);
            }
        }
    }
    let mut sums = vec![DVec3::ZERO; parent.len()];
    for corner in corners.clone() {
        let p = points(corner as usize / 3);
        let [at, next, last] = [0, 1, 2].map(|k| p[(corner as usize + k) % 3]);
        let (a, b) = (next - at, last - at);
        let angle = a.cross(b).length().atan2(a.dot(b));
        sums[root(&mut parent, corner) as usize] += angle * normal(corner);
    }
    // The root of a tree is its lowest corner, so that it gets its index first.
    let (mut normals, mut index) = (Vec::new(), vec![0u32; parent.len()]);
    for corner in corners {
        let root = root(&mut parent, corner) as usize;
        if root == corner as usize {
            index[root] = normals.len() as u32;
            normals.push(unit(sums[root]).to_array().map(|x| x as f32));
        }
        index[corner as usize] = index[root];
    }
    let depth = tangent_depth(positions, triangles, &normals, index.as_chunks().0);
    CornerNormals { normals, corners: index.as_chunks().0.to_vec(), depth }
}

/// Returns the largest distance between a corner of a triangle and the tangent plane at another
/// corner of it. `corners` has the indices in `normals` of each triangle.
pub fn tangent_depth(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    normals: &[[f32; 3]],
    corners: &[[u32; 3]],
) -> f64 {
    let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let mut largest = 0.0f64;
    for (triangle, corners) in triangles.iter().zip(corners) {
        let p = triangle.map(|i| vector(positions[i as usize]));
        for (corner, at) in corners.iter().zip(p) {
            let normal = unit(vector(normals[*corner as usize]));
            largest = p.into_iter().map(|p| normal.dot(p - at).abs()).fold(largest, f64::max);
        }
    }
    largest
}

/// Returns the root of the tree of `node`, and shortens the way to it.
fn root(parent: &mut [u32], mut node: u32) -> u32 {
    while parent[node as usize] != node {
        parent[node as usize] = parent[parent[node as usize] as usize];
        node = parent[node as usize];
    }
    node
}

/// Returns the first vertex at the position of each vertex.
fn welded(positions: &[[f32; 3]]) -> Vec<u32> {
    let mut first: HashMap<[u32; 3], u32> = HashMap::with_capacity(positions.len());
    let key = |p: &[f32; 3]| p.map(|x| if x == 0.0 { 0 } else { x.to_bits() });
    positions.iter().zip(0u32..).map(|(p, i)| *first.entry(key(p)).or_insert(i)).collect()
}

/// Returns the unit normal of a triangle.
fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    unit((b - a).cross(c - a))
}

/// Returns `v` scaled to length 1, or the z axis if the length of `v` is 0.
fn unit(v: DVec3) -> DVec3 {
    let length = v.length();
    if length > 0.0 { v / length } else { DVec3::Z }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Roof over the rectangle from (-1, 0) to (1, 2): two planes that rise towards x = 0 with the
    /// given slopes. Vertices at the ridge are doubled if `is_cut`.
    fn roof(slopes: [f32; 2], is_cut: bool) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let [left, right] = slopes;
        let mut positions = vec![
            [-1.0, 0.0, -left],
            [0.0, 0.0, 0.0],
            [0.0, 2.0, 0.0],
            [-1.0, 2.0, -left],
            [1.0, 0.0, -right],
            [1.0, 2.0, -right],
        ];
        let (a, b) = if is_cut { (6, 7) } else { (1, 2) };
        positions.extend([[0.0, -0.0, 0.0], [0.0, 2.0, 0.0]]);
        (positions, vec![[0, 1, 2], [0, 2, 3], [a, 4, 5], [a, 5, b]])
    }

    fn normals(slopes: [f32; 2], is_cut: bool, degrees: f64) -> [[f32; 3]; 2] {
        let (positions, triangles) = roof(slopes, is_cut);
        let found = creased(&positions, &triangles, degrees);
        [(0, 1), (2, 0)].map(|(t, k)| found.normals[found.corners[t][k] as usize])
    }

    #[test]
    fn creases_divide_normals_by_their_angle() {
        for is_cut in [false, true] {
            // The sides rise by 45 degrees: their normals differ by 90.
            let [left, right] = normals([1.0, 1.0], is_cut, 89.0);
            assert!(left[0] < -0.7 && right[0] > 0.7, "{left:?} {right:?}");
            for degrees in [90.0, 180.0] {
                let [left, right] = normals([1.0, 1.0], is_cut, degrees);
                assert_eq!(left, right);
                assert!(left[0].abs() < 0.4 && left[2] > 0.9, "{left:?}");
            }
        }
        let [left, right] = normals([0.5, -0.5], false, 0.0);
        assert_eq!(left, right, "a plane has no crease");
    }

    /// Checks that the time is linear.
    #[test]
    fn many_triangles_at_one_side_take_linear_time() {
        let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let found = creased(&positions, &vec![[0, 1, 2]; 100_000], 40.0);
        assert_eq!(found.normals, [[0.0, 0.0, 1.0]; 3]);
    }
}
