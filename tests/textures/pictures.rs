//! Pictures of textured objects against the reference tracer, for every mapping, wrap and kind.

use crate::harness::*;
use crate::textures::cases::*;

#[test]
fn every_mapping_of_an_image() {
    let desk = Desk::new();
    for case in mappings() {
        check(&case, &desk);
    }
}

#[test]
fn every_mapping_of_a_checker_on_transformed_objects() {
    let desk = Desk::new();
    for case in mappings() {
        // On a side of the block that is parallel to the projection, the checker's edges are
        // ambiguous.
        if case.name == "planar block" {
            continue;
        }
        check(&moved(Case { checker: true, ..case }), &desk);
    }
}

#[test]
fn wraps_and_filters() {
    let desk = Desk::new();
    for (name, clamp, nearest) in
        [("clamped", true, false), ("nearest", false, true), ("clamped and nearest", true, true)]
    {
        let lay = Lay { clamp, nearest, ..lay("uv", [1.9, 1.8], [-0.4, -0.5]) };
        check(&Case::new(name, SHEET, lay), &desk);
    }
}

#[test]
fn bumps_by_every_mapping() {
    let desk = Desk::new();
    for case in mappings() {
        let height = 0.02 / case.lay.scale[0].min(1.0);
        check(&Case { height, painted: false, ..case }, &desk);
    }
}

#[test]
fn bumps_on_transformed_and_textured_objects() {
    let desk = Desk::new();
    for case in mappings() {
        check(&moved(Case { height: 0.08, ..case }), &desk);
    }
}

/// Checks textures at the seam of the angular coordinate and at the poles, for spherical and
/// cylindrical mappings.
#[test]
fn seams_and_poles() {
    let desk = Desk::new();
    for case in mappings().into_iter().filter(|c| c.lay.mapping.ends_with("ical")) {
        let rotated = Case { transform: "{ rotate_y = 170 }, { rotate_x = 60 }, ", ..case };
        check(&rotated, &desk);
        check(&Case { height: 0.08, ..rotated }, &desk);
    }
}

/// Checks that pictures of objects far from the origin equal the reference at the origin,
/// although far coordinates are rounded to about 1e-10.
#[test]
fn textures_are_accurate_far_from_the_origin() {
    let desk = Desk::new();
    for case in mappings().into_iter().filter(|c| c.name != "planar floor") {
        check(&Case { far: DVec3::new(1e6, -3e5, 7e5), height: 0.05, ..case }, &desk);
    }
}

/// Checks that a rectangle of two triangles with texture coordinates equals a rectangle with the
/// mapping `uv`.
#[test]
fn the_coordinates_of_a_mesh() {
    let desk = Desk::new();
    let sheet_text = "v -0.9 -0.7 0\nv 1.0 -0.7 0\nv 1.0 0.7 0\nv -0.9 0.7 0\n\
                      vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
    fs::write(desk.0.path().join("sheet.obj"), sheet_text).unwrap();
    for (name, mapping, height) in
        [("uv mesh", "uv", 0.0), ("bumped uv mesh", "uv", 0.03), ("uv by itself", "auto", 0.02)]
    {
        let mut case = Case::new(name, SHEET, lay("uv", [1.6, 1.3], [0.0, 0.4]));
        case.height = height;
        for case in [case.clone(), moved(case)] {
            let mesh = Case { shape: "mesh = { file = \"sheet.obj\" }".into(), ..case.clone() };
            let text = mesh.text(&desk);
            check_text(&text.replace("\"uv\"", &format!("\"{mapping}\"")), &case, &desk);
        }
    }
}

/// Checks that a triangle mesh of a sphere with texture coordinates converges to a sphere with the
/// mapping `spherical`.
#[test]
fn a_mesh_of_a_sphere() {
    let desk = Desk::new();
    let mut error = Vec::new();
    for sides in [24usize, 96] {
        let rings = sides / 2;
        let mut text = String::new();
        for j in 0..=rings {
            for i in 0..=sides {
                let (u, v) = (i as f64 / sides as f64, j as f64 / rings as f64);
                let ((s, c), (y, across)) =
                    ((TAU * (u - 0.5)).sin_cos(), (PI * (v - 0.5)).sin_cos());
                let [x, z] = [across * s, across * c];
                writeln!(text, "v {x} {y} {z}\nvt {u} {v}\nvn {x} {y} {z}").unwrap();
            }
        }
        for j in 0..rings {
            for i in 0..sides {
                let at = |i: usize, j: usize| {
                    let n = j * (sides + 1) + i + 1;
                    format!("{n}/{n}/{n}")
                };
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                writeln!(text, "f {a} {b} {c} {d}").unwrap();
            }
        }
        std::fs::write(desk.0.path().join("ball.obj"), text).unwrap();
        let mut case = Case::new("mesh", BALL, lay("spherical", [2.0, 1.0], [0.0, 0.0]));
        case.height = 0.02;
        let expected = case.expected(&desk);
        case.lay.mapping = "uv";
        case.shape = "mesh = { file = \"ball.obj\" }".into();
        case.transform = "{ scale = 0.9 }, { translate = [0.1, -0.05, 0.0] }, ";
        // The transform scales the mesh by 0.9, and with it the heights. The division cancels this.
        case.height /= 0.9;
        let shown = desk.shown(&case.text(&desk), Precision::Double);
        error.push(differing(&shown, &expected, 0.03));
    }
    println!("{error:?}");
    assert!(error[1] < 0.05 && error[1] < 0.3 * error[0], "{error:?}");
}

#[test]
fn parts_of_compounds() {
    let desk = Desk::new();
    for checker in [false, true] {
        let mut case = Case::new("part", BLOCK, lay("box", [1.4, 1.1], [0.21, 0.17]));
        (case.checker, case.height) = (checker, if checker { 0.0 } else { 0.03 });
        let alone = moved(case);
        let shape = format!(
            "union.of = [\n{{ shape.sphere = {{ center = [0, 0, 90], radius = 1 }}, material = \"other\" }},\n\
             {{ shape.{}, transform = [{}] }},\n]",
            alone.shape,
            alone.transform.trim_end_matches(", "),
        );
        let text = Case { shape, transform: "", ..alone.clone() }.text(&desk);
        check_text(&(text + "[materials.other]\n"), &alone, &desk);
    }
}
