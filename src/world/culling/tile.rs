//! Per-tile candidate lists: primitives that primary rays can hit, and possible occluders for each
//! light. In most tiles one or two primitives are visible and have no occluder.

use crate::camera::PinholeCamera;
use crate::lanes::{Float, SimdFloat};
use crate::light::DeltaLight;
use crate::primitive::{
    Aggregate, BoundingSphere, BoundingVolume, Form, Frustum, LightTarget, PrimitiveSet,
};
use crate::world::culling::light_buffer::{LightBuffer, Occluder};
use crate::world::culling::screen_grid::{ScreenBounds, ScreenGrid};
use glam::DVec3;

/// Candidates of some camera rays and of the shadow rays from their hit points.
#[derive(Clone, Debug)]
pub struct TileCandidates {
    /// Primitives that the camera rays can hit.
    pub(crate) primary: PrimitiveSet,
    /// Possible occluders for each light of the world.
    pub(crate) occluders: Vec<PrimitiveSet>,
}

impl TileCandidates {
    /// All primitives, for `lights` lights.
    pub(crate) fn all<L: SimdFloat>(geometry: &Aggregate<L>, lights: usize) -> Self {
        Self { primary: geometry.all().clone(), occluders: vec![geometry.all().clone(); lights] }
    }
}

/// Source of a tile's candidates.
pub(crate) enum CullingMode {
    /// The tile's view frustum, and the space between it and the lights.
    Frusta(FrustumCuller),
    /// Projected bounds of each primitive.
    ScreenBounds(Vec<ScreenBounds>),
    /// Candidate lists of screen cells, for primitives in a BVH.
    ScreenGrid(ScreenGrid),
    /// No candidate lists; the geometry may have bounding boxes or a BVH.
    Off,
}

impl CullingMode {
    /// Returns the candidates of camera rays through a rectangle of the raster, and of shadow rays
    /// from their hit points to `lights` lights; `None` if no primitive is ruled out.
    pub fn candidates<L: SimdFloat>(
        &self,
        geometry: &Aggregate<L>,
        lights: usize,
        camera: &PinholeCamera,
        (origin, extent): ([usize; 2], [usize; 2]),
    ) -> Option<TileCandidates> {
        match self {
            Self::Frusta(culler) => {
                let [_, _, forward] = camera.frame();
                let corners = camera.corners(origin, extent);
                let frustum = Frustum { apex: camera.eye(), forward, corners };
                Some(culler.candidates(geometry, Some(&frustum)))
            }
            Self::ScreenBounds(bounds) => {
                let primary =
                    geometry.select(|item| bounds[item as usize].overlaps(origin, extent));
                Some(TileCandidates { primary, ..TileCandidates::all(geometry, lights) })
            }
            Self::ScreenGrid(grid) => {
                let primary = geometry.select_indices(&grid.candidates(origin, extent)?);
                Some(TileCandidates { primary, ..TileCandidates::all(geometry, lights) })
            }
            Self::Off => None,
        }
    }
}

/// Culler by view frusta and by the space between them and the lights.
pub(crate) struct FrustumCuller {
    /// Bounds of each primitive.
    bounds: Vec<BoundingVolume>,
    /// For each primitive, `true` if it may occlude lights from its own surface: it is concave, or
    /// paths can be inside.
    self_shadowing: Vec<bool>,
    /// Position or direction of each light.
    lights: Vec<LightTarget>,
}

impl FrustumCuller {
    /// Creates the culler of `forms`, one for each primitive. `eye` is the start of all camera
    /// rays; `None` if they start elsewhere. `entered` is `true` for each primitive that paths can
    /// be inside. `max_end_offset` is the largest distance between a light and the end point of its
    /// shadow rays.
    pub fn new<S: Float>(
        forms: Vec<&Form>,
        eye: Option<DVec3>,
        entered: &[bool],
        (lights, max_end_offset): (&[DeltaLight<S>], f64),
    ) -> Self {
        let bound = |form: &Form| BoundingVolume::new(form).grown(max_end_offset);
        let bounds: Vec<BoundingVolume> = forms.into_iter().map(bound).collect();
        let vector = |v: &[S; 3]| DVec3::from(v.map(S::to_f64));
        let targets = lights.iter().map(|light| match light {
            DeltaLight::InverseSquare { position } | DeltaLight::Constant { position } => {
                LightTarget::Point(vector(position))
            }
            DeltaLight::Directional { wi } => LightTarget::Direction(vector(wi)),
        });
        // The outside of a convex primitive does not occlude itself. Paths are inside only if they
        // start there or are transmitted.
        let self_shadowing = |(b, entered): (&BoundingVolume, &bool)| {
            let contains_eye = || eye.is_none_or(|eye| b.ball().contains(eye));
            !b.is_convex() || !b.is_flat() && (*entered || contains_eye())
        };
        let self_shadowing = bounds.iter().zip(entered).map(self_shadowing).collect();
        Self { lights: targets.collect(), self_shadowing, bounds }
    }

    /// Creates the light buffer of each light, of the primitives in the geometry's BVH.
    pub fn light_buffers<L: SimdFloat>(
        &self,
        geometry: &Aggregate<L>,
    ) -> Vec<Option<LightBuffer<L::Scalar>>> {
        let occluder = |item: u32| Occluder {
            ball: self.bounds[item as usize].ball(),
            exempt_item: (!self.self_shadowing[item as usize]).then_some(item),
        };
        let occluders: Vec<Occluder> = geometry.in_tree().into_iter().map(occluder).collect();
        self.lights.iter().map(|light| LightBuffer::new(light, &occluders)).collect()
    }

    /// Returns the candidates of camera rays inside `frustum`; of any rays, if it is `None`.
    pub fn candidates<L: SimdFloat>(
        &self,
        geometry: &Aggregate<L>,
        frustum: Option<&Frustum>,
    ) -> TileCandidates {
        let visible_part = |bound: &BoundingVolume| match frustum {
            Some(frustum) => bound.clip_to(frustum),
            None => Some(bound.ball()),
        };
        let parts: Vec<Option<BoundingSphere>> = self.bounds.iter().map(visible_part).collect();
        let primary = geometry.select(|item| parts[item as usize].is_some());
        let may_occlude = |item: usize, light: &LightTarget| {
            let may_occlude_part = |(other, part): (usize, &Option<BoundingSphere>)| {
                part.is_some_and(|part| {
                    (other != item || self.self_shadowing[item])
                        && self.bounds[item].may_occlude(&part, light)
                })
            };
            parts.iter().enumerate().any(may_occlude_part)
        };
        let occluders_of = |light| geometry.select(|item| may_occlude(item as usize, light));
        TileCandidates { primary, occluders: self.lights.iter().map(occluders_of).collect() }
    }
}
