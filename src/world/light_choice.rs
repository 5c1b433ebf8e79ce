//! Choice of lights at a surface point, in scenes with many point lights.
//!
//! The lights are divided into sets of four to eight lights, and each path asks the lights of one
//! set at each surface, all sets with the same probability. A set holds at most one light of each
//! stratum, and the strata are consecutive parts of the lights in the order of a Morton curve, so
//! that the lights of a set are spread over the scene.
//!
//! The number of sets is a power of two. Successive samples of a pixel are stratified over the
//! sets, as Sobol points are, so that as many samples as there are sets ask every light once. With
//! another number of sets the noise would be several times as large.
//!
//! The probabilities depend neither on intensities nor on the place, so that light groups mix
//! exactly.

use crate::lanes::{Float, MAX_WIDTH, SimdFloat, Vec3, array_from_fn};
use crate::light::DeltaLight;
use crate::primitive::BoundingSphere;
use crate::world::world::DeltaSource;
use glam::DVec3;
use std::f64::consts::PI;

/// Least number of point lights of which some are chosen. In scenes with fewer every light is
/// asked. `benches/many-lights.sh` measures the cost of both.
const MIN_LIGHTS: usize = 16;

/// Least number of lights in a full set.
const MIN_SET: usize = 4;

/// Largest number of strata: the largest number of lights in a set.
const MAX_STRATA: usize = 2 * MIN_SET;

/// Lights that a path asks together, one of each stratum.
#[derive(Clone, Copy)]
struct LightSet<S> {
    /// Positions of the lights; NaN in strata that have no light in this set, so that no surface
    /// faces it.
    positions: [[S; 3]; MAX_STRATA],
    /// Light group of each light, as an index.
    groups: [u32; MAX_STRATA],
    /// Emission that the samples of the group contain.
    emissions: [[S; 3]; MAX_STRATA],
    /// `true` for each light whose irradiance is the same at every distance.
    constant: [bool; MAX_STRATA],
}

/// Properties that the lights of one stratum have in common.
struct Stratum<S> {
    /// Sphere around the lights.
    ball: BoundingSphere,
    /// Light group of all lights; `None` if they have several.
    group: Option<u32>,
    /// Emission of all lights; `None` if they have several.
    emission: Option<[S; 3]>,
}

/// Point lights of which a few are chosen at each surface.
pub(super) struct LightChoice<S> {
    sets: Vec<LightSet<S>>,
    strata: Vec<Stratum<S>>,
    /// `true` if the irradiance of a light is the same at every distance.
    any_constant: bool,
}

/// For each lane of a packet, the set of lights to which it traces shadow rays.
pub(super) struct ChosenSets<'a, S> {
    choice: &'a LightChoice<S>,
    /// Set of each lane.
    sets: [&'a LightSet<S>; MAX_WIDTH],
}

impl<S: Float> LightChoice<S> {
    /// Takes the lights of which some are chosen out of `sources`: point lights that are not on a
    /// surface. Returns `None` if they are so few that all of them are asked.
    pub fn take(sources: &mut Vec<DeltaSource<S>>) -> Option<Self> {
        let position = |source: &DeltaSource<S>| match source.light.light {
            DeltaLight::InverseSquare { position } | DeltaLight::Constant { position } => {
                source.light.on_surface.is_none().then_some(position)
            }
            DeltaLight::Directional { .. } | DeltaLight::Spot { .. } => None,
        };
        if sources.iter().filter_map(position).count() < MIN_LIGHTS {
            return None;
        }
        let (mut chosen, others): (Vec<_>, Vec<_>) =
            sources.drain(..).partition(|source| position(source).is_some());
        *sources = others;
        let place = |source: &DeltaSource<S>| source.light.light.position().unwrap_or_default();
        let low = chosen.iter().map(place).reduce(DVec3::min)?;
        let high = chosen.iter().map(place).reduce(DVec3::max)?;
        chosen.sort_by_key(|source| morton(place(source), low, high));

        let count = 1 << (chosen.len() / MIN_SET).ilog2();
        let strata: Vec<&[DeltaSource<S>]> = chosen.chunks(count).collect();
        let white = [S::from_f64(1.0); 3];
        let set = |i: usize| {
            let light = |k: usize| strata.get(k).and_then(|stratum| stratum.get(i));
            LightSet {
                positions: array_from_fn(|k| {
                    light(k).and_then(position).unwrap_or([S::from_f64(f64::NAN); 3])
                }),
                groups: array_from_fn(|k| light(k).map_or(0, |light| light.group as u32)),
                emissions: array_from_fn(|k| {
                    light(k).and_then(|light| light.emission).unwrap_or(white)
                }),
                constant: array_from_fn(|k| {
                    light(k).is_some_and(|light| !light.light.light.is_inverse_square())
                }),
            }
        };
        let sets: Vec<LightSet<S>> = (0..count).map(set).collect();
        let strata = strata.iter().map(|lights| Stratum {
            ball: ball(lights.iter().map(place)),
            group: common(lights.iter().map(|light| light.group)).map(|group| group as u32),
            emission: common(lights.iter().map(|light| light.emission.unwrap_or(white))),
        });
        let strata = strata.collect();
        let any_constant = sets.iter().any(|set| set.constant.contains(&true));
        Some(Self { sets, strata, any_constant })
    }

