//! Vertex normals computed from the adjacent triangles.

use glam::DVec3;
use std::collections::HashMap;

/// Returns the mean normal of the adjacent triangles for each vertex, weighted by their angles at
/// the vertex (Thürmer and Wüthrich 1998, *Computing Vertex Normals from Polygonal Facets*).
///
/// Vertices with equal positions count as one, so that shading is smooth where a mesh is cut only
/// for its texture coordinates. A vertex has the z axis as its normal if it has no adjacent
/// triangles, or if their normals cancel.
pub fn smooth(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let mut first: HashMap<[u32; 3], u32> = HashMap::with_capacity(positions.len());
    let welded: Vec<u32> = positions
        .iter()
        .zip(0u32..)
        .map(|(p, i)| {
            let key = p.map(|x| if x == 0.0 { 0 } else { x.to_bits() });
            *first.entry(key).or_insert(i)
        })
        .collect();
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for t in triangles {
        let p = t.map(|i| DVec3::from(positions[i as usize].map(f64::from)));
        let normal = unit((p[1] - p[0]).cross(p[2] - p[0]));
        for k in 0..3 {
            let a = p[(k + 1) % 3] - p[k];
            let b = p[(k + 2) % 3] - p[k];
            let angle = a.cross(b).length().atan2(a.dot(b));
            sums[welded[t[k] as usize] as usize] += angle * normal;
        }
    }
    welded.iter().map(|i| unit(sums[*i as usize]).to_array().map(|x| x as f32)).collect()
}

/// Returns `v` scaled to length 1, or the z axis if the length of `v` is 0.
fn unit(v: DVec3) -> DVec3 {
    let length = v.length();
    if length > 0.0 { v / length } else { DVec3::Z }
}
