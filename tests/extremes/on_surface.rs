//! Lamps that lie exactly on surfaces.

use crate::harness::*;

/// Ceilings that contain the point lamp at (0, 3, 0). The number determines which points above the
/// ceiling, at y = 4, the lamp lights: those farther from the y axis than this distance. It is 0 for
/// a thin surface (all points), and infinity for a solid that hides all of them.
const CEILINGS: [(&str, f64); 9] = [
    ("platform = { center = [0, 3, 0], size = [4, 4] }", 0.0),
    ("plane = { point = [0, 3, 0], normal = [0, -1, 0] }", 0.0),
    ("rectangle = { center = [0, 3, 0], size = [4, 4], normal = [0, 1, 0], up = [0, 0, 1] }", 0.0),
    ("box = { center = [0, 3.1, 0], size = [6, 0.2, 6] }", f64::INFINITY),
    ("mesh = { file = \"slab.obj\" }", f64::INFINITY),
    ("cylinder = { base = [0, 3, 0], top = [0, 3.2, 0], radius = 3 }", f64::INFINITY),
    ("sphere = { center = [0, 3.25, 0], radius = 0.25 }", f64::INFINITY),
    ("cone = { base = [0, 3.4, 0], apex = [0, 3, 0], radius = 0.2 }", 0.5),
    (
        "difference.of = [{ shape.box = { center = [0, 3, 0], size = [6, 0.4, 6] } }, \
         { shape.box = { center = [0, 2.5, 0], size = [5, 1, 5] } }]",
        f64::INFINITY,
    ),
];

/// Returns two lists of points, each with its normal. The points of the first list are on a room's
/// floor and on a wall that reaches up to the ceiling, those of the second on a board above the
/// ceiling.
fn receivers(numbers: &mut Numbers, count: usize) -> [Vec<(DVec3, DVec3)>; 2] {
    let mut below = Vec::new();
    let mut above = Vec::new();
    for _ in 0..count {
        let [x, z] = [numbers.between(-1.9, 1.9), numbers.between(-1.9, 1.9)];
        below.push((DVec3::new(x, 0.0, z), DVec3::Y));
        // Height of a point of the wall, from 0.002 below the ceiling downwards.
        let height = 3.0 - 10f64.powf(numbers.between(-2.7, 0.4));
        below.push((DVec3::new(-2.0, height, z), DVec3::X));
        above.push((DVec3::new(x, 4.0, z), DVec3::NEG_Y));
    }
    [below, above]
}

fn check(ceiling: &str, open: f64, place: &DAffine3, folder: &Path, precision: Precision) {
    let transform = format!("transform = [{}]\n", steps(place));
    let lamp = DVec3::new(0.0, 3.0, 0.0);
    let text = format!(
        "[camera]\neye = {}\ntarget = {}\n[[light]]\npoint.position = {}\nfalloff = \"none\"\n\
         [materials.white]\ncolor = [1, 1, 1]\ndiffuse = 1\n\
         [[object]]\nmaterial = \"white\"\nshape.{ceiling}\n{transform}\
         [[object]]\nmaterial = \"white\"\nshape.platform = {{ center = [0, 0, 0], size = [4, 4] }}\n{transform}\
         [[object]]\nmaterial = \"white\"\nshape.platform = {{ center = [0, 4, 0], size = [4, 4] }}\n{transform}\
         [[object]]\nmaterial = \"white\"\nshape.rectangle = {{ center = [-2, 1.5, 0], size = [4, 3], \
         normal = [1, 0, 0] }}\n{transform}",
        array(place.transform_point3(DVec3::new(1.0, 1.0, 1.0))),
        array(place.transform_point3(DVec3::ZERO)),
        array(place.transform_point3(lamp)),
    );
    let path = folder.join("scene.toml");
    let slab = obj_box(DVec3::new(-3.0, 3.0, -3.0), DVec3::new(3.0, 3.2, 3.0));
    fs::write(folder.join("slab.obj"), slab).unwrap();
    fs::write(&path, &text).unwrap();
    let scene = Scene::read(&path).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let traced = Traced::new(&scene, precision);
    let mut numbers = Numbers::new(4);
    let context = |p: DVec3| format!("{ceiling}, {place}, {precision:?}: {p}");
    for (points, open) in receivers(&mut numbers, 2000).into_iter().zip([0.0, open]) {
        let line = |(p, n): &(DVec3, DVec3)| -> Line {
            let from = place.transform_point3(*p + *n * 0.002 + DVec3::new(1e-4, 0.0, 2e-4));
            (from, (place.transform_point3(*p) - from).normalize())
        };
        let lines: Vec<Line> = points.iter().map(line).collect();
        for ((p, n), light) in points.iter().zip(traced.radiance(&lines)) {
            let off_axis = p.x.hypot(p.z);
            if (off_axis - open).abs() < 1e-3 {
                continue;
            }
            let expected = if off_axis > open { n.dot((lamp - *p).normalize()) } else { 0.0 };
            assert!(
                (light[0] - expected).abs() < 2e-3,
                "{}: {light:?}, not {expected}",
                context(*p)
            );
        }
    }
    if ceiling.starts_with("sphere") || ceiling.starts_with("cone") {
        return;
    }
    // The surface on which the lamp lies must be dark.
    let flat = |x: f64| -> Line {
        let p = DVec3::new(x, 3.0, 0.3 * x);
        let from = place.transform_point3(p + DVec3::new(0.01, -0.3, 0.02));
        (from, (place.transform_point3(p) - from).normalize())
    };
    let lines: Vec<Line> = (1..200).map(|i| flat(f64::from(i) * 0.009)).collect();
    for ((_, direction), light) in lines.iter().zip(traced.radiance(&lines)) {
        assert!(light[0] < 1e-2, "{}", context(*direction));
    }
}

#[test]
fn lamp_on_surface_lights_like_lamp_just_off_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut numbers = Numbers::new(44);
    for (ceiling, open) in CEILINGS {
        for scale in [1e-4, 1.0, 1e4] {
            for far in [0.0, 1.0, 1e5] {
                for degrees in [0.0f64, 33.0] {
                    // Decimals in the scene file are rounded to 1e-16 of the offset.
                    if far == 1e5 && scale < 1.0 {
                        continue;
                    }
                    let turn = DQuat::from_axis_angle(numbers.direction(), degrees.to_radians());
                    let offset = numbers.direction() * far;
                    let place = DAffine3::from_scale_rotation_translation(
                        DVec3::splat(scale),
                        turn,
                        offset,
                    );
                    for precision in [Precision::Single, Precision::Double] {
                        check(ceiling, open, &place, folder.path(), precision);
                    }
                }
            }
        }
    }
}
