//! Tests of shapes, transforms and compounds, compared with the formulas of the shapes.

use crate::features::row::*;
use crate::harness::*;
use crate::reference::*;
use zerkalo_scene::shape::{Difference, Intersection, Union};

/// Checks that first hits in `file` agree with the formulas of the shapes, and that they disagree
/// after each mutation. A mutation is a line of its name, the name of an object, and the text of the
/// object's new shape.
fn shapes(file: &str, mutations: &str) {
    let original = shipped(file);
    let changes: Vec<_> = mutations
        .lines()
        .map(|line| {
            let [name, target, text] =
                <[&str; 3]>::try_from(line.split('|').map(str::trim).collect::<Vec<_>>()).unwrap();
            (name, move |scene: &mut Scene| object(scene, target).shape = shape(text))
        })
        .collect();
    let changes: Vec<_> = changes.iter().map(|(name, change)| (*name, change as Change)).collect();
    row(file, |tested| hits_agree(&original, tested), &changes);
}

#[test]
fn a1_sphere() {
    shapes(
        "shape-sphere.toml",
        "a plane | large | plane = { point = [-0.2, 1, -0.2], normal = [0, 0, 1] }\n\
         a cube | large | box = { center = [-0.2, 1, -0.2], size = [2, 2, 2] }\n\
         another radius | large | sphere = { center = [-0.2, 1, -0.2], radius = 1.005 }",
    );
}

#[test]
fn a2_cube() {
    shapes(
        "shape-cube.toml",
        "rotated the other way | turned | cube = { corner = [0.2, 0, 0.5], edge = 1, rotation = -30 }\n\
         unturned | turned | cube = { corner = [0.2, 0, 0.5], edge = 1 }\n\
         corner taken as the centre | unturned | box = { center = [-1.4, 0, 0.5], size = [1, 1, 1] }\n\
         near taken as -z | unturned | cube = { corner = [-1.4, 0, 1.5], edge = 1 }\n\
         a prism | turned | prism = { corner = [0.2, 0, 0.5], side = 1, height = 1, rotation = 30 }",
    );
}

#[test]
fn a3_truncated_pyramid() {
    shapes(
        "shape-pyramid.toml",
        "not truncated | truncated | pyramid = { corner = [-1.5, 0, 0.5], side = 1, apex_height = 1.6, height = 1.6 }\n\
         a box | truncated | box = { center = [-1, 0.4, 0], size = [1, 0.8, 1] }\n\
         the larger of the two heights | ordinary | pyramid = { corner = [0.3, 0, 0.5], side = 1, apex_height = 2, height = 2, rotation = 45 }\n\
         rotated about its corner | ordinary | pyramid = { corner = [0.05, 0, 0.5], side = 1, apex_height = 1.2, height = 1.2, rotation = 45 }",
    );
}

#[test]
fn a4_prism() {
    shapes(
        "shape-prism.toml",
        "third vertex towards the viewer | unturned | prism = { corner = [-1.4, 0, 0.4], side = 1, height = 1, rotation = 180 }\n\
         a cube | unturned | cube = { corner = [-1.4, 0, 0.4], edge = 1 }\n\
         another height | turned half round | prism = { corner = [0.3, 0, 0.4], side = 1, height = 0.7, rotation = 180 }",
    );
}

#[test]
fn a5_platform() {
    shapes(
        "shape-platform.toml",
        "a plane without end | middle | plane = { point = [0, 0.4, 0], normal = [0, 1, 0] }\n\
         sides exchanged | middle | platform = { center = [0, 0.4, 0], size = [1.6, 2] }\n\
         upright | top | rectangle = { center = [0, 0.8, 0], size = [1, 0.8], normal = [0, 0, 1] }",
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
        "s of 1 | squeezed | unit_frustum = { s = 1 }\n\
         s of 0 | squeezed | unit_frustum = { s = 0 }\n\
         widening for narrowing | squeezed | unit_frustum = { s = 1.4 }\n\
         a sphere | cylinder | sphere = { center = [-1.5, 0.5, 0], radius = 0.35 }\n\
         a cylinder for a cone | cone | cylinder = { base = [-0.6, 0, 0.1], top = [-0.6, 1.2, 0.1], radius = 0.4 }\n\
         upside down | widening | tapered_cylinder = { base = [1.2, 0, -0.3], top = [1.2, 0.8, -0.3], base_radius = 0.4, top_radius = 0.15 }",
    );
}

#[test]
fn b6_plane() {
    shapes(
        "shape-plane.toml",
        "a platform | ground | platform = { center = [0, 0, 0], size = [8, 8] }\n\
         a large sphere | ground | sphere = { center = [0, -200, 0], radius = 200 }\n\
         another tilt | wall | plane = { point = [-2.5, 0, 0], normal = [1, -0.25, 0.3] }",
    );
}

#[test]
fn b15_torus() {
    shapes(
        "torus.toml",
        "a thinner tube | upright | torus = { center = [-0.1, 1.08, -1.1], axis = [0.45, 0, 1], ring = 0.8, tube = 0.27 }\n\
         lying down | upright | torus = { center = [-0.1, 1.08, -1.1], axis = [0, 1, 0], ring = 0.8, tube = 0.28 }\n\
         without its hole | upright | sphere = { center = [-0.1, 1.08, -1.1], radius = 1.08 }\n\
         a groove that is a cut | grooved ball | sphere = { center = [1.75, 0.62, -0.35], radius = 0.62 }",
    );
}

fn with_operation(scene: &mut Scene, combine: fn(Vec<CsgOperand>) -> Shape) {
    for object in &mut scene.objects {
        let (Shape::Union(Union { of })
        | Shape::Intersection(Intersection { of })
        | Shape::Difference(Difference { of })) = &object.shape
        else {
            continue;
        };
        let replacement = combine(of.clone());
        // Some combinations of half-spaces are unbounded, which is a fault.
        if replacement.faults().is_empty() {
            object.shape = replacement;
        }
    }
}

#[test]
fn b7_compound() {
    let unions: Change = &|s| with_operation(s, |of| Shape::Union(Union { of }));
    let intersections: Change =
        &|s| with_operation(s, |of| Shape::Intersection(Intersection { of }));
    let differences: Change = &|s| with_operation(s, |of| Shape::Difference(Difference { of }));
    for (file, mutations) in [
        ("compound-union.toml", [("intersections", intersections), ("differences", differences)]),
        ("compound-intersection.toml", [("unions", unions), ("differences", differences)]),
        ("compound-difference.toml", [("unions", unions), ("intersections", intersections)]),
        ("compound-nested.toml", [("unions", unions), ("intersections", intersections)]),
    ] {
        let original = shipped(file);
        row(file, |tested| hits_agree(&original, tested), &mutations);
    }
}
