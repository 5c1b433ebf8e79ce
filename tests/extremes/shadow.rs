//! Shadows of surfaces on themselves and on each other.

use crate::harness::*;

/// Returns random points of the surface of a convex form, each with its normal on the visible side,
/// found by rays from outside.
fn surface_points(form: &Form, numbers: &mut Numbers, count: usize) -> Vec<(DVec3, DVec3)> {
    let (center, radius) = bounding_sphere(form).unwrap_or((DVec3::ZERO, 1.5));
    let geometry = Aggregate::<Double>::new(std::slice::from_ref(form));
    let mut points = Vec::new();
    while points.len() < count {
        let line = |_| {
            let from = center + numbers.direction() * (3.0 * radius);
            (from, (center + numbers.in_cube(0.6 * radius) - from).normalize())
        };
        let lines: Vec<Line> = (0..500).map(line).collect();
        let hits = lines.iter().zip(closest(&geometry, &lines));
        points.extend(hits.filter_map(|((_, direction), hit)| {
            let hit = hit?;
            Some((hit.point, hit.normal * -hit.normal.dot(*direction).signum()))
        }));
    }
    points
}

/// Returns the number of surface points that face the light, in the direction `towards`, but are
/// dark by error. `points` are those of the object `text` at its own place and size.
fn falsely_dark(
    (name, text): (&str, &str),
    points: &[(DVec3, DVec3)],
    (scale, place): (f64, DVec3),
    towards: DVec3,
    precision: Precision,
) -> usize {
    let scene = parsed(&format!(
        "camera = {{ eye = {}, target = {} }}\n[[light]]\ndirectional.direction = {}\n\
         [[object]]\n{text}\ntransform = [{{ scale = {scale:?} }}, {{ translate = {} }}]\n",
        array(place + DVec3::new(0.0, 3.0, 5.0) * scale),
        array(place),
        array(-towards),
        array(place),
    ));
    let traced = Traced::new(&scene, precision);
    let mut numbers = Numbers::new(15);
    let line = |(p, n): &(DVec3, DVec3)| -> Line {
        // Grazing views are left out, because the ray may pass beside the shape within rounding.
        let out = loop {
            let side = numbers.direction();
            if side.dot(*n).abs() > 0.05 {
                break side * side.dot(*n).signum();
            }
        };
        (place - traced.origin() + (*p + out * 3.0) * scale, -out)
    };
    let lines: Vec<Line> = points.iter().map(line).collect();
    // Bound of the error of the cosine. It arises because the direction of the light and the normal
    // are rounded.
    let unsure = if precision == Precision::Single { 4e-7 } else { 1e-9 };
    let light = traced.centered(&lines);
    for ((light, (_, n)), line) in light.iter().zip(points).zip(&lines) {
        let faces_away = n.dot(towards) < -unsure;
        assert!(!faces_away || light[0] == 0.0, "{name} {line:?}: lit from behind");
    }
    light.iter().zip(points).filter(|(l, (_, n))| n.dot(towards) > unsure && l[0] <= 0.0).count()
}

const SCALES: [f64; 7] = [1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6];

/// Checks flat shapes and convex solids of every kind, with light 0.01 degrees above the tangent
/// planes of three random points of the surface, and from one other direction. Returns the number of
/// points.
fn check_self_shadow(place: DVec3, scales: &[f64], count: usize) -> usize {
    let (sin, cos) = 0.01f64.to_radians().sin_cos();
    let mut numbers = Numbers::new(14);
    let mut checked = 0;
    for (name, text) in EXAMPLES {
        let form = parsed(&format!("[[object]]\n{text}")).objects[0].shape.form();
        if !(form.is_flat() || form.is_solid() && form.is_convex()) {
            continue;
        }
        let points = surface_points(&form, &mut numbers, count);
        let mut lights = vec![DVec3::new(0.3, 0.5, 0.2).normalize()];
        lights.extend((0..3).map(|i| {
            let (_, normal) = points[i * count / 3];
            let (across, along) = normal.any_orthonormal_pair();
            let (s, c) = numbers.between(0.0, TAU).sin_cos();
            (across * c + along * s) * cos + normal * sin
        }));
        for scale in scales {
            for towards in &lights {
                for precision in [Precision::Single, Precision::Double] {
                    let at = (*scale, place);
                    let dark = falsely_dark((name, text), &points, at, *towards, precision);
                    assert_eq!(
                        dark, 0,
                        "{name}, scale {scale:e}, at {place}, {precision:?}, light from {towards}: \
                         falsely dark points of {count}"
                    );
                    checked += points.len();
                }
            }
        }
    }
    checked / 2
}

