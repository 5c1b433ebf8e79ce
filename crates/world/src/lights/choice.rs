//! Choice of lights at a surface point, in scenes with many point or spot lights.
//!
//! A *set* has four to eight lights; sets of spot lights are larger, because most surfaces are
//! outside most cones. At each surface a path chooses one set, all with the same probability, and
//! traces shadow rays to its lights. A *stratum* is a group of lights that are close to each other:
//! consecutive lights in the order of a Morton curve. A set holds at most one light of each
//! stratum, so that its lights are spread over the scene.
//!
//! The number of sets is a power of two, because successive samples of a pixel are stratified over
//! the sets like Sobol points: with n sets, n successive samples together trace a shadow ray to
//! every light once. With another number the noise would be several times as large.
//!
//! The probabilities depend neither on the intensities of the lights nor on the surface point.
//! Lights that are much brighter than the others are left out of the choice: shadow rays go to them
//! from every surface. The lights may be in several light groups, among which the choice makes no
//! difference.

use crate::lights::emitter_choice::MIN_EMITTERS;
use crate::world::{DeltaSource, LaneGroups};
use glam::DVec3;
use std::f64::consts::PI;
use zerkalo_kernel::bvh::morton_code;
use zerkalo_kernel::lanes::{Float, MAX_WIDTH, SimdFloat, Vec3, array_from_fn};
use zerkalo_kernel::primitive::BoundingSphere;
use zerkalo_scene::light::{DeltaLight, Light, LightForm, SpotCone, spot_factor};
use zerkalo_scene::value::sort_by_number;

/// Smallest number of point lights in a scene for which paths choose. `benches/many-lights.sh`
/// measures the time of both methods. A spot light counts as a part of a light; see [`ManyLights`].
pub(crate) const MIN_LIGHTS: usize = 16;

/// Smallest number of lights in a set of point lights.
const MIN_SET: usize = 4;

/// Weight of the part of the variance that all lights have in common, relative to the other parts;
/// see [`bright_lights`]. With a weight of 1, a room of mirrors with eight strong lights out of 64
/// needs 2.3 times as many rays as with this weight.
const COMMON_VARIANCE: f64 = 0.25;

/// Largest number of bright lights; see [`bright_lights`].
const MAX_BRIGHT: usize = 16;

/// Smallest length of the list in [`Table::BySet`]; shorter lists are padded. With AVX-512, a
/// lookup in 16 elements is one instruction.
const MIN_TABLE: usize = 16;

/// Values of one property, such as the x coordinate, of the lights of a stratum.
enum Table<S> {
    /// Value of the lights in all sets.
    Common(S),
    /// Value of the light in each set. Elements beyond the number of sets are never read.
    BySet(Vec<S>),
}

/// Group of lights of which each set has at most one.
struct Stratum<S> {
    /// Sphere around the lights.
    ball: BoundingSphere,
    /// Coordinates; NaN in sets without a light of the stratum, so that no surface faces such a
    /// light.
    positions: [Table<S>; 3],
    /// Irradiance at normal incidence, the same at every distance; 0 for lights whose irradiance
    /// decreases with the square of the distance.
    constant: Table<S>,
    groups: Table<S>,
    /// Red, green and blue emission; 1 in sets without a light of the stratum.
    emission: [Table<S>; 3],
    /// Cones of the lights; `None` if all lights emit equally in all directions.
    cones: Option<Cones<S>>,
}

/// Cones of the lights of a stratum, with the fields of [`SpotCone`]. The cone of a point light
/// contains all directions.
struct Cones<S> {
    axis: [Table<S>; 3],
    outer: Table<S>,
    scale: Table<S>,
}

/// Point and spot lights of a scene, of which each path chooses a few at each surface.
pub(crate) struct LightChoice<S> {
    /// Number of sets, a power of two. This many successive samples of a pixel together trace a
    /// shadow ray to each light once.
    pub sets: usize,
    strata: Vec<Stratum<S>>,
}

/// Set of lights that each lane of a packet has chosen.
pub(crate) struct ChosenSets<'a, S> {
    choice: &'a LightChoice<S>,
    sets: [u32; MAX_WIDTH],
}

