//! Compound solids with coincident faces, and with a light inside.

use crate::extremes::compound::{block, difference, geometry, union};
use crate::harness::*;

/// Returns `x` moved by about `units` rounding errors. `epsilon` is the relative rounding error of
/// the precision.
fn nudged(x: f64, units: i32, epsilon: f64) -> f64 {
    x * (1.0 + f64::from(units) * epsilon)
}

/// Checks a box with a hole in its top. The top of the shape that cuts the hole is `units` times
/// the rounding error above or below the top of the box. No ray from above or below may hit a
/// surface in the opening.
fn check_flush<L: SimdFloat>(units: i32, rays: usize) {
    let top = nudged(1.0, units, L::EPSILON);
    let cutter = block([0.0, (top + 0.3) / 2.0, 0.0], [1.0, top - 0.3, 1.0]);
    let pot = difference(vec![block([0.0, 0.5, 0.0], [2.0, 1.0, 2.0]), cutter]);
    let geometry = geometry::<L>(&pot);
    let mut numbers = Numbers::new(1000);
    // Rays through a point of the opening from all sides, down to grazing angles.
    let lines: Vec<Line> = (0..rays)
        .map(|_| {
            let at = DVec3::new(numbers.between(-0.49, 0.49), 1.0, numbers.between(-0.49, 0.49));
            let (sin, cos) = numbers.between(0.0, 2.0 * PI).sin_cos();
            let down = 10f64.powf(numbers.between(-3.0, 0.0));
            let flat = (1.0 - down * down).max(0.0).sqrt();
            let d = DVec3::new(cos * flat, -down, sin * flat);
            (at - d * 0.4, d)
        })
        .collect();
    let unit = 32.0 * L::EPSILON;
    for (line, hit) in lines.iter().zip(closest(&geometry, &lines)) {
        let context = || format!("{units} ulp, {}: {line:?} {hit:?}", L::NAME);
        let hit = hit.unwrap_or_else(|| panic!("through: {}", context()));
        let in_opening = hit.point.y > 1.0 - unit
            && hit.point.x.abs() < 0.5 - unit
            && hit.point.z.abs() < 0.5 - unit;
        assert!(!in_opening, "skin: {}", context());
    }
    // Rays that start in the hole and point upwards must meet no surface in the opening.
    let up: Vec<Line> =
        lines.iter().map(|(o, d)| (*o + *d * 0.45, -*d)).filter(|l| l.0.y > 0.31).collect();
    let leaves_opening = |l: &Line| {
        let t = (1.0 - l.0.y) / l.1.y;
        let exit = l.0 + l.1 * t;
        exit.x.abs() < 0.499 && exit.z.abs() < 0.499 && l.0.x.abs() < 0.499 && l.0.z.abs() < 0.499
    };
    let up: Vec<Line> = up.into_iter().filter(leaves_opening).collect();
    assert!(up.len() > rays / 4, "{} of {rays}", up.len());
    for (line, occluded) in up.iter().zip(occluded(&geometry, &up, 50.0)) {
        assert!(!occluded, "a lid: {units} ulp, {}: {line:?}", L::NAME);
    }
}

#[test]
fn extreme_10_coincident_faces() {
    for units in -4..=4 {
        check_flush::<Double>(units, 112_000);
        check_flush::<Single>(units, 60_000);
    }
    report(10, "double", "0 skins, 0 lids for 9 x 112,000 rays");
    report(10, "single", "0 skins, 0 lids for 9 x 60,000 rays");
}

/// Checks that two adjacent boxes act as one: no ray passes between them, and no surface is left
/// inside. The boxes overlap, or have a gap, by `units` times the rounding error.
fn check_fused<L: SimdFloat>(units: i32) {
    let boundary = nudged(0.3, units, L::EPSILON);
    let right = block([(boundary + 1.0) / 2.0, 0.0, 0.0], [1.0 - boundary, 1.0, 1.0]);
    let left = block([-0.35, 0.0, 0.0], [1.3, 1.0, 1.0]);
    let both = geometry::<L>(&union(vec![left, right]));
    let mut numbers = Numbers::new(1001);
    // Rays from inside the left box through the common face, from nearly parallel to perpendicular.
    let lines: Vec<Line> = (0..60_000)
        .map(|_| {
            let at = DVec3::new(0.3, numbers.between(-0.4, 0.4), numbers.between(-0.4, 0.4));
            let across = 10f64.powf(numbers.between(-3.0, 0.0));
            let (sin, cos) = numbers.between(0.0, 2.0 * PI).sin_cos();
            let along = (1.0 - across * across).max(0.0).sqrt();
            let d = DVec3::new(across, along * sin, along * cos);
            (at - d * 0.05, d)
        })
        .collect();
    for (line, hit) in lines.iter().zip(closest(&both, &lines)) {
        let hit = hit.unwrap_or_else(|| panic!("{units}, {}: lost {line:?}", L::NAME));
        let outer = hit.point.abs().max_element() > 0.49;
        assert!(outer && hit.normal.dot(line.1) > 0.0, "{units}, {}: {line:?} {hit:?}", L::NAME);
    }
    if units > -2 {
        return;
    }
    // Rays from above to the edge of the common face, for boxes that overlap by more than a
    // rounding error.
    let lines: Vec<Line> = (0..60_000)
        .map(|n| {
            let off = numbers.between(-40.0, 40.0) * L::EPSILON;
            let z = numbers.between(-0.4, 0.4);
            let lean = if n % 2 == 0 { 0.0 } else { 1e-6 * numbers.between(-1.0, 1.0) };
            (DVec3::new(0.3 + off, 3.0, z), DVec3::new(lean, -1.0, 0.0).normalize())
        })
        .collect();
    for (line, hit) in lines.iter().zip(closest(&both, &lines)) {
        let hit = hit.unwrap_or_else(|| panic!("{units}, {}: crack {line:?}", L::NAME));
        assert!((hit.t - 2.5).abs() < 1e-5, "{units}, {}: {line:?} {hit:?}", L::NAME);
    }
}

