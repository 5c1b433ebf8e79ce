//! Range of the radiance of a light group's samples. It determines the scale of the group: the
//! number of integer steps per unit of radiance in the film.
//!
//! A pixel's sum has 63 bits, a sample at most 49 bits (`SimdFloat::fixed_sum`). Each sample is
//! rounded to whole steps. If all samples of a pixel are equal, their mean has an error of up to
//! half a step, which more samples do not reduce. The size of a step therefore has two bounds:
//!
//! - *The dim end.* The darkest 8-bit level of a display is 2^-11.7 of white. If the brightest spot
//!   of a surface is white and has 2^16 steps, that level has 20, and rounding costs 0.03 levels.
//! - *The bright end.* With 2^44 steps for the brightest spot, a pixel that shows only this spot
//!   holds 2^19 samples in each replicate before its sum saturates. Five bits remain for single
//!   samples that are brighter.
//!
//! The two bounds are 28 bits apart. By default the typical radiance has 2^28 steps. The brightest
//! spot may then be up to 2^16 times as bright as the typical radiance. The brightest spot of the
//! dimmest surface may be down to 2^-12 times as bright. If a scene exceeds both bounds, the bright
//! end has precedence: a saturated sample changes the picture visibly, a sample smaller than a step
//! does not. The dim end has precedence over spots narrower than a quarter of a pixel and light
//! amplified by mirrors. Such samples may saturate; the film counts them.

use crate::analysis::clearance::clearance;
use crate::compile::RecenteredGeometry;
use glam::DVec3;
use std::collections::HashMap;
use std::f64::consts::{FRAC_1_PI, PI};
use zerkalo_kernel::lanes::Float;
use zerkalo_kernel::primitive::{BoundingSphere, Bounds, Form, box_distance};
use zerkalo_scene::asset::RadianceMap;
use zerkalo_scene::camera::CompiledCamera;
use zerkalo_scene::light::{CompiledLight, DeltaLight, Emitter};
use zerkalo_scene::material::{Fresnel, Highlight, Material, SMOOTH_ALPHA};
use zerkalo_scene::{RayTypes, Scene};

/// Bits of a sample whose radiance is typical of the scene.
const TYPICAL_BITS: f64 = 28.0;

/// Smallest number of bits of a sample at the brightest spot of the dimmest surface.
const DIM_BITS: f64 = 16.0;

/// Largest number of bits of a sample at the brightest of all spots that are at least a quarter of
/// a pixel wide.
const BRIGHT_BITS: f64 = 44.0;

/// Largest number of bits of any sample.
const SAMPLE_BITS: f64 = 49.0;

/// Largest number of bits by which the scale is lowered for bright spots narrower than a quarter of
/// a pixel.
const SPOT_BITS: f64 = 12.0;

/// Estimates of the radiance of a light group's samples at several places of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RadianceRange {
    /// Radiance of a white surface in the middle of the scene, lit by the light group.
    pub typical: f64,
    /// Minimum, over all surfaces, of the radiance of their brightest spots.
    pub dimmest: f64,
    /// Maximum, over all surfaces, of the radiance of their brightest spots that are at least a
    /// quarter of a pixel wide.
    pub brightest: f64,
    /// Largest radiance outside highlights, however small the spot is.
    pub spots: f64,
    /// Largest radiance of highlights, and of light amplified by mirrors.
    pub extreme: f64,
}

impl RadianceRange {
    /// Returns this range for the same light with another emission. `least` and `most` are the
    /// factors of its darkest and of its brightest channel.
    pub fn times(self, least: f64, most: f64) -> Self {
        Self {
            typical: self.typical * most,
            dimmest: self.dimmest * least,
            brightest: self.brightest * most,
            spots: self.spots * most,
            extreme: self.extreme * most,
        }
    }

