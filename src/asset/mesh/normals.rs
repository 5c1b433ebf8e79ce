//! Normals of vertices from the triangles around them.

use crate::asset::mesh::builder::{cross, minus};
use std::collections::HashMap;

/// For each vertex the mean of the normals of the triangles that meet there, weighted by the angle
/// of each at the vertex (Thürmer and Wüthrich 1998, *Computing Vertex Normals from Polygonal
/// Facets*). Vertices at the same place count as one, so that a seam of texture coordinates does not
/// show. A unit vector each; where there are no triangles, or they cancel, an arbitrary one.
pub fn smooth(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let mut first: HashMap<[u32; 3], u32> = HashMap::with_capacity(positions.len());
    let place: Vec<u32> = positions
        .iter()
        .zip(0u32..)
        .map(|(p, i)| {
            let key = p.map(|x| if x == 0.0 { 0 } else { x.to_bits() });
            *first.entry(key).or_insert(i)
        })
        .collect();
    let mut sums = vec![[0.0f64; 3]; positions.len()];
    for t in triangles {
        let p = t.map(|i| positions[i as usize].map(f64::from));
        let normal = unit(cross(minus(p[1], p[0]), minus(p[2], p[0])));
        for k in 0..3 {
            let a = minus(p[(k + 1) % 3], p[k]);
            let b = minus(p[(k + 2) % 3], p[k]);
            let c = cross(a, b);
            let angle = dot(c, c).sqrt().atan2(dot(a, b));
            let sum = &mut sums[place[t[k] as usize] as usize];
            *sum = std::array::from_fn(|i| sum[i] + angle * normal[i]);
        }
    }
    place.iter().map(|i| unit(sums[*i as usize]).map(|x| x as f32)).collect()
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `v` with length 1; along z if it has no direction.
fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = dot(v, v).sqrt();
    if length > 0.0 { v.map(|x| x / length) } else { [0.0, 0.0, 1.0] }
}
