//! What the program says it sees through each pixel, against shapes as functions of points.

use crate::row::Verdict;
use crate::solids::Thing;
use crate::support::sized;
use glam::DVec3;
use rayon::prelude::*;
use zerkalo::camera::{Camera, ViewAngle};
use zerkalo::scene::Scene;
use zerkalo::world::{AnyWorld, FirstHit, Options, Precision};

/// Raster of the comparison.
pub const RASTER: [u32; 2] = [48, 36];
/// Points asked on the way of each ray.
const STEPS: usize = 600;
/// Depths are told in single precision; coordinates in the scenes are at most some hundred units.
const TOLERANCE: f64 = 2e-6;

/// A ray through the picture, its direction of length 1.
#[derive(Clone, Copy)]
pub struct Sighting {
    pub origin: DVec3,
    pub direction: DVec3,
    /// Cosine of the angle to the view direction.
    cos: f64,
}

/// Eye and direction through the point `x`, `y` of a raster, in pixels from the upper left corner.
pub fn sighting(camera: &Camera, [width, height]: [u32; 2], [x, y]: [f64; 2]) -> Sighting {
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
    // From the eye to the picture, in pixels.
    let distance = across / 2.0 / (degrees / 2.0).to_radians().tan();
    let v = ahead * distance + right * (x - width / 2.0) + above * (height / 2.0 - y);
    let direction = v.normalize();
    Sighting { origin, direction, cos: direction.dot(ahead) }
}

/// What the program sees through the centres of the pixels.
pub fn sights(scene: &Scene) -> Vec<FirstHit> {
    let centers = centers(scene.film.size);
    let mut seen = vec![FirstHit::MISS; centers.len()];
    let world = AnyWorld::compile(scene, &Options { precision: Precision::Double });
    world.first_hit(&centers, &mut seen);
    seen
}

/// The centres of the pixels, row by row.
pub fn centers([width, height]: [u32; 2]) -> Vec<[f64; 2]> {
    let row = |y| (0..width).map(move |x| [f64::from(x) + 0.5, f64::from(y) + 0.5]);
    (0..height).flat_map(row).collect()
}

/// Whether the program sees in `shown` what its formulas say of `meant`: every ray ends on the surface of
/// what it says to see, with the normal that the surface has there, and enters or leaves nothing on the
/// way.
pub fn sees(meant: &Scene, shown: &Scene) -> Verdict {
    sees_things(meant, &meant.objects.iter().map(Thing::new).collect::<Vec<_>>(), shown)
}

/// The same of things that are known already.
pub fn sees_things(meant: &Scene, things: &[Thing], shown: &Scene) -> Verdict {
    let (meant, shown) = (sized(meant.clone(), RASTER), sized(shown.clone(), RASTER));
    let seen = sights(&shown);
    let centers = centers(RASTER);
    let wrong: Vec<String> = centers
        .par_iter()
        .zip(&seen)
        .filter_map(|(center, sight)| {
            let ray = sighting(&meant.camera, RASTER, *center);
            let found = ends_rightly(&ray, meant.camera.near, things, sight).err()?;
            Some(format!("pixel {center:?}: {found}"))
        })
        .collect();
    let seen_objects: Vec<u32> = seen.iter().filter_map(|s| s.object).collect();
    if seen_objects.is_empty() {
        return Err("nothing is seen".into());
    }
    match wrong.first() {
        None => Ok(()),
        Some(first) => Err(format!("{} of {} rays, {first}", wrong.len(), seen.len())),
    }
}

fn ends_rightly(ray: &Sighting, near: f64, things: &[Thing], sight: &FirstHit) -> Verdict {
    let from = near / ray.cos;
    let at = |t: f64| ray.origin + ray.direction * t;
    let depth = f64::from(sight.depth);
    let tolerance = TOLERANCE * (1.0 + depth.min(1e3));
    let until = if depth.is_finite() { depth } else { 100.0 };
    // Not the very ends, where rounding decides the side.
    let (first, last) = (from + tolerance, until - 2.0 * tolerance);
    for (i, thing) in things.iter().enumerate() {
        match thing {
            Thing::Solid(inside) => {
                let side = inside(at(first)) < 0.0;
                for k in 1..=STEPS {
                    let t = first + (last - first) * k as f64 / STEPS as f64;
                    let f = inside(at(t));
                    if f.abs() > 4.0 * tolerance && (f < 0.0) != side {
                        return Err(format!("object {i} is passed through before {depth}"));
                    }
                }
            }
            Thing::Thin(meet) => {
                let hits = meet(ray.origin, ray.direction);
                if hits.iter().any(|t| (first..last).contains(t)) {
                    return Err(format!("object {i} is passed through before {depth}"));
                }
            }
        }
    }
    let Some(object) = sight.object else { return Ok(()) };
    let Some(thing) = things.get(object as usize) else {
        return Err(format!("there is no object {object}"));
    };
    let end = at(depth);
    let normal = DVec3::from(sight.normal.map(f64::from));
    if normal.dot(ray.direction) > 1e-6 {
        return Err(format!("the normal {normal} points away from the eye"));
    }
    match thing {
        Thing::Solid(inside) => {
            let f = inside(end);
            if f.abs() > 4.0 * tolerance {
                return Err(format!("object {object} ends {f} from where it is seen"));
            }
            let slopes = [1e-4, -1e-4].map(|h| {
                let by = |axis: DVec3| (inside(end + axis * h) - f) / h;
                DVec3::new(by(DVec3::X), by(DVec3::Y), by(DVec3::Z)).normalize()
            });
            // At edges the two differ.
            let smooth = slopes[0].dot(slopes[1]) > 1.0 - 1e-5;
            if smooth && normal.dot(slopes[0]).abs() < 1.0 - 1e-3 {
                return Err(format!("normal {normal} of object {object}, not {}", slopes[0]));
            }
        }
        Thing::Thin(meet) => {
            let hits = meet(ray.origin, ray.direction);
            if !hits.iter().any(|t| (t - depth).abs() < 2.0 * tolerance) {
                return Err(format!("object {object} is not at {depth} but at {hits:?}"));
            }
        }
    }
    Ok(())
}