    /// Returns the range that covers the ranges of two sources in one light group.
    pub fn or(self, other: Self) -> Self {
        Self {
            typical: self.typical.max(other.typical),
            dimmest: self.dimmest.min(other.dimmest),
            brightest: self.brightest.max(other.brightest),
            spots: self.spots.max(other.spots),
            extreme: self.extreme.max(other.extreme),
        }
    }

    /// Returns the base-2 logarithm of the number of integer steps per unit of radiance.
    pub fn scale_exponent(&self) -> f64 {
        let bits_above_bright_end = |bright: f64| {
            let excess = ceil_log2(bright / self.typical) - (BRIGHT_BITS - TYPICAL_BITS);
            excess.max(0.0)
        };
        let lost = bits_above_bright_end(self.spots)
            .min(SPOT_BITS)
            .max(bits_above_bright_end(self.brightest));
        let exponent = TYPICAL_BITS - ceil_log2(self.typical) - lost;
        let dim_end = DIM_BITS + ceil_log2(self.dimmest.recip());
        let room_for_extremes = SAMPLE_BITS - ceil_log2(self.extreme);
        let exponent = exponent.min(room_for_extremes.max(exponent.min(dim_end)));
        exponent.max(dim_end.min(BRIGHT_BITS - ceil_log2(self.brightest)))
    }
}

/// Returns the smallest integer `n` with 2^n >= `x`, at least -1022; -1022 for NaN. If `x` is
/// multiplied by 2^k, the result is larger by exactly k.
fn ceil_log2(x: f64) -> f64 {
    if x.is_nan() || x < f64::MIN_POSITIVE {
        return -1022.0;
    }
    let bits = x.to_bits();
    let floor = (bits >> 52) as f64 - 1023.0;
    floor + f64::from(u8::from(bits << 12 != 0))
}

/// Factors by which materials reflect direct light, relative to a white diffuse surface.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Response {
    /// Smallest factor over all channels that are not black.
    least: f64,
    /// Largest factor outside highlights.
    most: f64,
    /// Largest factor of highlights.
    peak: f64,
}

impl Response {
    const WHITE: Self = Self { least: 1.0, most: 1.0, peak: 1.0 };

    /// Computes the factors of `material`; `None` if it reflects no direct light.
    fn new(material: &Material) -> Option<Self> {
        let diffuse = material.color.0.map(|c| c * material.diffuse);
        let specular = material.specular;
        let highlight = match material.highlight {
            Highlight::Phong => 1.0,
            // Microfacet BRDF at normal incidence and view, relative to the 1 / pi of a white
            // diffuse surface: D F G / 4 with D = 1 / (pi alpha^2), F and G at most 1.
            Highlight::CookTorrance => 0.25 / material.microfacet_alpha().max(SMOOTH_ALPHA).powi(2),
        };
        let most = diffuse.into_iter().fold(0.0, f64::max) + specular;
        let least = least_of(diffuse).or_else(|| least_of([specular]))?;
        Some(Self { least, most, peak: most.max(specular * highlight) })
    }

    fn or(self, other: Self) -> Self {
        Self {
            least: self.least.min(other.least),
            most: self.most.max(other.most),
            peak: self.peak.max(other.peak),
        }
    }
}

fn least_of(numbers: impl IntoIterator<Item = f64>) -> Option<f64> {
    numbers.into_iter().filter(|x| *x > 0.0).reduce(f64::min)
}

/// Returns the distance of a light at `point` from a bounding box; inside the box, half of its
/// diagonal.
fn distance_to_box(bounds: Bounds, point: DVec3) -> f64 {
    match box_distance(bounds, point) {
        away if away > 0.0 => away,
        _ => 0.5 * bounds.0.distance(bounds.1),
    }
}

/// Light whose irradiance depends on the distance from it.
struct LitBy {
    center: DVec3,
    /// Radius of the light's bounding sphere; 0 for a light without a size.
    radius: f64,
    /// Smallest distance of surfaces that counts. Nearer surfaces count as if they were at this
    /// distance, except for the estimate `spots`.
    min_distance: f64,
    /// Largest distance at which the light counts as on a surface; negative if it never does.
    min_clearance: f64,
}

