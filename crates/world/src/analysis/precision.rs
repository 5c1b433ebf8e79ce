//! Choice between single and double precision: single if its errors are too small to be visible.
//!
//! In single precision a coordinate is exact to about 2^-23 of the scene's extent, and rays that
//! leave a surface start 2^-20 of the extent above it (the *ray offset*). Details smaller than a
//! few ray offsets are lost. For each kind of detail, a constant below is the largest permitted
//! ratio of the scene's extent to the size of the detail. `tests/extremes/precision.rs` measures
//! the errors at each ratio.

use crate::analysis::clearance::clearance;
use crate::compile::RecenteredGeometry;
use glam::DVec3;
use std::ops::Range;
use zerkalo_kernel::primitive::{BoundingSphere, Form, HalfSpace, Proxy, ProxyFace};
use zerkalo_scene::Scene;
use zerkalo_scene::camera::CompiledCamera;
use zerkalo_scene::light::EmissiveSurface;
use zerkalo_scene::value::{sort_by_number, total_order};

/// Largest ratio of extent to thickness of an object: the ray offset is 1/128 of the thickness.
const MAX_EXTENT_PER_THICKNESS: f64 = 8192.0;

/// Largest ratio of extent to width of a gap between objects: the gap is 8 ray offsets wide.
const MAX_EXTENT_PER_GAP: f64 = 131_072.0;

/// Largest ratio of extent to side of a pixel's footprint on the object closest to the eye. The
/// side is then 32 ray offsets long.
const MAX_EXTENT_PER_PIXEL: f64 = 32_768.0;

/// Factor by which flat objects may be closer to the eye than curved ones: a hit point on a flat
/// object is moved back to the plane almost exactly, and the normal is constant.
const FLAT: f64 = 8.0;

/// Largest ratio of extent to distance between a light and objects. The direction to the light is
/// then wrong by 1/512 radians.
const MAX_EXTENT_PER_LIGHT_DISTANCE: f64 = 2048.0;

/// Smallest angle between the rays of neighbouring pixels \[radians\], 64 times the rounding error
/// of a direction. A lens with the radius r, focused at the distance d, raises this limit by the
/// factor 1 + r / d.
const LEAST_ANGLE: f64 = 1.0 / 131_072.0;

/// Smallest width of a gap, as a fraction of the scene's extent, at which two surfaces are
/// separate: 2^-44. Surfaces with a narrower gap, or with a gap below 16 rounding errors of the
/// scene file's coordinates, are treated as coincident.
const COINCIDENT_GAP: f64 = 1.0 / 17_592_186_044_416.0;

/// Largest number of pairs of objects that are searched for gaps. Further pairs count as pairs
/// without a gap.
const MOST_PAIRS: usize = 1 << 20;

/// Returns `true` if the errors of single precision would be invisible in the picture of `scene`.
pub(crate) fn single_suffices(scene: &Scene, geometry: &RecenteredGeometry) -> bool {
    let RecenteredGeometry { origin, ref forms, extent, .. } = *geometry;
    let thinnest = forms.iter().map(|form| form.thickness()).fold(f64::INFINITY, f64::min);
    if extent > MAX_EXTENT_PER_THICKNESS * thinnest {
        return false;
    }
    let view = CompiledCamera::new(&scene.camera, scene.film.size, origin);
    let angle = view.pixel_angle();
    // Distances are measured from the eye, the centre of the lens. An object that is closer to
    // another point of the lens is blurred by more than a pixel, which hides its errors.
    let distance =
        |form: &Form| Some(form.clearance(view.eye)? * if form.is_flat() { FLAT } else { 1.0 });
    let seen_from =
        forms.iter().filter_map(distance).fold(f64::INFINITY, f64::min).max(scene.camera.near);
    let lens_slope = view.lens.map_or(0.0, |lens| lens.radius / lens.focus);
    if angle < LEAST_ANGLE * (1.0 + lens_slope) || extent > MAX_EXTENT_PER_PIXEL * angle * seen_from
    {
        return false;
    }
    let lights = || scene.lights.iter().filter(|light| light.on);
    let lamps = lights().filter_map(|light| light.apex());
    let mut distances = lamps.map(|lamp| clearance(forms, lamp - origin));
    if distances.any(|distance| extent > MAX_EXTENT_PER_LIGHT_DISTANCE * distance) {
        return false;
    }
    let mut surfaces = lights().filter_map(|light| light.surface());
    let is_fine = |surface: EmissiveSurface| {
        // Rounding of the coordinates may displace a part of the surface, so the largest coordinate
        // of the surface counts as well.
        let largest = (surface.center() - origin).abs().max_element() + surface.radius();
        extent.max(largest) > MAX_EXTENT_PER_THICKNESS * surface.thickness()
    };
    if surfaces.any(is_fine) {
        return false;
    }
    let rounded = 16.0 * f64::EPSILON * origin.abs().max_element();
    let narrow = (COINCIDENT_GAP * extent).max(rounded)..extent / MAX_EXTENT_PER_GAP;
    let pixel = |point: DVec3| angle * point.distance(view.eye);
    !has_gap(forms, narrow, pixel)
}

