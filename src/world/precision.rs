//! Choice of the precision: single as long as nothing that it blurs can be seen.
//!
//! In single precision a coordinate is known to some 2^-23 of the scene's extent, and rays that leave a
//! surface start 2^-20 of the extent above it. What is smaller than a few times that is lost: thin
//! objects, gaps between objects, the surroundings of a lamp, and what a pixel shows of an object close
//! to the eye. Each of them has its ratio here; `tests/extremes/precision.rs` measures what single
//! precision gets wrong at each.

use crate::camera::PinholeCamera;
use crate::primitive::{BoundingSphere, Form, HalfSpace, Proxy, ProxyFace};
use crate::scene::Scene;
use crate::world::clearance::clearance;
use glam::DVec3;
use std::ops::Range;

/// Largest ratio of scene extent to thickness for single precision. At this ratio a ray's offset is 1/128 of
/// the thickness.
const MAX_EXTENT_PER_THICKNESS: f64 = 8192.0;

/// The largest extent over the narrowest gap between objects: eight times the height at which rays start.
const MAX_EXTENT_PER_GAP: f64 = 131_072.0;

/// The largest extent over what a pixel shows of the object nearest to the eye: 32 times the height at
/// which rays start.
const MAX_EXTENT_PER_PIXEL: f64 = 32_768.0;

/// Factor by which the eye may be closer to flat objects: points are put back on a plane almost exactly, and its
/// normal is the same everywhere.
const FLAT: f64 = 8.0;

/// The largest extent over the distance of a lamp from objects: the height at which rays start is then
/// 1/512 of it, and so is the error of the light's angle.
const MAX_EXTENT_PER_LIGHT_DISTANCE: f64 = 2048.0;

/// The least angle between the rays of neighbouring pixels \[radians\]: 64 roundings of a direction.
const LEAST_ANGLE: f64 = 1.0 / 131_072.0;

/// Gaps below this part of the extent, and below a few roundings of the place in the file, are between
/// numbers that were meant to be equal.
const COINCIDENT_GAP: f64 = 1.0 / 17_592_186_044_416.0;

/// Largest number of pairs of objects that are searched for gaps; a scene that crowded has no room for more.
const MOST_PAIRS: usize = 1 << 20;

/// Returns `true` if single precision shows `scene` as well as double does, as far as its proportions show.
/// `forms` are all objects, around `origin`; `extent` is the largest coordinate of objects and eye there.
pub(super) fn single_suffices(scene: &Scene, forms: &[Form], origin: DVec3, extent: f64) -> bool {
    let thinnest = forms.iter().map(Form::thickness).fold(f64::INFINITY, f64::min);
    if extent > MAX_EXTENT_PER_THICKNESS * thinnest {
        return false;
    }
    let view = PinholeCamera::new(&scene.camera, scene.film.size, origin);
    let angle = view.pixel_angle();
    let distance =
        |form: &Form| Some(form.clearance(view.eye())? * if form.is_flat() { FLAT } else { 1.0 });
    let seen_from =
        forms.iter().filter_map(distance).fold(f64::INFINITY, f64::min).max(scene.camera.near);
    if angle < LEAST_ANGLE || extent > MAX_EXTENT_PER_PIXEL * angle * seen_from {
        return false;
    }
    let lamps = scene.lights.iter().filter(|l| l.on).filter_map(|l| l.point);
    let mut distances = lamps.map(|lamp| clearance(forms, DVec3::from(lamp.position) - origin));
    if distances.any(|distance| extent > MAX_EXTENT_PER_LIGHT_DISTANCE * distance) {
        return false;
    }
    let rounded = 16.0 * f64::EPSILON * origin.abs().max_element();
    let narrow = (COINCIDENT_GAP * extent).max(rounded)..extent / MAX_EXTENT_PER_GAP;
    let pixel = |point: DVec3| angle * point.distance(view.eye());
    !has_gap(forms, narrow, pixel)
}

/// Returns `true` if two boxes are no farther than `limit` from each other along any axis.
fn are_near(a: &Proxy, b: &Proxy, limit: f64) -> bool {
    (a.low - b.high).max(b.low - a.high).max_element() <= limit
}

/// Closest place of two faces.
struct Clearance {
    width: f64,
    /// For sides that bend away from each other: the place, and the radius of a ball that would bend away
    /// from a plane as they do.
    round: Option<(DVec3, f64)>,
}

impl Clearance {
    /// Returns `true` if it is narrow, and wherever it is narrow so is more than half a pixel around: a ball beside
    /// another, or on a floor, is close to it in a spot too small to see.
    fn is_seen(&self, narrow: &Range<f64>, pixel: &impl Fn(DVec3) -> f64) -> bool {
        let wide =
            |(place, radius): (DVec3, f64)| (2.0 * radius * narrow.end).sqrt() > 0.5 * pixel(place);
        narrow.contains(&self.width) && self.round.is_none_or(wide)
    }
}

/// The gaps between two sides that run side by side.
fn gaps(a: &ProxyFace, b: &ProxyFace) -> [Option<Clearance>; 2] {
    match (a, b) {
        (ProxyFace::Flat(a), ProxyFace::Flat(b)) => {
            let along = a.normal.dot(b.normal);
            let width = (a.offset - along.signum() * b.offset).abs();
            [(along.abs() >= 1.0 - 1e-9).then_some(Clearance { width, round: None }), None]
        }
        (ProxyFace::Round(ball), ProxyFace::Flat(plane))
        | (ProxyFace::Flat(plane), ProxyFace::Round(ball)) => {
            let (BoundingSphere { center, radius }, HalfSpace { normal, offset }) = (ball, plane);
            let height = normal.dot(*center) - offset;
            let place = center - normal * radius.copysign(height);
            [
                Some(Clearance {
                    width: (height.abs() - radius).abs(),
                    round: Some((place, *radius)),
                }),
                None,
            ]
        }
        (ProxyFace::Round(a), ProxyFace::Round(b)) => {
            let (r, s) = (a.radius, b.radius);
            let between = a.center.distance(b.center);
            let place = a.center + (b.center - a.center).normalize_or(DVec3::X) * r;
            let gap = |distance: f64, radius: f64| {
                Some(Clearance { width: (between - distance).abs(), round: Some((place, radius)) })
            };
            // Beside each other, and one in the other.
            [gap(r + s, r * s / (r + s)), gap((r - s).abs(), r * s / (r - s).abs())]
        }
    }
}

/// Returns `true` if faces of two objects run at a distance within `narrow` of each other where that can be seen;
/// `pixel`: what a pixel shows at a place.
fn has_gap(forms: &[Form], narrow: Range<f64>, pixel: impl Fn(DVec3) -> f64) -> bool {
    let seen = |a: &ProxyFace, b: &ProxyFace| {
        gaps(a, b).iter().flatten().any(|gap| gap.is_seen(&narrow, &pixel))
    };
    let mut proxies: Vec<Proxy> = forms.iter().flat_map(Form::proxies).collect();
    proxies.sort_by(|a, b| a.low.x.total_cmp(&b.low.x));
    let mut pairs = 0;
    for (i, a) in proxies.iter().enumerate() {
        for b in proxies[i + 1..].iter().take_while(|b| b.low.x <= a.high.x + narrow.end) {
            pairs += 1;
            if pairs > MOST_PAIRS {
                return false;
            }
            if are_near(a, b, narrow.end)
                && a.faces.iter().any(|s| b.faces.iter().any(|t| seen(s, t)))
            {
                return true;
            }
        }
    }
    false
}