/// Properties of a scene without its lights, from which the [`RadianceRange`] of each light group
/// is computed.
pub(crate) struct SceneDistances<'a> {
    forms: &'a [Form],
    /// Bounding box of each object; `None` for infinite objects.
    boxes: Vec<Option<Bounds>>,
    /// Direct light that objects reflect, over all their parts, relative to a white diffuse surface,
    /// each with the objects that reflect it.
    responses: Vec<(Response, Vec<usize>)>,
    /// Factors by which materials reflect ambient light.
    ambient: Response,
    /// Smallest factor, at most 1, by which pure mirrors and glass, which reflect no direct light,
    /// multiply the light that they pass on.
    faintest: f64,
    /// Largest factor, at least 1, by which all mirrors of a path together multiply light.
    gain: f64,
    /// Smallest distance of lights from the scene's centre, for the typical radiance. Nearer lights
    /// count as if they were at this distance.
    radius: f64,
    /// Position of the eye, and the side of a pixel at unit distance from it.
    eye: (DVec3, f64),
    /// Distance below which a light counts as on a surface: half of the largest distance above a
    /// surface at which rays start.
    ray_offset: f64,
}

impl<'a> SceneDistances<'a> {
    /// Collects the properties of `scene`. `materials_of` returns the materials of the parts of an
    /// object. `epsilon` is the rounding error of the world's precision.
    pub fn new(
        scene: &Scene,
        geometry: &'a RecenteredGeometry,
        materials_of: impl Fn(usize) -> Vec<&'a Material>,
        camera: &CompiledCamera,
        epsilon: f64,
    ) -> Self {
        let (forms, extent) = (&geometry.forms[..], geometry.extent);
        let response_of_form = |form: usize| {
            let parts = materials_of(form);
            parts.into_iter().filter_map(Response::new).reduce(Response::or)
        };
        let mut responses: Vec<(Response, Vec<usize>)> = Vec::new();
        let mut index_of = HashMap::new();
        for form in 0..forms.len() {
            let Some(response) = response_of_form(form) else { continue };
            let Response { least, most, peak } = response;
            let index =
                *index_of.entry([least, most, peak].map(f64::to_bits)).or_insert_with(|| {
                    responses.push((response, Vec::new()));
                    responses.len() - 1
                });
            responses[index].1.push(form);
        }
        let materials: Vec<&Material> = (0..forms.len()).flat_map(&materials_of).collect();
        let ambient = || materials.iter().flat_map(|m| m.color.0.map(|c| c * m.ambient));
        let most = ambient().fold(0.0, f64::max);
        let ambient = Response { least: least_of(ambient()).unwrap_or(1.0), most, peak: most };
        let reflects = scene.trace.ray_types == RayTypes::Full && scene.trace.max_depth > 0;
        let passed_on = |m: &Material| {
            let mirrored = m.f0().0.map(|f0| f0 * m.reflection);
            reflects.then_some(mirrored.into_iter().chain([m.transmission]))
        };
        let without_direct = materials.iter().filter(|m| Response::new(m).is_none());
        let faintest = least_of(without_direct.copied().filter_map(passed_on).flatten());
        // Fresnel's equations for a dielectric divide the light between reflection and
        // transmission. In the other modes the coefficients of both may have a sum above 1.
        let max_factors = materials.iter().map(|m| match m.fresnel_mode() {
            Fresnel::Dielectric => m.reflection.max(m.transmission),
            Fresnel::Constant | Fresnel::Schlick | Fresnel::Exact => m.reflection + m.transmission,
        });
        let gain = match reflects {
            true => max_factors.fold(1.0, f64::max).powf(f64::from(scene.trace.max_depth)),
            false => 1.0,
        };
        Self {
            forms,
            boxes: forms.iter().map(|form| form.bounds()).collect(),
            responses,
            ambient,
            faintest: faintest.unwrap_or(1.0).min(1.0),
            gain,
            radius: 0.1 * extent,
            eye: (camera.eye, camera.pixel()),
            ray_offset: 4.0 * epsilon * extent,
        }
    }

