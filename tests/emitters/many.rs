//! Scenes with many lights, of which each path samples only a few. The mean radiance is compared with
//! the sum over all lights.

use crate::harness::*;

/// Smallest number of point lights of which each path samples only a few.
const CHOSEN: usize = 16;

/// Returns positions of `count` lights around the origin. About a quarter of them are below the
/// plane y = 0, and some are at the same place.
fn positions(count: usize, numbers: &mut Numbers) -> Vec<DVec3> {
    let position = |i: usize| match i % 9 {
        8 => DVec3::new(0.5, 0.75, 0.25),
        _ => numbers.in_cube(2.0) + DVec3::Y,
    };
    (0..count).map(position).collect()
}

/// Returns the text of a white diffuse receiver that faces up. Light `i` has the intensity
/// `intensity(i)`; every third light has no falloff.
fn lit_text(lights: &[DVec3], intensity: impl Fn(usize) -> f64) -> String {
    let mut text = receiver_text(DVec3::Y, WHITE, "");
    for (i, position) in lights.iter().enumerate() {
        let falloff = if i.is_multiple_of(3) { "none" } else { "inverse-square" };
        text += &format!(
            "[[light]]\npoint = {{ position = {} }}\nfalloff = \"{falloff}\"\nintensity = {:?}\n",
            array(*position),
            intensity(i)
        );
    }
    text
}

/// Returns the radiance of the receiver that light `i` at `position` causes.
fn expected(i: usize, position: DVec3) -> f64 {
    let irradiance = if i.is_multiple_of(3) { PI } else { 1.0 / position.length_squared() };
    irradiance * (position.y / position.length()).max(0.0) / PI
}

/// Checks lights of equal and of very different intensities. The brightest are sampled by all paths,
/// and each path samples a few of the others.
#[test]
fn irradiance_of_chosen_lights_is_the_sum_over_all_lights() {
    let mut numbers = Numbers::new(31);
    let mut cases = Vec::new();
    for count in [CHOSEN, 23, 24, 33, 64, 100, 191, 1000] {
        for bright in [0, 1, 3, 9] {
            let lights = positions(count, &mut numbers);
            let intensity = |i: usize| match bright {
                0 => 1.0,
                _ if i % (count / bright) == 1 => 40.0,
                _ => 0.002 * (1 + i % 50) as f64,
            };
            let light = |(i, position): (usize, &DVec3)| intensity(i) * expected(i, *position);
            let sum = lights.iter().enumerate().map(light).sum();
            let scene = parsed(&lit_text(&lights, intensity));
            cases.push((format!("{count} lights, {bright} brighter than the others"), scene, sum));
        }
    }
    check_means(&cases, 1 << 15, [1e-4, 1e-9]);
}

/// Returns the text of a spot light at `position` with the axis `axis`, and the radiance of the
/// receiver that it causes. The cone has a soft edge from 20 to 80 degrees.
fn spot(position: DVec3, axis: DVec3) -> (String, f64) {
    let [inner, outer] = [20.0_f64, 80.0];
    let text = format!(
        "[[light]]\nspot = {{ position = {}, direction = {}, inner_angle = {inner:?}, \
         outer_angle = {outer:?} }}\nfalloff = \"inverse-square\"\n",
        array(position),
        array(axis)
    );
    let [low, high] = [outer, inner].map(|angle| angle.to_radians().cos());
    let cosine = axis.dot(-position) / (axis.length() * position.length());
    let t = ((cosine - low) / (high - low)).clamp(0.0, 1.0);
    (text, t * t * (3.0 - 2.0 * t) * expected(1, position))
}

/// Checks scenes of spot lights, and of spot and point lights together. Each path samples only a
/// few of them. About half of the spots do not light the receiver.
#[test]
fn irradiance_of_chosen_spots_is_the_sum_over_all_lights() {
    let mut numbers = Numbers::new(47);
    let mut cases = Vec::new();
    for (points, spots) in [(0, 20), (0, 33), (0, 600), (CHOSEN, 20), (3, 64), (100, 29)] {
        let points = positions(points, &mut numbers);
        let mut text = lit_text(&points, |_| 1.0);
        let mut sum: f64 = points.iter().enumerate().map(|(i, light)| expected(i, *light)).sum();
        for position in positions(spots, &mut numbers) {
            let axis = numbers.in_cube(1.0) - position.normalize();
            let (spot, radiance) = spot(position, axis);
            text += &spot;
            sum += radiance;
        }
        cases.push((format!("{} points, {spots} spots", points.len()), parsed(&text), sum));
    }
    check_means(&cases, 1 << 16, [2e-4, 1e-9]);
}

