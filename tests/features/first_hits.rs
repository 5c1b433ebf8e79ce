//! First hits of the program at each pixel centre, compared with analytic shapes.

use crate::features::analytic_shapes::AnalyticShape;
use crate::features::row::Verdict;
use crate::harness::*;
use rayon::prelude::*;

/// Width and height in pixels of the compared pictures.
pub const RASTER: [u32; 2] = [48, 36];
/// Number of points of each ray at which analytic shapes are evaluated.
const STEPS: usize = 600;
/// Largest relative error of depths, which are in single precision. Coordinates in the scenes are
/// at most some hundred units.
const TOLERANCE: f64 = 2e-6;

/// Camera ray with unit direction.
#[derive(Clone, Copy)]
pub struct PixelRay {
    pub origin: DVec3,
    pub direction: DVec3,
    /// Cosine of the angle between the ray and the view direction.
    cos: f64,
}

/// Returns the camera ray through the point `x`, `y` of the picture, in pixels from its upper left
/// corner.
pub fn pixel_ray(camera: &Camera, [width, height]: [u32; 2], [x, y]: [f64; 2]) -> PixelRay {
    let origin = DVec3::from(camera.eye);
    let ahead =
        camera.target.map(|t| DVec3::from(t) - origin).or(camera.direction.map(DVec3::from));
    let ahead = ahead.expect("a camera looks somewhere").normalize();
    let right = ahead.cross(DVec3::from(camera.up)).normalize();
    let above = right.cross(ahead);
    let [width, height] = [width, height].map(f64::from);
    let (degrees, across) = match camera.view_angle {
        ViewAngle::Vertical(degrees) => (degrees, height),
        ViewAngle::Horizontal(degrees) => (degrees, width),
    };
    // Distance from the eye to the image plane, in pixels.
    let distance = across / 2.0 / (degrees / 2.0).to_radians().tan();
    let v = ahead * distance + right * (x - width / 2.0) + above * (height / 2.0 - y);
    let direction = v.normalize();
    PixelRay { origin, direction, cos: direction.dot(ahead) }
}

/// Returns the program's first hits at the pixel centres, row by row.
pub fn first_hits(scene: &Scene) -> Vec<FirstHit> {
    let centers = centers(scene.film.size);
    let mut hits = vec![FirstHit::MISS; centers.len()];
    let world =
        AnyWorld::compile(scene, &Options { precision: Precision::Double, ..Options::default() });
    world.first_hit(&centers, &mut hits);
    hits
}

/// Returns the pixel centres, row by row.
pub fn centers([width, height]: [u32; 2]) -> Vec<[f64; 2]> {
    let row = |y| (0..width).map(move |x| [f64::from(x) + 0.5, f64::from(y) + 0.5]);
    (0..height).flat_map(row).collect()
}

/// Compares the first hits of the program in `tested` with the analytic shapes of `original`. Each
/// ray must end on the surface of the object that it reports, with that surface's normal, and must
/// not cross another surface before.
pub fn hits_agree(original: &Scene, tested: &Scene) -> Verdict {
    hits_agree_with(
        original,
        &original.objects.iter().map(AnalyticShape::new).collect::<Vec<_>>(),
        tested,
    )
}

/// Compares the first hits of the program in `tested` with `shapes`, which stand for the objects of
/// `original`.
pub fn hits_agree_with(original: &Scene, shapes: &[AnalyticShape], tested: &Scene) -> Verdict {
    let (original, tested) = (sized(original.clone(), RASTER), sized(tested.clone(), RASTER));
    let hits = first_hits(&tested);
    let centers = centers(RASTER);
    let wrong: Vec<String> = centers
        .par_iter()
        .zip(&hits)
        .filter_map(|(center, hit)| {
            let ray = pixel_ray(&original.camera, RASTER, *center);
            let error = check_hit(&ray, original.camera.near, shapes, hit).err()?;
            Some(format!("pixel {center:?}: {error}"))
        })
        .collect();
    let seen_objects: Vec<u32> = hits.iter().filter_map(|s| s.object).collect();
    if seen_objects.is_empty() {
        return Err("all rays miss".into());
    }
    match wrong.first() {
        None => Ok(()),
        Some(first) => Err(format!("{} of {} rays, {first}", wrong.len(), hits.len())),
    }
}

fn check_hit(ray: &PixelRay, near: f64, shapes: &[AnalyticShape], hit: &FirstHit) -> Verdict {
    let near_t = near / ray.cos;
    let point_at = |t: f64| ray.origin + ray.direction * t;
    let depth = f64::from(hit.depth);
    let tolerance = TOLERANCE * (1.0 + depth.min(1e3));
    let far_t = if depth.is_finite() { depth } else { 100.0 };
    // The tested part of the ray leaves out both ends, where rounding decides on which side of the
    // surface a point is.
    let (first, last) = (near_t + tolerance, far_t - 2.0 * tolerance);
    for (i, shape) in shapes.iter().enumerate() {
        match shape {
            AnalyticShape::Solid(inside, slope) => {
                let side = inside(point_at(first)) < 0.0;
                // Number of steps over which an implicit function of value 1 keeps its sign,
                // because its slope is at most `slope`. The factor 0.999 covers rounding.
                let steps_per_value = 0.999 * STEPS as f64 / ((last - first).abs() * slope);
                let mut k = 1;
                while k <= STEPS {
                    let t = first + (last - first) * k as f64 / STEPS as f64;
                    let f = inside(point_at(t));
                    let same = (f < 0.0) == side;
                    if f.abs() > 4.0 * tolerance && !same {
                        return Err(format!("the ray crosses object {i} before {depth}"));
                    }
                    k += 1 + if same { (f.abs() * steps_per_value) as usize } else { 0 };
                }
            }
            AnalyticShape::Thin(intersect) => {
                let hits = intersect(ray.origin, ray.direction);
                if hits.iter().any(|t| (first..last).contains(t)) {
                    return Err(format!("the ray crosses object {i} before {depth}"));
                }
            }
        }
    }
    let Some(object) = hit.object else { return Ok(()) };
    let Some(shape) = shapes.get(object as usize) else {
        return Err(format!("there is no object {object}"));
    };
    let end = point_at(depth);
    let normal = DVec3::from(hit.normal.map(f64::from));
    if normal.dot(ray.direction) > 1e-6 {
        return Err(format!("the normal {normal} points away from the eye"));
    }
    match shape {
        AnalyticShape::Solid(inside, _) => {
            let f = inside(end);
            if f.abs() > 4.0 * tolerance {
                return Err(format!("the hit is {f} off the surface of object {object}"));
            }
            let gradients = [1e-4, -1e-4].map(|h| {
                let slope = |axis: DVec3| (inside(end + axis * h) - f) / h;
                DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)).normalize()
            });
            // At edges, the two gradients differ and the normal is not compared.
            let is_smooth = gradients[0].dot(gradients[1]) > 1.0 - 1e-5;
            if is_smooth && normal.dot(gradients[0]).abs() < 1.0 - 1e-3 {
                return Err(format!("normal {normal} of object {object}, not {}", gradients[0]));
            }
        }
        AnalyticShape::Thin(intersect) => {
            let hits = intersect(ray.origin, ray.direction);
            if !hits.iter().any(|t| (t - depth).abs() < 2.0 * tolerance) {
                return Err(format!("object {object} is not at {depth} but at {hits:?}"));
            }
        }
    }
    Ok(())
}