    /// Returns the factors of all objects together; 1 if no object reflects direct light.
    fn response(&self) -> Response {
        let responses = self.responses.iter().map(|(response, _)| *response);
        responses.reduce(Response::or).unwrap_or(Response::WHITE)
    }

    /// Returns the range for ambient light of intensity 1.
    pub fn ambient(&self) -> RadianceRange {
        self.range_of(1.0, self.ambient)
    }

    /// Returns the range for a background of intensity 1.
    pub fn background(&self) -> RadianceRange {
        self.range_of(1.0, Response::WHITE)
    }

    /// Returns the range for a light of intensity 1. `visible` is `true` if the camera and mirrors
    /// see it.
    pub fn light<S: Float>(&self, light: &CompiledLight<S>, visible: bool) -> RadianceRange {
        match light {
            CompiledLight::Delta(delta) => self.delta(delta),
            CompiledLight::Emitter(emitter) => self.emitter(emitter, visible),
            CompiledLight::Environment(sky) => self.environment(sky.map(), visible),
        }
    }

    fn delta<S: Float>(&self, light: &DeltaLight<S>) -> RadianceRange {
        let typical = light.typical_irradiance(self.radius) * FRAC_1_PI;
        let Some(position) = light.position().filter(|_| light.is_inverse_square()) else {
            return self.range_of(typical, self.response());
        };
        let radiance_at = |distance: f64| (distance * distance * PI).recip();
        let (eye, pixel) = self.eye;
        let source = LitBy {
            center: position,
            radius: 0.0,
            // The bright spot on a surface below a light is about as wide as the distance between
            // them. Spots smaller than a quarter of a pixel are ignored.
            min_distance: (0.25 * pixel * eye.distance(position)).max(self.ray_offset),
            // A light on a surface does not illuminate that surface, because shadow rays from the
            // surface start above the light.
            min_clearance: self.ray_offset,
        };
        let range = self.lit_by(&source, typical, radiance_at);
        let spots = range.spots.max(radiance_at(clearance(self.forms, position)));
        RadianceRange { spots, ..range }
    }

    fn emitter<S: Float>(&self, emitter: &Emitter<S>, visible: bool) -> RadianceRange {
        let emitted = emitter.radiance.to_f64();
        if !emitter.is_distant() {
            let ball = BoundingSphere { center: emitter.center, radius: emitter.radius };
            return self.emitting_surface(ball, emitter.area, emitted, visible);
        }
        // An infinitely distant disk gives a facing surface the irradiance pi.
        let range = self.range_of(1.0, self.response());
        // `emitted` is 1 / sin^2 of the disk's angular radius. The sine is compared with a quarter
        // of a pixel.
        let is_wide = emitted.sqrt().recip() > 0.25 * self.eye.1;
        if visible { self.seen(range, emitted, is_wide) } else { range }
    }

    /// Returns the range for object `index` of radiance 1. The area of the object's bounding sphere
    /// stands for the area of the object.
    pub fn object(&self, index: usize) -> RadianceRange {
        let bounds = self.forms[index].bounds();
        if bounds.is_some() {
            let ball = BoundingSphere::around_box(bounds);
            return self.emitting_surface(ball, 4.0 * PI * ball.radius * ball.radius, 1.0, true);
        }
        // The irradiance from an infinite emissive plane is the same at every distance.
        let Response { least, most, peak } = self.response();
        self.range_of(1.0, Response { least, most: most.max(1.0), peak: peak.max(1.0) })
    }

