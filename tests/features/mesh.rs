//! Tests of meshes from files.

use crate::features::row::*;
use crate::harness::*;
use crate::reference::*;

/// Checks that a mesh has `count` triangles and is closed: the opposite of every edge of a triangle
/// is an edge of another triangle.
fn is_closed(file: &str, count: usize) -> Verdict {
    let path = Path::new(env!("ZERKALO_ROOT")).join("scenes/meshes").join(file);
    let mesh = Assets::default().mesh(&path).map_err(|error| error.to_string())?;
    let triangles = &mesh.mesh.triangles;
    ensure(triangles.len() == count, || format!("{} triangles in {file}", triangles.len()))?;
    let corner = |i: u32| mesh.mesh.positions[i as usize].map(f32::to_bits);
    let edges = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|e| e.map(corner));
    let all: HashSet<_> = triangles.iter().flat_map(edges).collect();
    ensure(all.len() == 3 * count, || format!("an edge occurs twice in {file}"))?;
    ensure(all.iter().all(|[a, b]| all.contains(&[*b, *a])), || format!("{file} has holes"))
}

#[test]
fn b8_mesh_objects() {
    // A knot of 240 x 24 quadrilaterals; a stone whose table has twelve corners, with twelve facets
    // of two triangles and twelve of one.
    is_closed("knot.ply", 2 * 240 * 24).unwrap();
    is_closed("stone.obj", 10 + 24 + 12).unwrap();
    // The knot and the stone on their ground, without the other objects.
    let meshes_only = |scene: &Scene| {
        let mut scene = scene.clone();
        scene.objects.retain(|o| ["ground", "knot", "stone"].contains(&o.name.as_str()));
        scene
    };
    let original = meshes_only(&shipped("shape-mesh.toml"));
    let stand_in = parsed("[[object]]\nshape.mesh = {}").objects.remove(0).shape;
    row(
        "shape-mesh.toml",
        |tested| hits_agree(&original, &meshes_only(tested)),
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
