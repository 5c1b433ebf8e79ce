//! Candidate lists per tile. Most tiles have one or two visible primitives and no occluder.

use crate::culling::light_buffer::{LightBuffer, Occluder};
use crate::culling::screen_grid::{ScreenBounds, ScreenGrid};
use zerkalo_kernel::lanes::{Float, SimdFloat};
use zerkalo_kernel::primitive::{
    Aggregate, BoundingSphere, BoundingVolume, Form, Frustum, LightTarget, PrimitiveSet,
};
use zerkalo_scene::camera::CompiledCamera;

/// Candidates of a group of camera rays, such as those through a tile, and of the shadow rays from
/// their hit points: the primitives that these rays must be tested against.
#[derive(Clone, Debug)]
pub struct TileCandidates {
    /// Primitives that the camera rays can hit.
    pub(crate) primary: PrimitiveSet,
    pub(crate) occluders: Occluders,
}

/// Possible occluders of each light.
#[derive(Clone, Debug)]
pub(crate) struct Occluders {
    pub delta_lights: Vec<PrimitiveSet>,
    pub emitters: Vec<PrimitiveSet>,
    /// For each stratum of the world's light choice, the primitives that may occlude its lights.
    pub strata: Vec<PrimitiveSet>,
}

/// Bounds of the lights that have lists of possible occluders.
pub(crate) struct LightBounds {
    pub delta_lights: Vec<LightTarget>,
    /// Largest distance between a light without a size and the end point of its shadow rays.
    pub max_end_offset: f64,
    pub emitters: Vec<LightTarget>,
    pub strata: Vec<LightTarget>,
}

impl TileCandidates {
    /// Returns all primitives as candidates, without culling.
    pub(crate) fn all<L: SimdFloat>(geometry: &Aggregate<L>, lights: &LightBounds) -> Self {
        let sets = |count| vec![geometry.all().clone(); count];
        let occluders = Occluders {
            delta_lights: sets(lights.delta_lights.len()),
            emitters: sets(lights.emitters.len()),
            strata: sets(lights.strata.len()),
        };
        Self { primary: geometry.all().clone(), occluders }
    }
}

/// Method that finds the candidates of a tile.
pub(crate) enum CullingMode {
    /// Tests bounding volumes against the tile's view frustum, and against the space between the
    /// frustum and the lights.
    Frusta(FrustumCuller),
    /// Tests projected bounds against the tile.
    ScreenBounds(Vec<ScreenBounds>),
    /// Looks up the screen cells that the tile overlaps. The primitives are in a BVH.
    ScreenGrid(ScreenGrid),
    /// No culling: all primitives are candidates. Rays find those in a BVH by traversal.
    Off,
}

/// Candidates of rays, and the method that finds the candidates of a tile.
pub(crate) struct Culling<S> {
    pub mode: CullingMode,
    /// Candidates for rays that belong to no tile.
    pub all_candidates: TileCandidates,
    /// Light buffer of each light without a size. Shadow rays to a light that has no light buffer
    /// traverse the BVH.
    pub light_buffers: Vec<Option<LightBuffer<S>>>,
}

impl<S: Float> Culling<S> {
    /// Returns the candidates of a rectangle of the picture \[pixels\] with the upper left corner
    /// `origin` and the size `extent`. Returns `None` if all primitives are candidates.
    pub fn candidates<L: SimdFloat<Scalar = S>>(
        &self,
        geometry: &Aggregate<L>,
        camera: &CompiledCamera,
        origin: [usize; 2],
        extent: [usize; 2],
    ) -> Option<TileCandidates> {
        let with_primary = |primary| TileCandidates { primary, ..self.all_candidates.clone() };
        match &self.mode {
            CullingMode::Frusta(culler) => {
                let [_, _, forward] = camera.frame;
                let corners = camera.corners(origin, extent);
                let frustum = Frustum {
                    apex: camera.eye,
                    forward,
                    corners,
                    lens_radius: camera.lens_radius(),
                    focus: camera.lens.map_or(1.0, |lens| lens.focus),
                };
                Some(culler.candidates(geometry, Some(&frustum)))
            }
            CullingMode::ScreenBounds(bounds) => Some(with_primary(
                geometry.select(|primitive| bounds[primitive as usize].overlaps(origin, extent)),
            )),
            CullingMode::ScreenGrid(grid) => {
                Some(with_primary(geometry.select_indices(&grid.candidates(origin, extent)?)))
            }
            CullingMode::Off => None,
        }
    }
}