/// Gap between two faces of different objects, at the point where they are closest.
struct Clearance {
    width: f64,
    /// Point at which the gap is narrowest, and the radius of a sphere whose gap to a plane widens
    /// as fast. `None` if the faces are parallel planes.
    round: Option<(DVec3, f64)>,
}

impl Clearance {
    /// Returns `true` if the smallest width of the gap is in the range `narrow`, and the region in
    /// which the gap is narrower than the end of this range is wider than a pixel. `pixel` returns
    /// the side of a pixel's footprint at a point.
    fn is_seen(&self, narrow: &Range<f64>, pixel: &impl Fn(DVec3) -> f64) -> bool {
        let wide =
            |(place, radius): (DVec3, f64)| (2.0 * radius * narrow.end).sqrt() > 0.5 * pixel(place);
        narrow.contains(&self.width) && self.round.is_none_or(wide)
    }
}

/// Returns the gaps between two faces of different objects, at the points where the faces are
/// closest. Two spheres have two gaps: side by side, and one inside the other.
fn gaps(a: &ProxyFace, b: &ProxyFace) -> [Option<Clearance>; 2] {
    let round_gap = |distance: f64, place: DVec3, radius: f64| {
        Some(Clearance { width: distance.abs(), round: Some((place, radius)) })
    };
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
            [round_gap(height.abs() - radius, place, *radius), None]
        }
        (ProxyFace::Round(a), ProxyFace::Round(b)) => {
            let (r, s) = (a.radius, b.radius);
            let between = a.center.distance(b.center);
            let place = a.center + (b.center - a.center).normalize_or(DVec3::X) * r;
            // Spheres side by side, and one sphere inside the other.
            let (sum, difference) = (r + s, (r - s).abs());
            [sum, difference].map(|distance| round_gap(between - distance, place, r * s / distance))
        }
    }
}

/// Returns `true` if any two objects have a visible gap, as [`Clearance::is_seen`] defines it.
fn has_gap(forms: &[Form], narrow: Range<f64>, pixel: impl Fn(DVec3) -> f64) -> bool {
    let seen = |a: &ProxyFace, b: &ProxyFace| {
        gaps(a, b).iter().flatten().any(|gap| gap.is_seen(&narrow, &pixel))
    };
    let mut proxies: Vec<Proxy> = forms.iter().flat_map(|form| form.proxies()).collect();
    sort_by_number(&mut proxies, |proxy| total_order(proxy.low.x));
    let mut pairs = 0;
    for (i, a) in proxies.iter().enumerate() {
        for b in proxies[i + 1..].iter().take_while(|b| b.low.x <= a.high.x + narrow.end) {
            pairs += 1;
            if pairs > MOST_PAIRS {
                return false;
            }
            // Largest distance between the bounding boxes along an axis.
            let distance = (a.low - b.high).max(b.low - a.high).max_element();
            if distance <= narrow.end && a.faces.iter().any(|s| b.faces.iter().any(|t| seen(s, t)))
            {
                return true;
            }
        }
    }
    false
}