impl<S: Float> LightChoice<S> {
    /// Removes from `sources` the lights among which paths choose: point and spot lights that are
    /// not on a surface, except for bright ones. Point lights remain if the scene does not have
    /// `many` of them, or if fewer than `MIN_LIGHTS` of them are not on a surface. The same holds
    /// for spot lights. Returns `None`, and removes nothing, if no lights are left to choose from.
    /// `extent` is the largest absolute coordinate of the scene's shapes and camera.
    pub fn take(sources: &mut Vec<DeltaSource<S>>, many: &ManyLights, extent: f64) -> Option<Self> {
        let of_kind = |is_spot: bool, is_many: bool| {
            let is_kind = |source: &DeltaSource<S>| match &source.light.light {
                DeltaLight::Point { cone, .. } => {
                    cone.is_some() == is_spot && source.light.on_surface.is_none()
                }
                DeltaLight::Directional { .. } => false,
            };
            let lights: Vec<usize> = (0..sources.len()).filter(|i| is_kind(&sources[*i])).collect();
            if is_many && lights.len() >= MIN_LIGHTS { lights } else { Vec::new() }
        };
        let mut candidates = [of_kind(false, many.points), of_kind(true, many.spots)].concat();
        if candidates.is_empty() {
            return None;
        }
        candidates.sort_unstable();
        let shares = candidates.iter().map(|i| match &sources[*i].light.light {
            DeltaLight::Point { cone: Some(cone), .. } => share(cone.outer.to_f64()),
            DeltaLight::Point { cone: None, .. } | DeltaLight::Directional { .. } => 1.0,
        });
        let sets = 1 << (shares.sum::<f64>() as usize / MIN_SET).max(1).ilog2();
        let powers = powers(candidates.iter().map(|i| &sources[*i]), extent);
        let mut is_chosen = vec![false; sources.len()];
        for i in &candidates {
            is_chosen[*i] = true;
        }
        for bright in bright_lights(&powers, sets) {
            is_chosen[candidates[bright]] = false;
        }
        let mut is_chosen = is_chosen.into_iter();
        let mut chosen: Vec<_> =
            sources.extract_if(.., |_| is_chosen.next() == Some(true)).collect();
        let low = chosen.iter().map(place).reduce(DVec3::min)?;
        let high = chosen.iter().map(place).reduce(DVec3::max)?;
        let extent = (high - low).max(DVec3::splat(f64::MIN_POSITIVE));
        let morton = |source: &_| morton_code(((place(source) - low) / extent).to_array());
        sort_by_number(&mut chosen, |source| morton(source) as i64);
        let strata = chosen.chunks(sets).map(|lights| Stratum::new(lights, sets)).collect();
        Some(Self { sets, strata })
    }

    /// Returns a sphere around the lights of each stratum.
    pub fn balls(&self) -> impl Iterator<Item = BoundingSphere> {
        self.strata.iter().map(|stratum| stratum.ball)
    }

    /// Chooses a set of lights for each lane. `number` is uniform in [0, 1).
    #[inline(always)]
    pub fn choose<L: SimdFloat<Scalar = S>>(&self, number: L) -> ChosenSets<'_, S> {
        // The product with a power of two is exact, so it is less than the number of sets.
        let place = number * L::from_f64(self.sets as f64);
        let set = |lane: usize| if lane < L::WIDTH { place.lane(lane).to_u32() } else { 0 };
        ChosenSets { choice: self, sets: array_from_fn(set) }
    }
}

impl<S: Float> Table<S> {
    /// Creates a table for `sets` sets from the values of the lights. `absent` is the value of sets
    /// without a light of the stratum.
    fn new(values: impl Iterator<Item = S>, absent: f64, sets: usize) -> Self {
        let mut values: Vec<S> = values.collect();
        let fills = values.len() == sets || values[0] == S::from_f64(absent);
        if fills && values.iter().all(|value| *value == values[0]) {
            return Self::Common(values[0]);
        }
        values.resize(sets.max(MIN_TABLE), S::from_f64(absent));
        Self::BySet(values)
    }