/// Largest number of pairs of a light and a primitive for which occluders are culled.
const MAX_PAIRS: usize = 1 << 24;

/// Culling by view frusta and by the space between visible surfaces and the lights.
pub(crate) struct FrustumCuller {
    bounds: Vec<BoundingVolume>,
    /// Largest distance between each primitive and the origins of shadow rays from its points.
    lifts: Vec<f64>,
    /// `true` for each primitive that may occlude lights from points on its own surface: it is
    /// concave, or paths can be inside it.
    self_shadowing: Vec<bool>,
    lights: LightBounds,
}

impl FrustumCuller {
    /// Creates the culler of the primitives `forms`. `outside_only` is `true` for those that rays
    /// hit only from outside.
    pub fn new(forms: Vec<&Form>, outside_only: &[bool], lights: LightBounds) -> Self {
        let bound = |form: &Form| BoundingVolume::new(form).grown(lights.max_end_offset);
        let bounds: Vec<BoundingVolume> = forms.iter().copied().map(bound).collect();
        let lifts: Vec<f64> = forms.into_iter().map(|form| form.max_lift()).collect();
        // A shadow ray that leaves a flat primitive, or the outside of a convex one, cannot hit it
        // again unless it starts above it.
        let self_shadowing = |i: usize| !(outside_only[i] || bounds[i].is_flat()) || lifts[i] > 0.0;
        let self_shadowing = (0..bounds.len()).map(self_shadowing).collect();
        Self { lights, self_shadowing, bounds, lifts }
    }

    /// Creates the light buffer of each light without a size, with the primitives in the BVH of
    /// `geometry` as possible occluders; see [`LightBuffer::new`].
    pub fn light_buffers<L: SimdFloat>(
        &self,
        geometry: &Aggregate<L>,
    ) -> Vec<Option<LightBuffer<L::Scalar>>> {
        let occluder = |primitive: u32| Occluder {
            ball: self.bounds[primitive as usize].ball,
            exempt_primitive: (!self.self_shadowing[primitive as usize]).then_some(primitive),
        };
        let occluders: Vec<Occluder> = geometry.in_bvh().into_iter().map(occluder).collect();
        self.lights.delta_lights.iter().map(|light| LightBuffer::new(light, &occluders)).collect()
    }

    /// Returns the candidates of the camera rays inside `frustum`, or of all camera rays.
    pub fn candidates<L: SimdFloat>(
        &self,
        geometry: &Aggregate<L>,
        frustum: Option<&Frustum>,
    ) -> TileCandidates {
        let visible_part = |(bound, lift): (&BoundingVolume, &f64)| {
            let part = frustum.map_or(Some(bound.ball), |frustum| bound.clip_to(frustum))?;
            Some(BoundingSphere { radius: part.radius + lift, ..part })
        };
        let parts: Vec<_> = self.bounds.iter().zip(&self.lifts).map(visible_part).collect();
        let primary = geometry.select(|primitive| parts[primitive as usize].is_some());
        let LightBounds { delta_lights, emitters, strata, .. } = &self.lights;
        let is_large = (delta_lights.len() + emitters.len()) * parts.len() > MAX_PAIRS;
        // Primitives that can occlude the light from a visible part of some primitive.
        let occluders_of = |light: &LightTarget| {
            geometry.select(|primitive| {
                let primitive = primitive as usize;
                let may_occlude_part = |(other, part): (usize, &Option<BoundingSphere>)| {
                    part.is_some_and(|part| {
                        (other != primitive || self.self_shadowing[primitive])
                            && self.bounds[primitive].may_occlude(&part, light)
                    })
                };
                is_large || parts.iter().enumerate().any(may_occlude_part)
            })
        };
        let [delta_lights, emitters, strata] = [delta_lights, emitters, strata]
            .map(|lights| lights.iter().map(occluders_of).collect());
        let occluders = Occluders { delta_lights, emitters, strata };
        TileCandidates { primary, occluders }
    }
}