/// Checks the limit up to which each path samples all spot lights, although it samples only a few
/// of the point lights: together, the cones of the spots must have less than the solid angle of
/// [`CHOSEN`] hemispheres. Up to this limit, each spot has a light group of its own, whose radiance
/// has no noise.
#[test]
fn few_spots_among_many_points_are_all_asked() {
    let lights = positions(CHOSEN, &mut Numbers::new(3));
    // A cone of 80 degrees has 0.826 times the solid angle of a hemisphere.
    for (spots, is_chosen) in [(19, false), (20, true)] {
        let mut text = lit_text(&lights, |_| 1e-30);
        for position in positions(spots, &mut Numbers::new(4)) {
            text += &spot(position, -position).0;
        }
        let (_, error) = radiance::<Double>(&parsed(&text), 64, 1);
        assert_eq!(error > 1e-6, is_chosen, "{spots} spots: {error}");
    }
}

/// Returns the mean number of samples per pixel that an adaptive render of a ball on a floor takes
/// until its estimated RMSE is half an 8-bit level. `lights` are the intensities of the point
/// lights.
fn samples_to_half_a_level(lights: &[f64]) -> f64 {
    let mut numbers = Numbers::new(5);
    let mut text = "[film]\nsize = [96, 72]\n\
         [camera]\neye = [0.0, 3.0, 7.0]\ntarget = [0.0, 0.5, 0.0]\nview_angle.vertical = 40.0\n\
         [materials.white]\ncolor = [0.8, 0.8, 0.8]\n\
         [[object]]\nmaterial = \"white\"\n\
         shape.platform = { center = [0.0, 0.0, 0.0], size = [10.0, 10.0] }\n\
         [[object]]\nmaterial = \"white\"\n\
         shape.sphere = { center = [0.0, 0.5, 0.0], radius = 0.5 }\n"
        .to_string();
    for (i, intensity) in lights.iter().enumerate() {
        let position = match i {
            0 => DVec3::new(2.0, 4.0, 3.0),
            _ => numbers.in_cube(4.0) * DVec3::new(1.0, 0.25, 1.0) + 3.0 * DVec3::Y,
        };
        let position = array(position);
        text += &format!("[[light]]\npoint = {{ position = {position} }}\nfalloff = \"none\"\n");
        text += &format!("intensity = {intensity:?}\n");
    }
    let mut rendering = begin(&parsed(&text), 4, Precision::Auto);
    let stop = noise_stop(0.5);
    let mut schedule = rendering.schedule(settings(true, 0, stop));
    let pool = pool(2);
    loop {
        match schedule.next(0.0) {
            Step::Finished(reason) => {
                assert_eq!(reason, StoppedBy::Noise);
                return schedule.spp().mean;
            }
            Step::Trace(wave) => {
                let report = trace(&mut rendering, &wave, &pool);
                schedule.complete(&wave, &report);
            }
        }
    }
}

/// Checks that weak lights beside a strong one do not multiply the number of samples. Without
/// bright lights, which all paths sample, 64 lights would take ten times and 1000 lights a hundred
/// times as many samples as one.
#[test]
fn weak_lights_hardly_change_the_number_of_samples() {
    let one = samples_to_half_a_level(&[0.7]);
    for (count, limit) in [(CHOSEN, 2.0), (64, 2.0), (1000, 2.0)] {
        let mut lights = vec![1e-6; count];
        lights[0] = 0.7;
        let many = samples_to_half_a_level(&lights);
        assert!(many <= limit * one, "{count} lights: {many} samples, one light: {one}");
    }
}

/// Checks many point lights of which each path samples only a few. They must share one light group,
/// and the mean radiance of this group must be right. A spot light beside them must have a group of
/// its own.
#[test]
fn chosen_lights_have_one_light_group() {
    let lights = positions(40, &mut Numbers::new(7));
    let spot = "[[light]]\nspot = { position = [0.0, 2.0, 0.0], direction = [0.0, -1.0, 0.0], \
                inner_angle = 20.0, outer_angle = 30.0 }\nfalloff = \"inverse-square\"\n";
    let scene = parsed(&(lit_text(&lights, |_| 1.0) + spot));
    let of_points = lights.iter().enumerate().map(|(i, position)| expected(i, *position)).sum();
    let expected = [0.25 / PI, of_points];
    let mut means = group_means::<Single>(&scene, 1 << 16, 5);
    means.pop();
    assert_eq!(means.len(), expected.len());
    let limit = two_sided_z(1e-3 / means.len() as f64);
    for ((mean, error), expected) in means.into_iter().zip(expected) {
        let off = (mean - expected).abs() - 1e-4 * expected;
        assert!(off <= limit * error, "{mean} ± {error}, expected {expected}");
    }
}

