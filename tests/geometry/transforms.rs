//! Transformed objects against the definition of a transform: a point is on the transformed object
//! if its inverse image is on the original object.

use crate::harness::*;

fn random_map(numbers: &mut Numbers) -> DAffine3 {
    let mut factor = || {
        let size = 10f64.powf(numbers.between(-0.7, 0.7));
        if numbers.below(4) == 0 { -size } else { size }
    };
    let scale = DVec3::new(factor(), factor(), factor());
    let rotation = |n: &mut Numbers| DQuat::from_axis_angle(n.direction(), n.between(0.0, 6.0));
    let (first, last) = (rotation(numbers), rotation(numbers));
    DAffine3::from_translation(numbers.in_cube(5.0))
        * DAffine3::from_quat(last)
        * DAffine3::from_scale(scale)
        * DAffine3::from_quat(first)
}

#[test]
fn transformed_objects_are_hit_at_images_of_original_hits() {
    for (i, (name, form)) in every_kind().into_iter().enumerate() {
        let mut numbers = Numbers::new(400 + i as u64);
        let flat = form.is_flat();
        let original = Aggregate::<Double>::new(std::slice::from_ref(&form));
        for round in 0..20 {
            let map = random_map(&mut numbers);
            let back = map.inverse();
            let image = form.clone().transformed(&map);
            let geometry = Aggregate::<Double>::new(std::slice::from_ref(&image));
            let (center, radius) = bounding_sphere(&image).unwrap_or((map.translation, 3.0));
            let lines: Vec<Line> = (0..2000)
                .map(|_| {
                    let from = center + numbers.direction() * (3.0 * radius);
                    let to = center + numbers.in_cube(0.8 * radius);
                    (from, (to - from).normalize())
                })
                .collect();
            let originals: Vec<Line> = lines
                .iter()
                .map(|(o, d)| (back.transform_point3(*o), back.transform_vector3(*d).normalize()))
                .collect();
            let image_hits = closest(&geometry, &lines);
            let mut hits = 0;
            for (n, (got, truth)) in
                image_hits.iter().zip(closest(&original, &originals)).enumerate()
            {
                let context = || format!("{name}, map {round}, ray {n}: {:?}", lines[n]);
                let (Some(got), Some(truth)) = (got, truth) else {
                    assert_eq!(got.is_some(), truth.is_some(), "{}", context());
                    continue;
                };
                hits += 1;
                let d = lines[n].1;
                let point = map.transform_point3(truth.point);
                let normals: DMat3 = map.matrix3.inverse().transpose();
                let normal = (normals * truth.normal).normalize();
                // The tolerance is the rounding error of all lengths involved, divided by the
                // cosine of the angle between ray and normal.
                let lengths = radius + center.length() + got.t;
                let tolerance = 1e-12 * lengths / normal.dot(d).abs();
                assert!(
                    (got.point - point).length() <= tolerance,
                    "{}: {got:?} {point}",
                    context()
                );
                assert!((got.normal - normal).length() <= 1e-9, "{}: {got:?} {normal}", context());
                assert!(flat || got.normal.dot(d) < 0.0, "{}: {got:?}", context());
            }
            assert!(hits > 20, "{name}: only {hits} rays hit it");
        }
    }
}