#[test]
fn extreme_10_touching_parts_have_no_crack() {
    for units in -4..=4 {
        check_fused::<Double>(units);
        check_fused::<Single>(units);
    }
    report(10, "both", "0 cracks");
}

#[test]
fn coincident_faces_show_the_first_part() {
    let parts =
        || vec![block([0.2, 0.0, 0.0], [2.0, 1.0, 1.0]), block([-0.2, 0.0, 0.0], [2.0, 1.0, 1.0])];
    let geometry = geometry::<Single>(&union(parts()));
    let mut numbers = Numbers::new(5);
    for _ in 0..20_000 {
        let at = DVec3::new(numbers.between(-0.7, 0.7), 0.5, numbers.between(-0.4, 0.4));
        let from = at + DVec3::new(numbers.between(-1.0, 1.0), 1.0, numbers.between(-1.0, 1.0));
        let line = (from, (at - from).normalize());
        let (ray, _) = packets::<Single>(&[line]).next().unwrap();
        let hit = geometry.closest(&ray, geometry.all());
        let primitive = geometry.sources[hit.primitive.id_lane(0) as usize];
        assert_eq!((primitive.form, primitive.part), (0, 0), "{line:?}");
    }
}

#[test]
fn lamp_in_hollow_ball_lights_only_its_inside() {
    let room = |window: &str| {
        parsed(&format!(
            "[camera]\neye = [0, 0, 9]\ntarget = [0, 0, 0]\n\
             [[light]]\npoint = {{ position = [0.1, 0.0, 0.1] }}\n\
             [[object]]\nshape.platform = {{ center = [0, -3, 0], size = [20, 20] }}\n\
             [[object]]\nshape.difference.of = [\n\
             {{ shape.sphere = {{ center = [0, 0, 0], radius = 1 }} }},\n\
             {{ shape.sphere = {{ center = [0, 0, 0], radius = 0.9 }} }},\n{window}]\n"
        ))
    };
    let window = "{ shape.cylinder = { base = [0, 0, 0], top = [0, -2, 0], radius = 0.3 } },\n";
    let mut numbers = Numbers::new(4);
    let inward: Vec<Line> =
        (0..5000).map(|_| (numbers.in_cube(0.4), numbers.direction())).collect();
    let down: Vec<Line> = (0..5000)
        .map(|_| {
            (DVec3::new(numbers.between(-6.0, 6.0), -2.0, numbers.between(-6.0, 6.0)), DVec3::NEG_Y)
        })
        .collect();
    for precision in [Precision::Single, Precision::Double] {
        let closed = Traced::new(&room(""), precision);
        assert!(closed.radiance(&inward).iter().all(|l| l[0] > 0.0), "{precision:?}");
        assert!(closed.radiance(&down).iter().all(|l| l[0] == 0.0), "{precision:?}");
        let open = Traced::new(&room(window), precision);
        // The window is a hole along the y axis. Its outer rim is at y = -0.954 and 0.3 from the
        // axis. Light of the lamp at (0.1, 0, 0.1) that passes both rims falls into a disc on the
        // floor.
        for (line, light) in down.iter().zip(open.radiance(&down)) {
            // The segment from the lamp to the floor point crosses the planes of both rims.
            let floor_point = DVec3::new(line.0.x, -3.0, line.0.z);
            let lamp = DVec3::new(0.1, 0.0, 0.1);
            let off_axis = |y: f64| {
                let p = lamp + (floor_point - lamp) * (y / -3.0);
                p.x.hypot(p.z)
            };
            let (inner, outer) =
                (off_axis(-(0.81f64 - 0.09).sqrt()), off_axis(-(1.0f64 - 0.09).sqrt()));
            if inner < 0.299 && outer < 0.299 {
                assert!(light[0] > 0.0, "{precision:?}: dark at {floor_point}");
            } else if inner.max(outer) > 0.301 {
                assert!(light[0] == 0.0, "{precision:?}: lit at {floor_point}");
            }
        }
    }
}
