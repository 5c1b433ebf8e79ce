//! Brightness range of the samples of a light group, and the step of the film's integers that follows.
//!
//! A pixel's sum has 63 bits, a sample at most 49 of them (`SimdFloat::fixed_sum`). A sample is rounded to whole steps
//! by itself; one that is the same each time, as on a matt surface, is wrong by up to half a step however many
//! there are. So the step has to suit both ends:
//!
//! - *The dim end.* The darkest code of a display is 2^-11.7 of white. A surface whose brightest spot is white
//!   when it has 2^16 steps still has 20 of them there, which is 0.03 codes.
//! - *The bright end.* With 2^44 steps for the brightest spot, a pixel that shows nothing else holds 2^19
//!   samples of each replicate before its sum is full: a million per pixel. Five bits are left for what a single
//!   sample may have beyond that.
//!
//! Between them lie 28 bits. Without reason to the contrary, light of a typical strength has 2^28 steps: 2^16
//! times as bright is the bright end, 2^-12 times the dim end. Where both ends cannot be had the bright end
//! counts, for a sample that does not fit changes the picture and one too small for a step does not, to the eye.
//! Two kinds of brightness yield to the dim end: spots smaller than a pixel, and the products of mirrors that
//! amplify. Such samples may saturate, and are counted then.

use crate::camera::PinholeCamera;
use crate::lanes::Float;
use crate::light::DeltaLight;
use crate::material::{Fresnel, Highlight, Material, SMOOTH_ALPHA};
use crate::primitive::{Form, box_distance};
use crate::scene::{RayTypes, Scene};
use crate::world::clearance::clearance;
use glam::DVec3;
use std::f64::consts::{FRAC_1_PI, PI};

/// Bits of a sample of typical brightness.
const TYPICAL_BITS: f64 = 28.0;

/// Bits that the brightest spot of the dimmest surface has at least.
const DIM_BITS: f64 = 16.0;

/// Bits of the brightest sample, when it lasts.
const BRIGHT_BITS: f64 = 44.0;

/// Bits of a single sample.
const SAMPLE_BITS: f64 = 49.0;

/// So many bits are given up for any spot, however small.
const SPOT_BITS: f64 = 12.0;

/// Brightness of a group's samples, in radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RadianceRange {
    /// In the middle of the scene, on white.
    pub typical: f64,
    /// Brightest spot of the dimmest surface.
    pub dimmest: f64,
    /// Brightest spot of the brightest surface, in spots as large as a part of a pixel.
    pub brightest: f64,
    /// In spots of any size.
    pub spots: f64,
    /// In highlights and after mirrors that amplify.
    pub extreme: f64,
}

impl RadianceRange {
    /// Range of light that is `least` to `most` times as strong, depending on the channel.
    pub fn times(self, least: f64, most: f64) -> Self {
        Self {
            typical: self.typical * most,
            dimmest: self.dimmest * least,
            brightest: self.brightest * most,
            spots: self.spots * most,
            extreme: self.extreme * most,
        }
    }

    /// Range of two lights that share a group.
    pub fn or(self, other: Self) -> Self {
        Self {
            typical: self.typical.max(other.typical),
            dimmest: self.dimmest.min(other.dimmest),
            brightest: self.brightest.max(other.brightest),
            spots: self.spots.max(other.spots),
            extreme: self.extreme.max(other.extreme),
        }
    }

    /// The exponent of the number of steps per unit of radiance.
    pub fn scale_exponent(&self) -> f64 {
        let above = |bright: f64| {
            let excess = ceil_log2(bright / self.typical) - (BRIGHT_BITS - TYPICAL_BITS);
            excess.max(0.0)
        };
        let lost = above(self.spots).min(SPOT_BITS).max(above(self.brightest));
        let exponent = TYPICAL_BITS - ceil_log2(self.typical) - lost;
        let dim_end = DIM_BITS + ceil_log2(self.dimmest.recip());
        let room_for_extremes = SAMPLE_BITS - ceil_log2(self.extreme);
        let exponent = exponent.min(room_for_extremes.max(exponent.min(dim_end)));
        exponent.max(dim_end.min(BRIGHT_BITS - ceil_log2(self.brightest)))
    }
}

/// The smallest exponent whose power of two is at least `x`, without the rounding of a logarithm: light that is
/// 2^k times as strong has exponents that differ by k.
fn ceil_log2(x: f64) -> f64 {
    if x.is_nan() || x < f64::MIN_POSITIVE {
        return -1022.0;
    }
    let bits = x.to_bits();
    let floor = (bits >> 52) as f64 - 1023.0;
    floor + f64::from(u8::from(bits << 12 != 0))
}