/// Checks that each path samples all lights if there are fewer than [`CHOSEN`]. The radiance then
/// has no noise.
#[test]
fn few_lights_are_all_asked() {
    let lights = positions(CHOSEN, &mut Numbers::new(3));
    let (_, error) = radiance::<Double>(&parsed(&lit_text(&lights[1..], |_| 1.0)), 64, 1);
    assert!(error < 1e-9, "{error}");
    let (_, error) = radiance::<Double>(&parsed(&lit_text(&lights, |_| 1.0)), 64, 1);
    assert!(error > 1e-3, "{error}");
}

#[test]
fn a_thousand_lights_at_extreme_places_have_finite_samples() {
    let mut lights = positions(1000, &mut Numbers::new(11));
    for (i, light) in lights.iter_mut().enumerate() {
        match i % 10 {
            0 => *light = DVec3::new(0.001, 0.0, 0.002),
            1 => *light *= 1e8,
            2 => *light = DVec3::Y * 1e-7,
            3 => *light = DVec3::ZERO,
            _ => {}
        }
    }
    let scene = parsed(&lit_text(&lights, |_| 1.0));
    for (mean, error) in
        [radiance::<Single>(&scene, 1 << 12, 1), radiance::<Double>(&scene, 1 << 12, 2)]
    {
        assert!(mean > 0.0 && error.is_finite(), "{mean} ± {error}");
    }
}

/// Smallest number of emitters of which each path samples only a few.
const CHOSEN_EMITTERS: usize = 16;

/// Returns lamps of radiance 1 above the plane y = 0: lights and emissive objects of every kind, some
/// of them invisible, in three sizes, one much larger than the others.
fn lamps(count: usize, numbers: &mut Numbers) -> Vec<String> {
    let lamp = |i: usize| {
        let center = numbers.in_cube(1.5) + 1.8 * DVec3::Y;
        let (normal, position) = (array(numbers.in_cube(1.0) - center), array(center));
        let size = if i == 5 { 0.4 } else { 0.05 * (1 + i % 3) as f64 };
        let shape = match i % 4 {
            0 => format!(
                "rectangle = {{ center = {position}, size = [{size}, 0.2], normal = {normal} }}"
            ),
            1 => format!("disk = {{ center = {position}, radius = {size}, normal = {normal} }}"),
            2 => format!("sphere = {{ center = {position}, radius = {size} }}"),
            _ => {
                let corner = array(center - DVec3::splat(0.05));
                return match i % 8 {
                    3 => format!(
                        "[[object]]\nmaterial = \"lamp\"\nshape.cube = {{ corner = {corner}, edge = 0.1 }}\n"
                    ),
                    _ => format!(
                        "[[object]]\nmaterial = \"lamp\"\nshape.sphere = {{ center = {position}, radius = 0.1 }}\n"
                    ),
                };
            }
        };
        let visible = !i.is_multiple_of(5);
        format!("[[light]]\n{shape}\nvisible = {visible}\n")
    };
    (0..count).map(lamp).collect()
}

/// Checks a diffuse and a glossy receiver, which the lamps light all together, and few at a time.
#[test]
fn light_of_chosen_emitters_is_the_sum_over_all_emitters() {
    let glossy = "diffuse = 0.3\nreflection = 0.8\nlobe = \"ggx\"\nalpha = 0.3\n";
    let limit = two_sided_z(1e-3 / 8.0);
    for (seed, (count, material)) in
        (1..).zip([(18, WHITE), (40, glossy), (200, WHITE), (200, glossy)])
    {
        let lamps = lamps(count, &mut Numbers::new(61));
        let of = |lamps: &[String]| {
            let scene = parsed(&receiver_text(DVec3::Y, material, &lamps.concat()));
            [radiance::<Single>(&scene, 1 << 13, seed), radiance::<Double>(&scene, 1 << 13, seed)]
        };
        let chosen = of(&lamps);
        // Without its light, too, an object occludes that of the others.
        let black = |lamp: &String| match lamp.starts_with("[[object]]") {
            true => lamp.replace("\"lamp\"", "\"black\""),
            false => String::new(),
        };
        let few: Vec<_> = (0..count)
            .step_by(CHOSEN_EMITTERS - 1)
            .map(|first| {
                let is_lit = |i| (first..first + CHOSEN_EMITTERS - 1).contains(&i);
                let lamp = |(i, lamp)| if is_lit(i) { String::clone(lamp) } else { black(lamp) };
                of(&lamps.iter().enumerate().map(lamp).collect::<Vec<_>>())
            })
            .collect();
        for (i, (mean, error)) in chosen.into_iter().enumerate() {
            let sum: f64 = few.iter().map(|few| few[i].0).sum();
            let variance: f64 = few.iter().map(|few| few[i].1.powi(2)).sum();
            let off = (mean - sum).abs() - 1e-4 * sum;
            let error = error.hypot(variance.sqrt());
            assert!(
                off <= limit * error,
                "{count}: {mean} ± {error}, expected {sum}, in\n{material}"
            );
        }
    }
}