    #[inline(always)]
    fn gather<L: SimdFloat<Scalar = S>>(&self, sets: &[u32; MAX_WIDTH]) -> L {
        match self {
            Self::Common(value) => L::splat(*value),
            Self::BySet(table) => L::gather(table, sets),
        }
    }
}

impl<S: Float> Stratum<S> {
    fn new(lights: &[DeltaSource<S>], sets: usize) -> Self {
        let table = |absent: f64, value: &dyn Fn(&DeltaSource<S>) -> S| {
            Table::new(lights.iter().map(value), absent, sets)
        };
        let coordinate = |light: &DeltaSource<S>, axis: usize| match light.light.light {
            DeltaLight::Point { position, .. } => position[axis],
            DeltaLight::Directional { .. } => S::from_f64(f64::NAN),
        };
        let constant = |light: &DeltaSource<S>| match light.light.light.is_inverse_square() {
            true => S::default(),
            false => S::from_f64(PI),
        };
        let emission = |light: &DeltaSource<S>, channel: usize| {
            light.emission.map_or(S::from_f64(1.0), |emission| emission[channel])
        };
        let everywhere = SpotCone::of_all_directions();
        let cone = |light: &DeltaSource<S>| match light.light.light {
            DeltaLight::Point { cone, .. } => cone,
            DeltaLight::Directional { .. } => None,
        };
        let of_cones = |value: &dyn Fn(&SpotCone<S>) -> S| {
            let value_of = |light: &_| value(&cone(light).unwrap_or(everywhere));
            table(value(&everywhere).to_f64(), &value_of)
        };
        let cones = lights.iter().find_map(cone).map(|_| Cones {
            axis: [0, 1, 2].map(|i| of_cones(&move |cone| cone.axis[i])),
            outer: of_cones(&|cone| cone.outer),
            scale: of_cones(&|cone| cone.scale),
        });
        Self {
            ball: BoundingSphere::around(&lights.iter().map(place).collect::<Vec<_>>()),
            positions: [0, 1, 2].map(|axis| table(f64::NAN, &|light| coordinate(light, axis))),
            constant: table(0.0, &constant),
            groups: table(lights[0].group as f64, &|light| S::from_f64(light.group as f64)),
            emission: [0, 1, 2].map(|channel| table(1.0, &|light| emission(light, channel))),
            cones,
        }
    }
}

impl<S: Float> ChosenSets<'_, S> {
    #[inline(always)]
    fn gather<L: SimdFloat<Scalar = S>>(&self, tables: &[Table<S>; 3]) -> Vec3<L> {
        let [x, y, z] = tables;
        Vec3::new(x.gather(&self.sets), y.gather(&self.sets), z.gather(&self.sets))
    }

    /// Returns the positions of the lights that the lanes' sets have in the stratum number
    /// `stratum`.
    #[inline(always)]
    pub fn positions<L: SimdFloat<Scalar = S>>(&self, stratum: usize) -> Vec3<L> {
        self.gather(&self.choice.strata[stratum].positions)
    }

    /// Returns the irradiance at normal incidence from each lane's light, for unit emission,
    /// divided by the probability of the choice. `inverse` is the reciprocal of the distance to the
    /// light.
    #[inline(always)]
    pub fn irradiance<L: SimdFloat<Scalar = S>>(&self, stratum: usize, inverse: L) -> L {
        let count = L::from_f64(self.choice.sets as f64);
        // The irradiance is kept finite, because infinity times black would be NaN.
        let falling = (inverse * inverse).min(L::from_f64(L::MAX) / count);
        let constant: L = self.choice.strata[stratum].constant.gather(&self.sets);
        L::select(constant.gt(L::zero()), constant, falling) * count
    }

    /// Returns the factor, 0..=1, of the intensity of each lane's light towards a surface point.
    /// `wi` is the unit vector from the point to the light. `None` if no light of the stratum has a
    /// cone.
    #[inline(always)]
    pub fn cone<L: SimdFloat<Scalar = S>>(&self, stratum: usize, wi: Vec3<L>) -> Option<L> {
        let Cones { axis, outer, scale } = self.choice.strata[stratum].cones.as_ref()?;
        let (outer, scale) = (outer.gather(&self.sets), scale.gather(&self.sets));
        Some(spot_factor(wi, self.gather(axis), outer, scale))
    }

    /// Returns the light group of each lane's light.
    #[inline(always)]
    pub fn groups<L: SimdFloat<Scalar = S>>(&self, stratum: usize) -> LaneGroups<L> {
        match &self.choice.strata[stratum].groups {
            Table::Common(group) => LaneGroups::All(group.to_f64() as usize),
            table @ Table::BySet(_) => LaneGroups::Each(table.gather(&self.sets)),
        }
    }

    /// Returns the emission of each lane's light; 1 if the tracer does not multiply samples by it.
    #[inline(always)]
    pub fn emission<L: SimdFloat<Scalar = S>>(&self, stratum: usize) -> Vec3<L> {
        self.gather(&self.choice.strata[stratum].emission)
    }
}