    /// Returns the range for an emissive surface inside the sphere `ball`, with the given area and
    /// the radiance `emitted`. If the surface is visible, its radiance is itself part of the range.
    fn emitting_surface(
        &self,
        ball: BoundingSphere,
        area: f64,
        emitted: f64,
        visible: bool,
    ) -> RadianceRange {
        let BoundingSphere { center, radius } = ball;
        // Radiance of a white surface that faces the emitter at `distance` from the emitter's
        // centre.
        let radiance_at = |distance: f64| {
            emitted * (area / (PI * distance * distance).max(f64::MIN_POSITIVE)).min(1.0)
        };
        let typical = radiance_at(center.length().max(self.radius));
        let source = LitBy { center, radius, min_distance: 0.0, min_clearance: -1.0 };
        let range = self.lit_by(&source, typical, radiance_at);
        let (eye, pixel) = self.eye;
        let is_wide = radius > 0.25 * pixel * eye.distance(center);
        if visible { self.seen(range, emitted, is_wide) } else { range }
    }

    fn environment(&self, map: &RadianceMap, visible: bool) -> RadianceRange {
        let mean = map.mean.into_iter().fold(0.0, f64::max);
        let typical = if mean > 0.0 { mean } else { 1.0 };
        let range = self.range_of(typical, self.response());
        if !visible {
            return range;
        }
        // Bright pixels of the image may be smaller than a pixel of the picture. They count as
        // `spots` but not as `brightest`, which is at least the mean of the image.
        let dimmest = map.min().unwrap_or(typical).max(1e-6 * typical);
        RadianceRange {
            dimmest: range.dimmest.min(dimmest * self.faintest),
            brightest: range.brightest.max(typical),
            ..self.seen(range, map.max(), false)
        }
    }

    /// Returns the range for surfaces at different distances from a light. `radiance_at` returns
    /// the radiance of a white surface that faces the light, for the distance between them.
    fn lit_by(
        &self,
        light: &LitBy,
        typical: f64,
        radiance_at: impl Fn(f64) -> f64,
    ) -> RadianceRange {
        let LitBy { center, radius, min_distance, min_clearance } = *light;
        let (mut dimmest, mut brightest) = (f64::INFINITY, 0.0f64);
        let (mut spots, mut extreme) = (0.0f64, 0.0f64);
        for (response, objects) in &self.responses {
            let (least_clearance, far) = self.reach(objects, &(center, radius), min_clearance);
            if least_clearance < f64::INFINITY {
                let near = least_clearance - radius;
                let nearest = radiance_at(near.max(min_distance));
                brightest = brightest.max(nearest * response.most);
                spots = spots.max(radiance_at(near.max(0.0)) * response.most);
                extreme = extreme.max(nearest * response.peak * self.gain);
            }
            let farthest = radiance_at(far.max(radius).max(min_distance));
            dimmest = dimmest.min(farthest * response.least * self.faintest);
        }
        let or_typical = |x: f64| if x > 0.0 && x.is_finite() { x } else { typical };
        RadianceRange {
            typical,
            dimmest: or_typical(dimmest),
            brightest: or_typical(brightest),
            spots: or_typical(spots),
            extreme: or_typical(extreme),
        }
    }

    /// Returns the least distance above `min_clearance` between `center` and the surfaces of
    /// `objects`, and the largest distance between the ball and one of them.
    fn reach(
        &self,
        objects: &[usize],
        (center, radius): &(DVec3, f64),
        min_clearance: f64,
    ) -> (f64, f64) {
        let (mut nearest, mut farthest) = (f64::INFINITY, f64::NEG_INFINITY);
        for object in objects {
            let bounds = self.boxes[*object];
            // An object whose box is farther away than another object is not the nearest.
            let mut clearance = bounds.map_or(0.0, |bounds| box_distance(bounds, *center));
            if clearance <= nearest * (1.0 + 1e-9) {
                let form = &self.forms[*object];
                clearance = form.clearance(*center).unwrap_or(0.0);
                if clearance > min_clearance {
                    nearest = nearest.min(clearance - form.max_lift());
                }
            }
            let far = bounds.map_or(clearance - radius, |bounds| distance_to_box(bounds, *center));
            farthest = farthest.max(far);
        }
        (nearest, farthest)
    }

