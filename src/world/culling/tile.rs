//! What the rays of one part of the picture may meet: the things that its camera rays see, and those
//! that may stand between what they see and a light. Most parts see one or two things, and nothing
//! shades them: the others are never asked.

use crate::camera::PinholeCamera;
use crate::lanes::{Float, SimdFloat};
use crate::light::DeltaLight;
use crate::primitive::{
    Aggregate, BoundingSphere, BoundingVolume, Form, Frustum, LightTarget, PrimitiveSet,
};
use crate::world::culling::light_buffer::{LightBuffer, Occluder};
use crate::world::culling::screen_grid::{ScreenBounds, ScreenGrid};
use glam::DVec3;

/// The things that some camera rays and the shadow rays from where they end may meet.
#[derive(Clone, Debug)]
pub struct TileCandidates {
    /// What the camera rays may meet.
    pub(crate) primary: PrimitiveSet,
    /// For each light of the world, what shadow rays may meet.
    pub(crate) occluders: Vec<PrimitiveSet>,
}

impl TileCandidates {
    /// Everything, for `lamps` lights.
    pub(crate) fn all<L: SimdFloat>(geometry: &Aggregate<L>, lamps: usize) -> Self {
        Self { primary: geometry.all().clone(), occluders: vec![geometry.all().clone(); lamps] }
    }
}

/// How the rays of a part of the picture are kept from things that they cannot meet.
pub(crate) enum CullingMode {
    /// By a pencil of lines from the eye, and what stands between it and the lights.
    Frusta(FrustumCuller),
    /// By rectangles on the screen.
    ScreenBounds(Vec<ScreenBounds>),
    /// By lists of the few things of a tree that are seen in each part of the screen.
    ScreenGrid(ScreenGrid),
    /// Not at all, or by the geometry itself.
    Off,
}

impl CullingMode {
    /// What camera rays through a rectangle of the raster may meet, and the shadow rays from where they
    /// end, to `lamps` lights; `None`: nothing is ruled out.
    pub fn candidates<L: SimdFloat>(
        &self,
        geometry: &Aggregate<L>,
        lamps: usize,
        view: &PinholeCamera,
        (origin, extent): ([usize; 2], [usize; 2]),
    ) -> Option<TileCandidates> {
        match self {
            Self::Frusta(surroundings) => {
                let [_, _, forward] = view.frame();
                let corners = view.corners(origin, extent);
                let pencil = Frustum { apex: view.eye(), forward, corners };
                Some(surroundings.candidates(geometry, Some(&pencil)))
            }
            Self::ScreenBounds(of) => {
                let seen = geometry.select(|item| of[item as usize].overlaps(origin, extent));
                Some(TileCandidates { primary: seen, ..TileCandidates::all(geometry, lamps) })
            }
            Self::ScreenGrid(cells) => {
                let seen = geometry.select_indices(&cells.candidates(origin, extent)?);
                Some(TileCandidates { primary: seen, ..TileCandidates::all(geometry, lamps) })
            }
            Self::Off => None,
        }
    }
}

/// What outlooks are found from.
pub(crate) struct FrustumCuller {
    /// For each item of the geometry.
    bounds: Vec<BoundingVolume>,
    /// For each item: paths may be inside it, so that it may shade itself.
    self_shadowing: Vec<bool>,
    /// For each light.
    towards: Vec<LightTarget>,
}

impl FrustumCuller {
    /// `eye`: where paths begin; `None`: not known. `entered`: for each item, whether paths get inside
    /// it. `off_lamps`: how far from the lamps shadow rays end at most.
    pub fn new<S: Float>(
        forms: Vec<&Form>,
        eye: Option<DVec3>,
        entered: &[bool],
        (lamps, off_lamps): (&[DeltaLight<S>], f64),
    ) -> Self {
        let bound = |form: &Form| BoundingVolume::new(form).grown(off_lamps);
        let bounds: Vec<BoundingVolume> = forms.into_iter().map(bound).collect();
        let vector = |v: &[S; 3]| DVec3::from(v.map(S::to_f64));
        let towards = lamps.iter().map(|lamp| match lamp {
            DeltaLight::InverseSquare { position } | DeltaLight::Constant { position } => {
                LightTarget::Point(vector(position))
            }
            DeltaLight::Directional { wi: towards } => LightTarget::Direction(vector(towards)),
        });
        // The outside of a convex thing does not see itself, and only paths that begin inside, or are
        // let in, get inside.
        let self_shadowing = |(b, entered): (&BoundingVolume, &bool)| {
            let holds_eye = || eye.is_none_or(|eye| b.ball().contains(eye));
            !b.is_convex() || !b.is_flat() && (*entered || holds_eye())
        };
        let self_shadowing = bounds.iter().zip(entered).map(self_shadowing).collect();
        Self { towards: towards.collect(), self_shadowing, bounds }
    }

    /// For each light what shadow rays to it meet of the things in the geometry's tree.
    pub fn light_buffers<L: SimdFloat>(
        &self,
        geometry: &Aggregate<L>,
    ) -> Vec<Option<LightBuffer<L::Scalar>>> {
        let occluder = |item: u32| Occluder {
            ball: self.bounds[item as usize].ball(),
            own: (!self.self_shadowing[item as usize]).then_some(item),
        };
        let occluders: Vec<Occluder> = geometry.in_tree().into_iter().map(occluder).collect();
        self.towards.iter().map(|towards| LightBuffer::new(towards, &occluders)).collect()
    }

    /// The outlook of camera rays inside `pencil`; `None`: of any rays.
    pub fn candidates<L: SimdFloat>(
        &self,
        geometry: &Aggregate<L>,
        pencil: Option<&Frustum>,
    ) -> TileCandidates {
        let part = |bound: &BoundingVolume| match pencil {
            Some(pencil) => bound.clip_to(pencil),
            None => Some(bound.ball()),
        };
        let parts: Vec<Option<BoundingSphere>> = self.bounds.iter().map(part).collect();
        let seen = geometry.select(|item| parts[item as usize].is_some());
        let shades = |item: usize, towards: &LightTarget| {
            let lit = |(other, part): (usize, &Option<BoundingSphere>)| {
                part.is_some_and(|part| {
                    (other != item || self.self_shadowing[item])
                        && self.bounds[item].may_occlude(&part, towards)
                })
            };
            parts.iter().enumerate().any(lit)
        };
        let of_light = |towards| geometry.select(|item| shades(item as usize, towards));
        TileCandidates { primary: seen, occluders: self.towards.iter().map(of_light).collect() }
    }
}