    /// Number of strata.
    pub fn strata(&self) -> usize {
        self.strata.len()
    }

    /// Number of light sets. As many successive samples of a pixel use each set once, and so trace
    /// a shadow ray to each light once.
    pub fn period(&self) -> u32 {
        self.sets.len() as u32
    }

    /// Returns a sphere around the lights of each stratum.
    pub fn balls(&self) -> impl Iterator<Item = BoundingSphere> {
        self.strata.iter().map(|stratum| stratum.ball)
    }

    /// Chooses a set for each lane. `number` is uniform in [0, 1).
    #[inline(always)]
    pub fn choose<L: SimdFloat<Scalar = S>>(&self, number: L) -> ChosenSets<'_, S> {
        // The product with a power of two is exact.
        let place = number * L::from_f64(self.sets.len() as f64);
        let set =
            |lane: usize| if lane < L::WIDTH { place.lane(lane).to_f64() as usize } else { 0 };
        ChosenSets { choice: self, sets: array_from_fn(|lane| &self.sets[set(lane)]) }
    }
}

impl<S: Float> ChosenSets<'_, S> {
    /// Positions of the lights of a stratum.
    #[inline(always)]
    pub fn positions<L: SimdFloat<Scalar = S>>(&self, stratum: usize) -> Vec3<L> {
        Vec3::from_fn(|lane| self.sets[lane].positions[stratum])
    }

    /// Returns the irradiance at normal incidence of lights with unit emission, divided by the
    /// probability of the choice. `inverse` is the inverse of the distance.
    #[inline(always)]
    pub fn irradiance<L: SimdFloat<Scalar = S>>(&self, stratum: usize, inverse: L) -> L {
        let count = L::from_f64(self.choice.sets.len() as f64);
        // The irradiance is kept finite, because infinity times black would be NaN.
        let mut irradiance = (inverse * inverse).min(L::from_f64(L::MAX) / count);
        if self.choice.any_constant {
            let constant = L::from_fn(|lane| {
                S::from_f64(if self.sets[lane].constant[stratum] { PI } else { 0.0 })
            });
            irradiance = L::select(constant.gt(L::zero()), constant, irradiance);
        }
        irradiance * count
    }

    /// Emission of the lights of a stratum that the samples of their groups contain.
    #[inline(always)]
    pub fn emission<L: SimdFloat<Scalar = S>>(&self, stratum: usize) -> Vec3<L> {
        match self.choice.strata[stratum].emission {
            Some(emission) => Vec3::splat(emission),
            None => Vec3::from_fn(|lane| self.sets[lane].emissions[stratum]),
        }
    }

    /// Light groups of the lights of a stratum, as ids.
    #[inline(always)]
    pub fn groups<L: SimdFloat<Scalar = S>>(&self, stratum: usize) -> L {
        match self.choice.strata[stratum].group {
            Some(group) => L::from_id(group),
            None => L::from_fn(|lane| L::from_id(self.sets[lane].groups[stratum]).lane(0)),
        }
    }
}

/// Returns the value that all items have. Returns `None` if they differ.
fn common<T: PartialEq>(mut items: impl Iterator<Item = T>) -> Option<T> {
    let first = items.next()?;
    items.all(|item| item == first).then_some(first)
}

/// Returns a sphere around points.
fn ball(points: impl Iterator<Item = DVec3> + Clone) -> BoundingSphere {
    let low = points.clone().reduce(DVec3::min).unwrap_or_default();
    let high = points.clone().reduce(DVec3::max).unwrap_or_default();
    let center = 0.5 * (low + high);
    let radius = points.map(|point| point.distance(center)).fold(0.0, f64::max);
    // With room for roundings.
    BoundingSphere { center, radius: radius * (1.0 + 1e-12) }
}

/// Number of bits of each coordinate on the Morton curve.
const MORTON_BITS: u32 = 20;

/// Returns the position of `point` on a Morton curve through the box from `low` to `high`.
fn morton(point: DVec3, low: DVec3, high: DVec3) -> u64 {
    let extent = (high - low).max(DVec3::splat(f64::MIN_POSITIVE));
    let cells = f64::from((1u32 << MORTON_BITS) - 1);
    let [x, y, z] = ((point - low) / extent * cells).to_array().map(|x| x as u64);
    let bits = |k: u32| (x >> k & 1) | (y >> k & 1) << 1 | (z >> k & 1) << 2;
    (0..MORTON_BITS).map(|k| bits(k) << (3 * k)).sum()
}