/// Kinds of lights of which a scene has too many for a shadow ray to each: paths choose a few.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ManyLights {
    /// `true` if the scene has `MIN_LIGHTS` point lights or more.
    points: bool,
    /// `true` if the cones of the scene's spot lights have together at least the solid angle of
    /// `MIN_LIGHTS` hemispheres. A spot light costs rays at surfaces in its cone only. If the cones
    /// are narrow, few surfaces are in many of them, and all spots together cost few rays.
    spots: bool,
    /// `true` if the scene has `MIN_EMITTERS` lights with a size or more.
    surfaces: bool,
}

impl ManyLights {
    pub fn new<'a>(lights: impl Iterator<Item = &'a Light>) -> Self {
        let (mut points, mut spots, mut surfaces) = (0, 0.0, 0);
        for light in lights {
            match light.form() {
                LightForm::Point { cone: None, .. } => points += 1,
                LightForm::Point { cone: Some(spot), .. } => {
                    spots += share(1.0 - spot.outer_angle.to_radians().cos());
                }
                LightForm::Surface(_) => surfaces += 1,
                LightForm::Distant { .. } | LightForm::Environment(_) => {}
            }
        }
        let (points, spots) = (points >= MIN_LIGHTS, spots >= MIN_LIGHTS as f64);
        Self { points, spots, surfaces: surfaces >= MIN_EMITTERS }
    }

    pub fn includes(&self, light: &Light) -> bool {
        match light.form() {
            LightForm::Point { cone: None, .. } => self.points,
            LightForm::Point { cone: Some(_), .. } => self.spots,
            LightForm::Surface(_) => self.surfaces,
            LightForm::Distant { .. } | LightForm::Environment(_) => false,
        }
    }
}

/// Returns the solid angle of a cone in hemispheres, at most 1: roughly the share of the surfaces
/// that it contains. `outer` is [`SpotCone::outer`].
fn share(outer: f64) -> f64 {
    outer.min(1.0)
}

/// Returns the position of a light; the origin for a directional light.
fn place<S: Float>(source: &DeltaSource<S>) -> DVec3 {
    source.light.light.position().unwrap_or_default()
}

/// Returns the power of each light in arbitrary units: red, green and blue. Lights without falloff
/// are compared with the others at the mean distance of the lights from the scene's centre.
/// Distances below `extent` count as `extent`.
fn powers<'a, S: Float>(
    lights: impl Iterator<Item = &'a DeltaSource<S>> + Clone,
    extent: f64,
) -> Vec<DVec3> {
    let distances = lights.clone().map(|light| place(light).length().max(extent));
    let mean = distances.sum::<f64>() / lights.clone().count().max(1) as f64;
    let power = |light: &DeltaSource<S>| {
        let emission = light.emission.map_or(DVec3::ONE, |e| DVec3::from(e.map(S::to_f64)));
        match light.light.light.is_inverse_square() {
            true => emission,
            false => emission * (PI * mean * mean),
        }
    };
    lights.map(power).collect()
}

