//! Tests of meshes from files, compared with a direct intersection of all triangles.

use crate::features::analytic_shapes::{AnalyticShape, placement, triangles};
use crate::features::first_hits::hits_agree_with;
use crate::features::row::{object, row, shape};
use crate::harness::*;

/// Returns the triangles of a polygon: a fan around its first corner.
fn fan(corners: &[DVec3]) -> impl Iterator<Item = [DVec3; 3]> {
    corners[1..].windows(2).map(|pair| [corners[0], pair[0], pair[1]])
}

fn obj_triangles(text: &str) -> Vec<[DVec3; 3]> {
    let statements = |key: &str| {
        let lines = text.lines().filter_map(|line| line.split_once(' '));
        let matching = lines.filter(|(k, _)| *k == key);
        matching.map(|(_, arguments)| arguments.to_string()).collect::<Vec<_>>()
    };
    let number = |word: &str| word.parse::<f64>().unwrap();
    let point = |line: &String| {
        let x: Vec<f64> = line.split_whitespace().map(number).collect();
        DVec3::new(x[0], x[1], x[2])
    };
    let points: Vec<DVec3> = statements("v").iter().map(point).collect();
    let corner = |word: &str| points[word.split('/').next().unwrap().parse::<usize>().unwrap() - 1];
    let faces = statements("f");
    faces
        .iter()
        .flat_map(|f| {
            fan(&f.split_whitespace().map(corner).collect::<Vec<_>>()).collect::<Vec<_>>()
        })
        .collect()
}

/// Returns the triangles of a binary PLY file whose vertices are three `float` and whose faces are
/// lists of `int` after a `uchar` count.
fn ply_triangles(bytes: &[u8]) -> Vec<[DVec3; 3]> {
    let end = b"end_header\n";
    let data = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let header = std::str::from_utf8(&bytes[..data]).unwrap();
    let count = |element: &str| {
        let line = header.lines().find_map(|l| l.strip_prefix(&format!("element {element} ")));
        line.unwrap().parse::<usize>().unwrap()
    };
    let (vertices, mut faces) = bytes[data..].split_at(12 * count("vertex"));
    let float = |b: &[u8]| f64::from(f32::from_le_bytes(b.try_into().unwrap()));
    let points: Vec<DVec3> = vertices
        .chunks(12)
        .map(|v| DVec3::new(float(&v[..4]), float(&v[4..8]), float(&v[8..])))
        .collect();
    let mut all = Vec::new();
    for _ in 0..count("face") {
        let (list, following) = faces[1..].split_at(4 * faces[0] as usize);
        let corner = |b: &[u8]| points[u32::from_le_bytes(b.try_into().unwrap()) as usize];
        all.extend(fan(&list.chunks(4).map(corner).collect::<Vec<_>>()));
        faces = following;
    }
    all
}

#[test]
fn b8_mesh_objects() {
    let file = |name: &str| {
        let path = format!("{}/scenes/meshes/{name}", env!("ZERKALO_ROOT"));
        fs::read(&path).unwrap_or_else(|e| panic!("{path}: {e}"))
    };
    let knot = ply_triangles(&file("knot.ply"));
    let stone = obj_triangles(std::str::from_utf8(&file("stone.obj")).unwrap());
    assert_eq!((knot.len(), stone.len() > 20), (2 * 5760, true));
    // The knot and the stone on their ground, without the other objects.
    let meshes_only = |scene: &Scene| {
        let mut scene = scene.clone();
        scene.objects.retain(|o| ["ground", "knot", "stone"].contains(&o.name.as_str()));
        scene
    };
    let original = meshes_only(&shipped("shape-mesh.toml"));
    let shapes: Vec<AnalyticShape> = original
        .objects
        .iter()
        .map(|o| match o.name.as_str() {
            "knot" => AnalyticShape::Thin(triangles(knot.clone(), placement(&o.transform))),
            "stone" => AnalyticShape::Thin(triangles(stone.clone(), placement(&o.transform))),
            _ => AnalyticShape::new(o),
        })
        .collect();
    let stand_in = parsed("[[object]]\nshape.mesh = {}").objects.remove(0).shape;
    row(
        "shape-mesh.toml",
        |tested| hits_agree_with(&original, &shapes, &meshes_only(tested)),
        &[
            ("a ball of its size", &|s| {
                object(s, "stone").shape = shape("sphere = { center = [0, 0, 0], radius = 1.0 }");
            }),
            ("the placeholder of a missing file", &|s| object(s, "stone").shape = stand_in.clone()),
            ("the other file", &|s| {
                object(s, "stone").shape = object(s, "knot").shape.clone();
            }),
            ("another place", &|s| object(s, "knot").transform.truncate(2)),
        ],
    );
}