#[test]
fn extreme_15_self_shadow() {
    let points = check_self_shadow(DVec3::ZERO, &SCALES, 4000);
    report(15, "both", &format!("0 falsely dark of {points} points"));
}

/// Checks self-shadowing a million units from the origin, where numbers in the scene file are
/// rounded to 1e-10. Shapes are as small as 1e-4. Compilation moves the scene to the origin. Single
/// precision is therefore as accurate as for a scene at the origin.
#[test]
fn extreme_15_self_shadow_far_from_the_origin() {
    let points = check_self_shadow(DVec3::new(1e6, -1e6, 1e6), &SCALES[1..], 2000);
    report(15, "both", &format!("a million units off 0 of {points}"));
}

/// Checks the shadow of a box that hovers a millionth of its size above the ground. The ground
/// under the box must be dark, except for a strip as wide as the gap, which slanting light reaches.
fn check_gap(scale: f64, precision: Precision) {
    let gap = 1e-6 * scale;
    let scene = parsed(&format!(
        "[camera]\neye = [0.0, {:?}, {:?}]\ntarget = [0.0, 0.0, 0.0]\n\
         [[light]]\ndirectional = {{ direction = [-1.0, -1.0, 0.0] }}\n\
         [[object]]\nshape.platform = {{ center = [0.0, 0.0, 0.0], size = [{:?}, {:?}] }}\n\
         [[object]]\nshape.box = {{ center = [0.0, {:?}, 0.0], size = [{:?}, {:?}, {:?}] }}\n",
        2.0 * scale,
        3.0 * scale,
        8.0 * scale,
        8.0 * scale,
        gap + 0.5 * scale,
        scale,
        scale,
        scale
    ));
    let traced = Traced::new(&scene, precision);
    let mut numbers = Numbers::new(16);
    let down = |x: f64, y: f64, z: f64| -> Line { (DVec3::new(x, y, z), DVec3::NEG_Y) };
    // The light comes from +x at 45 degrees. The lit strip under the box is therefore next to the
    // edge x = scale / 2, and the shadow ends at x = -scale / 2 - (scale + gap).
    let edge = 0.5 * scale;
    let mut deep = Vec::new();
    let mut shaded = Vec::new();
    let mut strip = Vec::new();
    let mut open = Vec::new();
    for _ in 0..50_000 {
        let z = numbers.between(-0.499, 0.499) * scale;
        let from_edge = gap * 10f64.powf(numbers.between(0.01, 5.9));
        deep.push(down(edge - from_edge, 0.5 * gap, z));
        strip.push(down(edge - 0.99 * gap * numbers.unit(), 0.5 * gap, z));
        let into = gap * 10f64.powf(numbers.between(0.01, 5.9));
        shaded.push(down(-edge - numbers.between(1e-5, 0.999) * scale, 3.0 * scale, z));
        open.push(down(edge + into, 3.0 * scale, z));
    }
    let lit = |lines: &[Line]| traced.radiance(lines).iter().filter(|l| l[0] > 0.0).count();
    assert_eq!(lit(&deep), 0, "scale {scale:e}, {precision:?}: light leaks under the box");
    assert_eq!(lit(&shaded), 0, "scale {scale:e}, {precision:?}: light leaks into the shadow");
    assert_eq!(lit(&open), open.len(), "scale {scale:e}, {precision:?}: dark before the box");
    if precision == Precision::Double {
        // Single precision, with coordinates rounded to 1e-6 of the scene, cannot show the strip.
        assert_eq!(lit(&strip), strip.len(), "scale {scale:e}: the strip under the edge");
    }
}

#[test]
fn extreme_16_thin_gap() {
    for scale in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
        check_gap(scale, Precision::Double);
        check_gap(scale, Precision::Single);
    }
    report(16, "double", "no leak, the strip under the edge is lit");
    report(16, "single", "no leak, the strip is not visible");
}