/// Returns the indices of the bright lights, to which every path traces shadow rays at each
/// surface. The others are divided into `sets`.
///
/// The bright lights are the brightest k. The number k, at most [`MAX_BRIGHT`], is the one with the
/// smallest product of variance and cost. The cost is the number of rays per surface: one that
/// arrives, one to each bright light, and one to each light of a set. The variance has three parts.
/// The first is common to all lights, because it depends on the place of the surface only: the
/// squared sum of all powers, times [`COMMON_VARIANCE`]. The second is the sum of the squared
/// powers of the bright lights. The third is the sum of the squared powers of the other lights,
/// times the number of sets, because a path reaches only one of the sets.
///
/// If all lights have similar powers, none is bright, because the squared sum outweighs the rest.
fn bright_lights(powers: &[DVec3], sets: usize) -> Vec<usize> {
    let largest = powers.iter().map(|power| power.max_element()).fold(0.0, f64::max);
    if !(largest > 0.0 && largest.is_finite()) {
        return Vec::new();
    }
    // Scaled powers, whose squares neither overflow nor vanish.
    let powers: Vec<DVec3> = powers.iter().map(|power| *power / largest).collect();
    let squares: Vec<f64> = powers.iter().map(|power| power.length_squared()).collect();
    let mut order: Vec<usize> = (0..powers.len()).collect();
    order.sort_by(|a, b| squares[*b].total_cmp(&squares[*a]));
    let common = COMMON_VARIANCE * powers.iter().sum::<DVec3>().length_squared();
    let effort = |k: usize| {
        let sum = |lights: &[usize]| lights.iter().map(|i| squares[*i]).sum::<f64>();
        let (bright, others) = order.split_at(k);
        let cost = 1.0 + k as f64 + others.len() as f64 / sets as f64;
        (common + sum(bright) + sets as f64 * sum(others)) * cost
    };
    let efforts: Vec<f64> = (0..=MAX_BRIGHT.min(powers.len() - 1)).map(effort).collect();
    let best = (0..efforts.len()).min_by(|a, b| efforts[*a].total_cmp(&efforts[*b]));
    order.truncate(best.unwrap_or(0));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the number of sets that `count` lights are divided into.
    fn sets(count: usize) -> usize {
        1 << (count / MIN_SET).ilog2()
    }

    fn bright(powers: &[f64]) -> Vec<usize> {
        let powers: Vec<DVec3> = powers.iter().map(|power| DVec3::splat(*power)).collect();
        bright_lights(&powers, sets(powers.len()))
    }

    #[test]
    fn no_light_of_similar_ones_is_bright() {
        for count in MIN_LIGHTS..=300 {
            for power in [1e-300, 0.3, 1e300] {
                assert!(bright(&vec![power; count]).is_empty(), "{count} of {power}");
            }
            let powers: Vec<f64> = (0..count).map(|i| 1.0 + 0.5 * (i as f64).sin()).collect();
            assert!(bright(&powers).is_empty(), "{count}");
        }
        assert!(bright(&[0.0; 20]).is_empty());
    }

    #[test]
    fn a_few_strong_lights_among_weak_ones_are_bright() {
        for count in [MIN_LIGHTS, 64, 1000] {
            for weak in [1e-30, 1e-6, 1e-3] {
                let mut powers = vec![weak; count];
                powers[5] = 0.7;
                assert_eq!(bright(&powers), [5], "{count} of {weak}");
                powers[count - 1] = 0.9;
                assert_eq!(bright(&powers), [count - 1, 5], "{count} of {weak}");
            }
        }
        // Powers in different channels are compared by their sizes.
        let mut powers = vec![DVec3::X * 1e-3; 64];
        powers[7] = DVec3::Z;
        assert_eq!(bright_lights(&powers, sets(64)), [7]);
    }

    #[test]
    fn few_of_very_different_lights_are_bright() {
        for count in [MIN_LIGHTS, 64, 1000] {
            for ratio in [0.5_f64, 0.9, 0.99] {
                let powers: Vec<f64> = (0..count).map(|i| ratio.powi(i as i32)).collect();
                let bright = bright(&powers).len();
                assert!(bright <= MAX_BRIGHT, "{bright} of {count}, ratio {ratio}");
            }
        }
    }
}
