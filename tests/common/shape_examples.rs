//! Example of each kind of shape. The unit tests of shape descriptions also include this file.

/// Pairs `(key, example)`: the key of every kind of shape, and an example in TOML for an
/// `[[object]]`. The order is that of the table of shape kinds.
pub const EXAMPLES: &[(&str, &str)] = &[
    ("sphere", "shape.sphere = { center = [0.0, 1.0, 0.0], radius = 1.0 }"),
    ("cube", "shape.cube = { corner = [-0.5, 0.0, 0.5], edge = 1.0, rotation = 30.0 }"),
    ("box", "shape.box = { center = [0.0, 0.5, 0.0], size = [2.0, 1.0, 0.5] }"),
    (
        "pyramid",
        "shape.pyramid = { corner = [-0.5, 0.0, 0.5], side = 1.0, \
         apex_height = 1.5, height = 0.8 }",
    ),
    ("prism", "shape.prism = { corner = [-0.5, 0.0, 0.3], side = 1.0, height = 1.2 }"),
    (
        "cylinder",
        "shape.cylinder = { base = [0.0, 0.0, 0.0], top = [0.0, 1.0, 0.0], radius = 0.4 }",
    ),
    ("cone", "shape.cone = { base = [0.0, 0.0, 0.0], apex = [0.0, 1.0, 0.0], radius = 0.5 }"),
    (
        "tapered_cylinder",
        "shape.tapered_cylinder = { base = [0.0, 0.0, 0.0], top = [0.0, 1.0, 0.0], \
         base_radius = 0.5, top_radius = 0.3 }",
    ),
    ("unit_frustum", "shape.unit_frustum = { s = 0.5 }"),
    (
        "torus",
        "shape.torus = { center = [0.0, 0.25, 0.0], axis = [0.0, 1.0, 0.0], ring = 1.0, tube = 0.25 }",
    ),
    ("platform", "shape.platform = { center = [0.0, 0.0, 0.0], size = [8.0, 8.0] }"),
    (
        "rectangle",
        "shape.rectangle = { center = [0.0, 1.5, -2.0], size = [4.0, 3.0], \
         normal = [0.0, 0.0, 1.0] }",
    ),
    ("plane", "shape.plane = { point = [0.0, 0.0, 0.0], normal = [0.0, 1.0, 0.0] }"),
    ("mesh", "shape.mesh = { file = \"scenes/meshes/knot.ply\", normals = \"smooth\" }"),
    (
        "union",
        "shape.union.of = [
    { shape.sphere = { center = [0.0, 0.4, 0.0], radius = 0.4 } },
    { shape.cylinder = { base = [0.0, 0.4, 0.0], top = [0.0, 1.2, 0.0], radius = 0.2 } },
]",
    ),
    (
        "intersection",
        "shape.intersection.of = [
    { shape.cube = { corner = [-0.5, 0.0, 0.5], edge = 1.0 } },
    { shape.sphere = { center = [0.0, 0.5, 0.0], radius = 0.65 } },
]",
    ),
    (
        "difference",
        "shape.difference.of = [
    { shape.box = { center = [0.0, 0.5, 0.0], size = [1.0, 1.0, 1.0] } },
    { shape.sphere = { center = [0.5, 1.0, 0.5], radius = 0.6 } },
]",
    ),
];
