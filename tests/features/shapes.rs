//! Tests of shapes, transforms and compounds, compared with the formulas of the shapes.

use crate::features::row::*;
use crate::harness::*;
use crate::reference::*;
use zerkalo_scene::shape::{Difference, Intersection, Union};

/// Checks that first hits in `file` agree with the formulas of the shapes, and that they disagree
/// after each mutation. A mutation consists of its name, the name of an object, and the text of the
/// object's new shape.
fn shapes(file: &str, mutations: &[(&str, &str, &str)]) {
    let original = shipped(file);
    let changes: Vec<_> = mutations
        .iter()
        .map(|(name, target, text)| {
            let change = move |scene: &mut Scene| object(scene, target).shape = shape(text);
            (*name, change)
        })
        .collect();
    let changes: Vec<_> = changes.iter().map(|(name, change)| (*name, change as Change)).collect();
    row(file, |tested| hits_agree(&original, tested), &changes);
}

#[test]
fn a1_sphere() {
    shapes(
        "shape-sphere.toml",
        &[
            ("a plane", "large", "plane = { point = [-0.2, 1.0, -0.2], normal = [0.0, 0.0, 1.0] }"),
            ("a cube", "large", "box = { center = [-0.2, 1.0, -0.2], size = [2.0, 2.0, 2.0] }"),
            ("another radius", "large", "sphere = { center = [-0.2, 1.0, -0.2], radius = 1.005 }"),
        ],
    );
}

#[test]
fn a2_cube() {
    shapes(
        "shape-cube.toml",
        &[
            (
                "turned the other way",
                "turned",
                "cube = { corner = [0.2, 0.0, 0.5], edge = 1.0, rotation = -30.0 }",
            ),
            ("unturned", "turned", "cube = { corner = [0.2, 0.0, 0.5], edge = 1.0 }"),
            (
                "corner taken as the centre",
                "unturned",
                "box = { center = [-1.4, 0.0, 0.5], size = [1.0, 1.0, 1.0] }",
            ),
            ("near taken as -z", "unturned", "cube = { corner = [-1.4, 0.0, 1.5], edge = 1.0 }"),
            (
                "a prism",
                "turned",
                "prism = { corner = [0.2, 0.0, 0.5], side = 1.0, height = 1.0, rotation = 30.0 }",
            ),
        ],
    );
}

#[test]
fn a3_truncated_pyramid() {
    shapes(
        "shape-pyramid.toml",
        &[
            (
                "not truncated",
                "truncated",
                "pyramid = { corner = [-1.5, 0.0, 0.5], side = 1.0, apex_height = 1.6, height = 1.6 }",
            ),
            ("a box", "truncated", "box = { center = [-1.0, 0.4, 0.0], size = [1.0, 0.8, 1.0] }"),
            (
                "the larger of the two heights",
                "ordinary",
                "pyramid = { corner = [0.3, 0.0, 0.5], side = 1.0, apex_height = 2.0, height = 2.0, rotation = 45.0 }",
            ),
            (
                "turned about its corner",
                "ordinary",
                "pyramid = { corner = [0.05, 0.0, 0.5], side = 1.0, apex_height = 1.2, height = 1.2, rotation = 45.0 }",
            ),
        ],
    );
}

#[test]
fn a4_prism() {
    shapes(
        "shape-prism.toml",
        &[
            (
                "third vertex towards the viewer",
                "unturned",
                "prism = { corner = [-1.4, 0.0, 0.4], side = 1.0, height = 1.0, rotation = 180.0 }",
            ),
            ("a cube", "unturned", "cube = { corner = [-1.4, 0.0, 0.4], edge = 1.0 }"),
            (
                "another height",
                "turned half round",
                "prism = { corner = [0.3, 0.0, 0.4], side = 1.0, height = 0.7, rotation = 180.0 }",
            ),
        ],
    );
}

#[test]
fn a5_platform() {
    shapes(
        "shape-platform.toml",
        &[
            (
                "a plane without end",
                "middle",
                "plane = { point = [0.0, 0.4, 0.0], normal = [0.0, 1.0, 0.0] }",
            ),
            (
                "sides exchanged",
                "middle",
                "platform = { center = [0.0, 0.4, 0.0], size = [1.6, 2.0] }",
            ),
            (
                "upright",
                "top",
                "rectangle = { center = [0.0, 0.8, 0.0], size = [1.0, 0.8], normal = [0.0, 0.0, 1.0] }",
            ),
        ],
    );
}