/// Response of some surfaces to light: factors of what a white matt surface shows.
#[derive(Clone, Copy, Debug)]
struct Response {
    /// The least in a channel that is not black.
    least: f64,
    most: f64,
    /// In the middle of highlights.
    peak: f64,
}

impl Response {
    /// To lights; `None`: none.
    fn new(material: &Material) -> Option<Self> {
        let matt = material.color.0.map(|c| c * material.diffuse);
        let shine = material.specular;
        let highlight = match material.highlight {
            Highlight::Phong => 1.0,
            // D F G / 4 of microfacets seen and lit straight on, with D = 1 / (pi alpha^2).
            Highlight::CookTorrance => 0.25 / material.microfacet_alpha().max(SMOOTH_ALPHA).powi(2),
        };
        let most = matt.into_iter().fold(0.0, f64::max) + shine;
        let least = least_of(matt).or_else(|| least_of([shine]))?;
        Some(Self { least, most, peak: most.max(shine * highlight) })
    }

    fn or(self, other: Self) -> Self {
        Self {
            least: self.least.min(other.least),
            most: self.most.max(other.most),
            peak: self.peak.max(other.peak),
        }
    }
}

/// The least number above zero.
fn least_of(numbers: impl IntoIterator<Item = f64>) -> Option<f64> {
    numbers.into_iter().filter(|x| *x > 0.0).reduce(f64::min)
}

/// Everything that decides the brightness of samples, but for the lights.
pub(super) struct SceneDistances<'a> {
    forms: &'a [Form],
    /// For each form, the response of its parts to lights.
    responses: Vec<Option<Response>>,
    /// To ambient light, per channel.
    ambient: Vec<f64>,
    /// The least share of mirrored or transmitted light that a surface shows, if it shows nothing else.
    faintest: f64,
    /// Largest factor that all mirrors on a path make of light, from 1.
    gain: f64,
    /// Radius of the scene's middle, where light is typical.
    radius: f64,
    /// The eye, and the side of a pixel at unit distance.
    eye: (DVec3, f64),
    /// Rays that leave a surface begin so far above it.
    lift: f64,
}

impl<'a> SceneDistances<'a> {
    /// `materials_of`: those of a form's parts. `extent`: the largest coordinate.
    pub fn new(
        scene: &Scene,
        forms: &'a [Form],
        materials_of: impl Fn(usize) -> Vec<&'a Material>,
        view: &PinholeCamera,
        (extent, rounding): (f64, f64),
    ) -> Self {
        let of_form = |form: usize| {
            let parts = materials_of(form);
            parts.into_iter().filter_map(Response::new).reduce(Response::or)
        };
        let responses = (0..forms.len()).map(of_form).collect();
        let materials: Vec<&Material> = (0..forms.len()).flat_map(&materials_of).collect();
        let ambient = materials.iter().flat_map(|m| m.color.0.map(|c| c * m.ambient)).collect();
        let reflects = scene.trace.level == RayTypes::Full && scene.trace.depth > 0;
        let passed_on = |m: &Material| {
            let mirrored = m.f0().0.map(|f0| f0 * m.reflection);
            reflects.then_some(mirrored.into_iter().chain([m.transmission]))
        };
        let of_mirrors = materials.iter().filter(|m| Response::new(m).is_none());
        let faintest = least_of(of_mirrors.copied().filter_map(passed_on).flatten());
        // Fresnel's equations share the light between both; fixed coefficients need not.
        let strongest = materials.iter().map(|m| match m.fresnel_mode() {
            Fresnel::Dielectric => m.reflection.max(m.transmission),
            _ => m.reflection + m.transmission,
        });
        let gain = match reflects {
            true => strongest.fold(1.0, f64::max).powf(f64::from(scene.trace.depth)),
            false => 1.0,
        };
        Self {
            forms,
            responses,
            ambient,
            faintest: faintest.unwrap_or(1.0).min(1.0),
            gain,
            radius: 0.1 * extent,
            eye: (view.eye(), view.pixel()),
            lift: 4.0 * rounding * extent,
        }
    }

    /// Range of ambient light of unit strength.
    pub fn ambient(&self) -> RadianceRange {
        let least = least_of(self.ambient.iter().copied()).unwrap_or(1.0);
        let most = self.ambient.iter().copied().fold(0.0, f64::max);
        self.of(1.0, (least, most, most))
    }

    /// Range of a background of unit strength.
    pub fn background(&self) -> RadianceRange {
        self.of(1.0, (1.0, 1.0, 1.0))
    }

