//! Compound solids where faces lie on each other, and with light inside.

use crate::common::Numbers;
use crate::compound::{block, difference, geometry, union};
use crate::rays::{Line, Traced, blocked, closest, scene};
use crate::report::report;
use glam::DVec3;
use std::f64::consts::PI;
use zerkalo::lanes::{Double, SimdFloat, Single};
use zerkalo::world::Precision;

/// `x` moved by so many units of the last place of the precision's numbers near 1.
fn nudged(x: f64, units: i32, epsilon: f64) -> f64 {
    x * (1.0 + f64::from(units) * epsilon)
}

/// A box with a hole from its top: the cutter's top lies on the box's, or some ulps beside it. Seen
/// from above no ray may meet the opening.
fn check_flush<L: SimdFloat>(units: i32, rays: usize) {
    let top = nudged(1.0, units, L::EPSILON);
    let cutter = block([0.0, (top + 0.3) / 2.0, 0.0], [1.0, top - 0.3, 1.0]);
    let pot = difference(vec![block([0.0, 0.5, 0.0], [2.0, 1.0, 2.0]), cutter]);
    let geometry = geometry::<L>(&pot);
    let mut numbers = Numbers::new(1000);
    // Through a point of the opening, from any side, also flat.
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
    for (line, met) in lines.iter().zip(closest(&geometry, &lines)) {
        let told = || format!("{units} ulp, {}: {line:?} {met:?}", L::NAME);
        let met = met.unwrap_or_else(|| panic!("through: {}", told()));
        let in_opening = met.point.y > 1.0 - unit
            && met.point.x.abs() < 0.5 - unit
            && met.point.z.abs() < 0.5 - unit;
        assert!(!in_opening, "skin: {}", told());
    }
    // From the bottom of the hole light gets out, and from outside none through the walls.
    let up: Vec<Line> =
        lines.iter().map(|(o, d)| (*o + *d * 0.45, -*d)).filter(|l| l.0.y > 0.31).collect();
    let out = |l: &Line| {
        let t = (1.0 - l.0.y) / l.1.y;
        let at = l.0 + l.1 * t;
        at.x.abs() < 0.499 && at.z.abs() < 0.499 && l.0.x.abs() < 0.499 && l.0.z.abs() < 0.499
    };
    let up: Vec<Line> = up.into_iter().filter(out).collect();
    assert!(up.len() > rays / 4, "{} of {rays}", up.len());
    for (line, blocked) in up.iter().zip(blocked(&geometry, &up, 50.0)) {
        assert!(!blocked, "a lid: {units} ulp, {}: {line:?}", L::NAME);
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

/// Two boxes side by side are one: no crack lets a ray in between, and no wall stands inside.
fn check_fused<L: SimdFloat>(units: i32) {
    let seam = nudged(0.3, units, L::EPSILON);
    let right = block([(seam + 1.0) / 2.0, 0.0, 0.0], [1.0 - seam, 1.0, 1.0]);
    let left = block([-0.35, 0.0, 0.0], [1.3, 1.0, 1.0]);
    let both = geometry::<L>(&union(vec![left, right]));
    let mut numbers = Numbers::new(1001);
    // From inside the left one through the seam, nearly along it and across.
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
    for (line, met) in lines.iter().zip(closest(&both, &lines)) {
        let met = met.unwrap_or_else(|| panic!("{units}, {}: lost {line:?}", L::NAME));
        let outer = met.point.abs().max_element() > 0.49;
        assert!(outer && met.normal.dot(line.1) > 0.0, "{units}, {}: {line:?} {met:?}", L::NAME);
    }
    if units > -2 {
        return;
    }
    // From outside straight at the seam, where the boxes overlap by more than a rounding.
    let lines: Vec<Line> = (0..60_000)
        .map(|n| {
            let off = numbers.between(-40.0, 40.0) * L::EPSILON;
            let z = numbers.between(-0.4, 0.4);
            let lean = if n % 2 == 0 { 0.0 } else { 1e-6 * numbers.between(-1.0, 1.0) };
            (DVec3::new(0.3 + off, 3.0, z), DVec3::new(lean, -1.0, 0.0).normalize())
        })
        .collect();
    for (line, met) in lines.iter().zip(closest(&both, &lines)) {
        let met = met.unwrap_or_else(|| panic!("{units}, {}: crack {line:?}", L::NAME));
        assert!((met.t - 2.5).abs() < 1e-5, "{units}, {}: {line:?} {met:?}", L::NAME);
    }
}

#[test]
fn extreme_10_no_crack_where_parts_touch() {
    for units in -4..=4 {
        check_fused::<Double>(units);
        check_fused::<Single>(units);
    }
    report(10, "both", "0 cracks");
}

/// Where faces of two materials lie on each other, the part that is listed first is seen, not a
/// mixture by rounding.
#[test]
fn faces_on_each_other_show_the_first_part() {
    let parts =
        || vec![block([0.2, 0.0, 0.0], [2.0, 1.0, 1.0]), block([-0.2, 0.0, 0.0], [2.0, 1.0, 1.0])];
    let geometry = geometry::<Single>(&union(parts()));
    let mut numbers = Numbers::new(5);
    for _ in 0..20_000 {
        let at = DVec3::new(numbers.between(-0.7, 0.7), 0.5, numbers.between(-0.4, 0.4));
        let from = at + DVec3::new(numbers.between(-1.0, 1.0), 1.0, numbers.between(-1.0, 1.0));
        let line = (from, (at - from).normalize());
        let (ray, _) = crate::rays::packets::<Single>(&[line]).next().unwrap();
        let hit = geometry.closest(&ray, geometry.all());
        let item = geometry.sources()[hit.item.id_lane(0) as usize];
        assert_eq!((item.form, item.part), (0, 0), "{line:?}");
    }
}

/// A lamp in a hollow ball lights its inside and nothing else, unless there is a window.
#[test]
fn light_inside() {
    let room = |window: &str| {
        scene(&format!(
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
        // Through the lower rim of the window, at y = -0.954 and 0.3 from the axis: from the lamp
        // at (0.1, 0, 0.1) the light falls into a disc about its mirror point.
        for (line, light) in down.iter().zip(open.radiance(&down)) {
            // The line from the lamp to the floor point passes the planes of both rims.
            let at = DVec3::new(line.0.x, -3.0, line.0.z);
            let lamp = DVec3::new(0.1, 0.0, 0.1);
            let off_axis = |y: f64| {
                let p = lamp + (at - lamp) * (y / -3.0);
                p.x.hypot(p.z)
            };
            let (inner, outer) =
                (off_axis(-(0.81f64 - 0.09).sqrt()), off_axis(-(1.0f64 - 0.09).sqrt()));
            if inner < 0.299 && outer < 0.299 {
                assert!(light[0] > 0.0, "{precision:?}: dark at {at}");
            } else if inner.max(outer) > 0.301 {
                assert!(light[0] == 0.0, "{precision:?}: lit at {at}");
            }
        }
    }
}