    /// Returns `range` for a light with the radiance `emitted` that the camera and mirrors see.
    /// `emitted` counts as `brightest` only if the light is wider than a quarter of a pixel
    /// (`is_wide`).
    fn seen(&self, range: RadianceRange, emitted: f64, is_wide: bool) -> RadianceRange {
        RadianceRange {
            brightest: if is_wide { range.brightest.max(emitted) } else { range.brightest },
            spots: range.spots.max(emitted),
            extreme: range.extreme.max(emitted * self.gain),
            ..range
        }
    }

    /// Returns the range for surfaces that multiply `light`, the radiance of a white surface, by
    /// the factors of `response`.
    fn range_of(&self, light: f64, response: Response) -> RadianceRange {
        let Response { least, most, peak } = response;
        RadianceRange {
            typical: light,
            dimmest: light * least * self.faintest,
            brightest: light * most,
            spots: light * most,
            extreme: light * peak * self.gain,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: RadianceRange =
        RadianceRange { typical: 1.0, dimmest: 1.0, brightest: 1.0, spots: 1.0, extreme: 1.0 };

    #[test]
    fn ceil_log2_is_exact() {
        for (x, exponent) in [(1.0, 0.0), (1.5, 1.0), (2.0, 1.0), (0.75, 0.0), (0.5, -1.0)] {
            assert_eq!(ceil_log2(x), exponent, "{x}");
            assert_eq!(ceil_log2(x * 2f64.powi(-300)), exponent - 300.0, "{x}");
        }
        assert_eq!(ceil_log2(f64::INFINITY), 1024.0);
        assert_eq!([0.0, -1.0, 1e-320, f64::NAN].map(ceil_log2), [-1022.0; 4]);
    }

    #[test]
    fn scale_exponent_covers_dim_and_bright_end() {
        let exponent = |change: &dyn Fn(&mut RadianceRange)| {
            let mut range = ONE;
            change(&mut range);
            range.scale_exponent()
        };
        assert_eq!(exponent(&|_| ()), 28.0);
        assert_eq!(ONE.times(0.5, 0.75).scale_exponent(), 28.0);
        assert_eq!(ONE.times(2f64.powi(40), 2f64.powi(40)).scale_exponent(), -12.0);
        // Radiance of a dim surface, and two values for the radiance of bright surfaces.
        let [dim, bright, far] = [-40, 20, 60].map(|e| 2f64.powi(e));
        assert_eq!(exponent(&|b| b.dimmest = dim), 44.0);
        assert_eq!(exponent(&|b| b.dimmest = 2f64.powi(-20)), 36.0);
        assert_eq!(exponent(&|b| b.dimmest = 2f64.powi(-12)), 28.0);
        assert_eq!(exponent(&|b| (b.brightest, b.spots) = (bright, bright)), 24.0);
        assert_eq!(exponent(&|b| (b.brightest, b.spots) = (far, far)), -16.0);
        // Spots narrower than a quarter of a pixel and amplified light do not lower the scale below
        // the bound for dim surfaces, 2^16 steps.
        assert_eq!(exponent(&|b| b.spots = far), 16.0);
        assert_eq!(exponent(&|b| b.spots = f64::INFINITY), 16.0);
        assert_eq!(exponent(&|b| b.extreme = bright), 28.0);
        assert_eq!(exponent(&|b| b.extreme = 2f64.powi(25)), 24.0);
        assert_eq!(exponent(&|b| b.extreme = f64::INFINITY), 16.0);
    }
}
