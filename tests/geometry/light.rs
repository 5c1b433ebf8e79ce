//! Point light over a plane, against closed forms: irradiance, radiance, the edge of a shadow.

use crate::harness::*;

fn ground(extra: &str, light: DVec3) -> String {
    let [x, y, z] = light.to_array();
    format!(
        "[camera]\neye = [0.0, 9.0, 1.0]\ntarget = [0.0, 0.0, 0.0]\n\
         [[light]]\npoint = {{ position = [{x:?}, {y:?}, {z:?}] }}\nintensity = 40.0\n\
         color = [1.0, 0.5, 0.25]\nfalloff = \"inverse-square\"\n\
         [materials.matt]\ncolor = [0.5, 0.8, 0.3]\ndiffuse = 1.0\nambient = 0.0\nspecular = 0.0\n\
         [[object]]\nmaterial = \"matt\"\n\
         shape.platform = {{ center = [0.0, 0.0, 0.0], size = [100.0, 100.0] }}\n{extra}"
    )
}

/// Checks the shadow of a rectangle with the corners (+-1.5, 1, +-1), turned by 20 degrees. The
/// ground must be dark exactly where the segment to the light crosses the rectangle.
#[test]
fn closed_form_01_the_shadow_has_straight_edges() {
    let light = DVec3::new(0.5, 4.0, -0.7);
    let (sin, cos) = 20f64.to_radians().sin_cos();
    let scene = parsed(&ground(
        &format!(
            "[[object]]\nshape.rectangle = {{ center = [0.2, 1.0, 0.1], size = [3.0, 2.0], \
             normal = [0.0, 1.0, 0.0], up = [{sin:?}, 0.0, {cos:?}] }}\n"
        ),
        light,
    ));
    let traced = Traced::new(&scene, Precision::Double);
    let mut numbers = Numbers::new(2);
    let (up, across) = (DVec3::new(sin, 0.0, cos), DVec3::new(cos, 0.0, -sin));
    let mut counts = [0, 0];
    let mut lines = Vec::new();
    let mut expected = Vec::new();
    while lines.len() < 100_000 {
        let p = DVec3::new(numbers.between(-3.0, 3.0), 0.0, numbers.between(-3.0, 3.0));
        // Point at the height 1 on the segment to the light, relative to the rectangle's centre.
        let crossing = p + (light - p) * 0.25 - DVec3::new(0.2, 1.0, 0.1);
        let (a, b) = (crossing.dot(across).abs() - 1.5, crossing.dot(up).abs() - 1.0);
        let beyond = a.max(b);
        if beyond.abs() < 1e-12 {
            continue;
        }
        // Half of the points away from the edges are skipped, so that points close to an edge are
        // twice as frequent.
        if numbers.bits() & 1 == 0 && beyond.abs() > 0.01 {
            continue;
        }
        // Camera rays start below the rectangle, so that it does not hide the ground.
        lines.push((p + DVec3::Y * 0.5, DVec3::NEG_Y));
        expected.push(beyond > 0.0);
    }
    for ((line, lit), found) in lines.iter().zip(&expected).zip(traced.radiance(&lines)) {
        assert_eq!(found[0] > 0.0, *lit, "{line:?}: {found:?}");
        counts[usize::from(*lit)] += 1;
    }
    assert!(counts.iter().all(|c| *c > 10_000), "dark and lit points: {counts:?}");
}