    /// Range of a lamp of unit strength.
    pub fn lamp<S: Float>(&self, lamp: &DeltaLight<S>) -> RadianceRange {
        let typical = lamp.typical_irradiance(self.radius) * FRAC_1_PI;
        let DeltaLight::InverseSquare { position } = lamp else {
            let all = self.responses.iter().flatten().copied().reduce(Response::or);
            let Response { least, most, peak } =
                all.unwrap_or(Response { least: 1.0, most: 1.0, peak: 1.0 });
            return self.of(typical, (least, most, peak));
        };
        let position = DVec3::from(position.map(S::to_f64));
        let light_at = |distance: f64| (distance * distance * PI).recip();
        let (eye, pixel) = self.eye;
        // A spot under the lamp is about as large as the lamp is high.
        let least_spot = (0.25 * pixel * eye.distance(position)).max(self.lift);
        let spots = light_at(clearance(self.forms, position));
        let mut out =
            RadianceRange { typical, dimmest: f64::INFINITY, brightest: 0.0, spots, extreme: 0.0 };
        for (form, response) in self.forms.iter().zip(&self.responses) {
            let Some(response) = response else { continue };
            // A lamp in a surface does not light it: rays begin above the lamp.
            if let Some(distance) = form.clearance(position).filter(|d| *d > self.lift) {
                let light = light_at(distance.max(least_spot));
                out.brightest = out.brightest.max(light * response.most);
                out.spots = out.spots.max(light_at(distance) * response.most);
                out.extreme = out.extreme.max(light * response.peak * self.gain);
            }
            // Inside the box the walls are about as far as its middle.
            let far = match form.bounds() {
                Some(bounds) => match box_distance(bounds, position) {
                    away if away > 0.0 => away,
                    _ => 0.5 * bounds.0.distance(bounds.1),
                },
                None => form.clearance(position).unwrap_or(0.0),
            };
            let light = light_at(far.max(least_spot));
            out.dimmest = out.dimmest.min(light * response.least * self.faintest);
        }
        let or_typical = |x: f64| if x > 0.0 && x.is_finite() { x } else { typical };
        RadianceRange {
            dimmest: or_typical(out.dimmest),
            brightest: or_typical(out.brightest),
            extreme: or_typical(out.extreme),
            ..out
        }
    }

    fn of(&self, light: f64, (least, most, peak): (f64, f64, f64)) -> RadianceRange {
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
    fn exponents_are_those_of_powers_that_hold_a_number() {
        for (x, exponent) in [(1.0, 0.0), (1.5, 1.0), (2.0, 1.0), (0.75, 0.0), (0.5, -1.0)] {
            assert_eq!(ceil_log2(x), exponent, "{x}");
            assert_eq!(ceil_log2(x * 2f64.powi(-300)), exponent - 300.0, "{x}");
        }
        assert_eq!(ceil_log2(f64::INFINITY), 1024.0);
        assert_eq!([0.0, -1.0, 1e-320, f64::NAN].map(ceil_log2), [-1022.0; 4]);
    }

    #[test]
    fn steps_suit_both_ends() {
        let exponent = |change: &dyn Fn(&mut RadianceRange)| {
            let mut brightness = ONE;
            change(&mut brightness);
            brightness.scale_exponent()
        };
        assert_eq!(exponent(&|_| ()), 28.0);
        assert_eq!(ONE.times(0.5, 0.75).scale_exponent(), 28.0);
        assert_eq!(ONE.times(2f64.powi(40), 2f64.powi(40)).scale_exponent(), -12.0);
        // A dim surface alone, and beside a bright one.
        let [dim, bright, far] = [-40, 20, 60].map(|e| 2f64.powi(e));
        assert_eq!(exponent(&|b| b.dimmest = dim), 44.0);
        assert_eq!(exponent(&|b| b.dimmest = 2f64.powi(-20)), 36.0);
        assert_eq!(exponent(&|b| b.dimmest = 2f64.powi(-12)), 28.0);
        assert_eq!(exponent(&|b| (b.brightest, b.spots) = (bright, bright)), 24.0);
        assert_eq!(exponent(&|b| (b.brightest, b.spots) = (far, far)), -16.0);
        // Spots that no pixel shows, and what mirrors amplify, leave the dim end its bits.
        assert_eq!(exponent(&|b| b.spots = far), 16.0);
        assert_eq!(exponent(&|b| b.spots = f64::INFINITY), 16.0);
        assert_eq!(exponent(&|b| b.extreme = bright), 28.0);
        assert_eq!(exponent(&|b| b.extreme = 2f64.powi(25)), 24.0);
        assert_eq!(exponent(&|b| b.extreme = f64::INFINITY), 16.0);
    }
}
