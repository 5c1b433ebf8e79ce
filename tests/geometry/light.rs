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

/// Returns a ray from above to a random point of the ground, and this point. The point's
/// coordinates x and z are between -`half` and `half`.
fn to_ground(numbers: &mut Numbers, half: f64) -> (Line, DVec3) {
    let p = DVec3::new(numbers.between(-half, half), 0.0, numbers.between(-half, half));
    let from = DVec3::new(numbers.between(-5.0, 5.0), 2.0, numbers.between(-5.0, 5.0));
    ((from, (p - from).normalize()), p)
}

#[test]
fn closed_form_01_a_point_light_on_a_plane() {
    let light = DVec3::new(1.0, 3.0, -2.0);
    let scene = parsed(&ground("", light));
    let mut numbers = Numbers::new(1);
    let (lines, points): (Vec<_>, Vec<_>) =
        (0..20_000).map(|_| to_ground(&mut numbers, 45.0)).unzip();
    // Shadow rays start above the ground, at 8 times the rounding error of the largest coordinate
    // (50). By this offset they are nearer to the lamp at the height 3, and its light falls off
    // with the square of the distance.
    let lifted = |rounding: f64| 2.0 * 8.0 * rounding * 50.0 / 3.0;
    for (precision, rounding) in
        [(Precision::Double, f64::EPSILON), (Precision::Single, f64::from(f32::EPSILON))]
    {
        let tolerance = lifted(rounding) + 100.0 * rounding;
        let traced = Traced::new(&scene, precision);
        for (p, found) in points.iter().zip(traced.radiance(&lines)) {
            let foot = DVec3::new(light.x, 0.0, light.z);
            let (h, x) = (light.y, (*p - foot).length());
            // E = I h / (h^2 + x^2)^(3/2); L = rho E / pi.
            let irradiance = 40.0 * h / (h * h + x * x).powf(1.5);
            for (channel, (rho, color)) in [(0.5, 1.0), (0.8, 0.5), (0.3, 0.25)].iter().enumerate()
            {
                let expected = rho * color * irradiance / PI;
                let off = (found[channel] / expected - 1.0).abs();
                assert!(off < tolerance, "{precision:?} at {p}: {found:?}, not {expected}: {off}");
            }
        }
    }
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
