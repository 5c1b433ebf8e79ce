//! Comparisons without noise: first hits at pixel centres, and pictures without random numbers.

use crate::harness::*;
use crate::reference::{Mutation, Tracer};
use rayon::prelude::*;

/// Width and height in pixels of the compared pictures.
pub const RASTER: [u32; 2] = [48, 36];

/// Returns `scene` at the size of the comparison, with one ray through each pixel centre.
fn at_centers(scene: &Scene) -> Scene {
    let mut scene = sized(scene.clone(), RASTER);
    scene.film.filter = Filter::Point;
    scene
}

/// Returns the pixel centres, row by row.
pub fn centers([width, height]: [u32; 2]) -> Vec<[f64; 2]> {
    let row = |y| (0..width).map(move |x| [f64::from(x) + 0.5, f64::from(y) + 0.5]);
    (0..height).flat_map(row).collect()
}

/// Returns the camera ray through the point `x`, `y` of the picture, in pixels from its upper left
/// corner. The camera has no lens.
pub fn pixel_ray(scene: &Scene, [x, y]: [f64; 2]) -> Line {
    let camera = Scene { objects: Vec::new(), ..scene.clone() };
    let tracer = Tracer::new(&camera, Mutation::None).expect("no object");
    tracer.camera_ray(x, y, &mut Numbers::new(1))
}

/// Returns the program's first hits at the pixel centres, row by row.
pub fn first_hits(scene: &Scene) -> Vec<FirstHit> {
    let centers = centers(scene.film.size);
    let mut hits = vec![FirstHit::MISS; centers.len()];
    let options = Options { precision: Precision::Double, ..Options::default() };
    AnyWorld::compile(scene, &options).first_hit(&centers, &mut hits);
    hits
}

/// Compares the first hits of the program in `tested` with those of the reference tracer in
/// `original`: object, distance and normal at each pixel centre.
pub fn hits_agree(original: &Scene, tested: &Scene) -> Verdict {
    let original = at_centers(original);
    let tracer = Tracer::new(&original, Mutation::None).expect("the reference tracer supports it");
    let hits = first_hits(&at_centers(tested));
    let compared = centers(RASTER).into_par_iter().zip(&hits);
    let wrong: Vec<String> = compared
        .filter_map(|([x, y], hit)| {
            let (origin, direction) = tracer.camera_ray(x, y, &mut Numbers::new(1));
            let expected = tracer.meet(origin, direction);
            let error = |what: &str| Some(format!("pixel {x} {y}: {hit:?} has {what}"));
            let Some(expected) = expected else {
                return hit.object.and_then(|_| error("no object there"));
            };
            if hit.object != Some(expected.body as u32) {
                return error(&format!("not object {}", expected.body));
            }
            let distance = expected.point.distance(original.camera.eye.into());
            // Distances and normals of first hits are in single precision.
            if (f64::from(hit.depth) - distance).abs() > 4e-6 * (1.0 + distance.min(1e3)) {
                return error(&format!("not the distance {distance}"));
            }
            let normal = DVec3::from(hit.normal.map(f64::from));
            let is_normal = |n: DVec3| normal.dot(n) > 1.0 - 1e-5;
            let agrees = is_normal(expected.normal) || is_normal(expected.seen);
            if agrees { None } else { error(&format!("not the normal {}", expected.normal)) }
        })
        .collect();
    ensure(hits.iter().any(|hit| hit.object.is_some()), || "all rays miss".into())?;
    ensure(wrong.is_empty(), || format!("{} of {} rays, {}", wrong.len(), hits.len(), wrong[0]))
}

/// Returns the radiance of every pixel, with one ray through each pixel centre.
pub fn without_noise(scene: &Scene) -> Vec<DVec3> {
    let rendering = rendered(&at_centers(scene), 1, Precision::Double, 1);
    picture(&rendering, Replicates::Both).into_iter().map(DVec3::from).collect()
}

/// Returns the reference tracer's picture of a scene without random numbers.
pub fn reference_without_noise(scene: &Scene) -> Vec<DVec3> {
    let tracer = Tracer::new(scene, Mutation::None).expect("the reference tracer supports it");
    let [width, height] = scene.film.size;
    let pixel = |i| tracer.pixel(i % width, i / width, 2, &mut Numbers::new(1)).mean;
    (0..width * height).into_par_iter().map(pixel).collect()
}

/// Compares the program's picture of `tested` with the reference tracer's picture of `original`,
/// pixel by pixel. The pictures must not depend on random numbers. `tolerance` is relative.
pub fn agrees_within(original: &Scene, tested: &Scene, tolerance: f64) -> Verdict {
    let expected = reference_without_noise(&at_centers(original));
    let shown = without_noise(tested);
    let differs = |(shown, expected): &(&DVec3, &DVec3)| {
        let allowed = tolerance * (expected.abs().max_element() + 1e-3);
        (**shown - **expected).abs().max_element() > allowed
    };
    let wrong: Vec<_> = shown.iter().zip(&expected).filter(differs).collect();
    ensure(wrong.is_empty(), || {
        format!(
            "{} of {} pixels, {} instead of {}",
            wrong.len(),
            shown.len(),
            wrong[0].0,
            wrong[0].1
        )
    })
}

/// Compares as [`agrees_within`] does. The tolerance allows for the rounding of the film, and for
/// formulas that round differently.
pub fn agrees_exactly(original: &Scene, tested: &Scene) -> Verdict {
    agrees_within(original, tested, 1e-6)
}