#[test]
fn b4_canonical_objects() {
    let original = shipped("transform.toml");
    row(
        "transform.toml",
        |tested| hits_agree(&original, tested),
        &[
            ("steps in the other order", &|s| object(s, "sheared cube").transform.reverse()),
            ("a step left out", &|s| object(s, "lens").transform.truncate(1)),
            ("not mirrored", &|s| {
                let steps = &mut object(s, "mirror image").transform;
                *steps = steps.split_off(1);
            }),
            ("nothing transformed", &|s| object(s, "lying prism").transform.clear()),
        ],
    );
}

#[test]
fn b5_tapered_cylinder() {
    shapes(
        "shape-tapered-cylinder.toml",
        &[
            ("s of 1", "squeezed", "unit_cylinder = { s = 1.0 }"),
            ("s of 0", "squeezed", "unit_cylinder = { s = 0.0 }"),
            ("widening for narrowing", "squeezed", "unit_cylinder = { s = 1.4 }"),
            ("a sphere", "cylinder", "sphere = { center = [-1.5, 0.5, 0.0], radius = 0.35 }"),
            (
                "a cylinder for a cone",
                "cone",
                "cylinder = { base = [-0.6, 0.0, 0.1], top = [-0.6, 1.2, 0.1], radius = 0.4 }",
            ),
            (
                "upside down",
                "widening",
                "tapered_cylinder = { base = [1.2, 0.0, -0.3], top = [1.2, 0.8, -0.3], base_radius = 0.4, top_radius = 0.15 }",
            ),
        ],
    );
}

#[test]
fn b6_plane() {
    shapes(
        "shape-plane.toml",
        &[
            ("a platform", "ground", "platform = { center = [0.0, 0.0, 0.0], size = [8.0, 8.0] }"),
            (
                "a large sphere",
                "ground",
                "sphere = { center = [0.0, -200.0, 0.0], radius = 200.0 }",
            ),
            (
                "another tilt",
                "wall",
                "plane = { point = [-2.5, 0.0, 0.0], normal = [1.0, -0.25, 0.3] }",
            ),
        ],
    );
}

#[test]
fn b15_torus() {
    shapes(
        "torus.toml",
        &[
            (
                "a thinner tube",
                "upright",
                "torus = { center = [-0.1, 1.08, -1.1], axis = [0.45, 0.0, 1.0], ring = 0.8, tube = 0.27 }",
            ),
            (
                "lying down",
                "upright",
                "torus = { center = [-0.1, 1.08, -1.1], axis = [0.0, 1.0, 0.0], ring = 0.8, tube = 0.28 }",
            ),
            (
                "without its hole",
                "upright",
                "sphere = { center = [-0.1, 1.08, -1.1], radius = 1.08 }",
            ),
            (
                "a groove that is a cut",
                "grooved ball",
                "sphere = { center = [1.75, 0.62, -0.35], radius = 0.62 }",
            ),
        ],
    );
}

fn as_union(scene: &mut Scene) {
    replace_operation(scene, |of| Shape::Union(Union { of }));
}

fn as_intersection(scene: &mut Scene) {
    replace_operation(scene, |of| Shape::Intersection(Intersection { of }));
}

fn as_difference(scene: &mut Scene) {
    replace_operation(scene, |of| Shape::Difference(Difference { of }));
}

fn replace_operation(
    scene: &mut Scene,
    combine: impl Fn(Vec<zerkalo_scene::shape::CsgOperand>) -> Shape,
) {
    for object in &mut scene.objects {
        let operands = match &object.shape {
            Shape::Union(u) => u.of.clone(),
            Shape::Intersection(i) => i.of.clone(),
            Shape::Difference(d) => d.of.clone(),
            _ => continue,
        };
        let replacement = combine(operands);
        // Some combinations of half-spaces are unbounded, which is a fault.
        if replacement.faults().is_empty() {
            object.shape = replacement;
        }
    }
}

#[test]
fn b7_compound() {
    let files: [(&str, [(&str, Change); 2]); 4] = [
        (
            "compound-union.toml",
            [("intersections", &as_intersection), ("differences", &as_difference)],
        ),
        ("compound-intersection.toml", [("unions", &as_union), ("differences", &as_difference)]),
        ("compound-difference.toml", [("unions", &as_union), ("intersections", &as_intersection)]),
        ("compound-nested.toml", [("unions", &as_union), ("intersections", &as_intersection)]),
    ];
    for (file, mutations) in files {
        let original = shipped(file);
        row(file, |tested| hits_agree(&original, tested), &mutations);
    }
}
