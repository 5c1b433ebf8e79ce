//! Candidate lists per tile: the primitives that camera rays through the tile can hit, and the
//! primitives that can occlude each light from the hit points of these rays. Most tiles have one or
//! two visible primitives and no occluder.

use crate::culling::light_buffer::{LightBuffer, Occluder};
use crate::culling::screen_grid::{ScreenBounds, ScreenGrid};
use zerkalo_kernel::lanes::SimdFloat;
use zerkalo_kernel::primitive::{
    Aggregate, BoundingSphere, BoundingVolume, Form, Frustum, LightTarget, PrimitiveSet,
};
use zerkalo_scene::camera::PerspectiveCamera;

/// Candidates of a group of camera rays, such as those through a tile, and of the shadow rays from
/// their hit points. Candidates are the primitives that rays must be tested against.
#[derive(Clone, Debug)]
pub struct TileCandidates {
    /// Primitives that the camera rays can hit.
    pub(crate) primary: PrimitiveSet,
    /// Possible occluders of the light sources: first of each light without a size, then of each
    /// light with a size, each emissive object from which light is sampled, and each stratum
    /// (spatial group) of the lights among which paths choose.
    pub(crate) occluders: Vec<PrimitiveSet>,
}

impl TileCandidates {
    /// Returns all primitives as candidates, without culling: for camera rays, and for each of
    /// `lights` light sources (see the field `occluders`).
    pub(crate) fn all<L: SimdFloat>(geometry: &Aggregate<L>, lights: usize) -> Self {
        Self { primary: geometry.all().clone(), occluders: vec![geometry.all().clone(); lights] }
    }
}

/// Method that finds the candidate primitives of a tile: those that rays of the tile are tested
/// against.
pub(crate) enum CullingMode {
    /// Tests bounding volumes against the tile's view frustum, and against the space between the
    /// frustum and the lights.
    Frusta(FrustumCuller),
    /// Tests the bounding rectangles of the projected primitives against the tile.
    ScreenBounds(Vec<ScreenBounds>),
    /// Looks up the candidate lists of the screen cells that the tile overlaps. The primitives are
    /// in a BVH.
    ScreenGrid(ScreenGrid),
    /// No culling: all primitives are candidates. Those in a BVH are still found by traversal of
    /// the BVH.
    Off,
}

impl CullingMode {
    /// Returns the primitives that the camera rays through a rectangle of the picture can hit, and
    /// those that can occlude shadow rays from the hit points of these camera rays. `lights` is the
    /// number of light sources. `origin` is the upper left corner of the rectangle, and `extent`
    /// its size \[pixels\]. Returns `None` if rays must be tested against all primitives.
    pub fn candidates<L: SimdFloat>(
        &self,
        geometry: &Aggregate<L>,
        lights: usize,
        camera: &PerspectiveCamera,
        (origin, extent): ([usize; 2], [usize; 2]),
    ) -> Option<TileCandidates> {
        match self {
            Self::Frusta(culler) => {
                let [_, _, forward] = camera.frame();
                let corners = camera.corners(origin, extent);
                let lens = camera.lens();
                let frustum = Frustum {
                    apex: camera.eye(),
                    forward,
                    corners,
                    lens_radius: camera.lens_radius(),
                    focus: lens.map_or(1.0, |lens| lens.focus),
                };
                Some(culler.candidates(geometry, Some(&frustum)))
            }
            Self::ScreenBounds(bounds) => {
                let primary = geometry
                    .select(|primitive| bounds[primitive as usize].overlaps(origin, extent));
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

/// Returns one value for each of the objects `forms`: `true` for a convex solid that rays hit only
/// from outside. Paths are inside of a solid only if they start there or are transmitted. `start`
/// is a sphere that contains the origins of all camera rays. If `start` is `None`, camera rays may
/// start anywhere, and all values are `false`. `entered` is `true` for each object whose surface
/// transmits.
pub(crate) fn outside_only<'a>(
    forms: impl Iterator<Item = &'a Form>,
    start: Option<BoundingSphere>,
    entered: &[bool],
) -> Vec<bool> {
    let is_outside = |(form, entered): (&Form, &bool)| {
        let excludes_start = |start| !form.bounding_sphere().overlaps(start);
        form.is_convex()
            && !form.is_flat()
            && !entered
            && start.as_ref().is_some_and(excludes_start)
    };
    forms.zip(entered).map(is_outside).collect()
}

/// Culling of primitives by view frusta and by the space between visible surfaces and the lights.
pub(crate) struct FrustumCuller {
    /// Bounding volume of each primitive.
    bounds: Vec<BoundingVolume>,
    /// `true` for each primitive that may occlude lights from points on its own surface: it is
    /// concave, or paths can be inside of it.
    self_shadowing: Vec<bool>,
    /// Position or direction of each light without a size.
    lights: Vec<LightTarget>,
    /// Bounding sphere of each light with a size, each emissive object from which light is sampled,
    /// and each stratum (spatial group) of the lights among which paths choose.
    emitters: Vec<BoundingSphere>,
}

impl FrustumCuller {
    /// Creates the culler of the primitives `forms`. `outside_only` is `true` for each convex solid
    /// that rays hit only from outside. `lights` are the positions or directions of the lights
    /// without a size. `max_end_offset` is the largest distance between such a light and the end
    /// point of its shadow rays. `emitters` are the bounding spheres of the other light sources
    /// (see [`FrustumCuller::emitters`]).
    pub fn new(
        forms: Vec<&Form>,
        outside_only: &[bool],
        (lights, max_end_offset): (Vec<LightTarget>, f64),
        emitters: Vec<BoundingSphere>,
    ) -> Self {
        let bound = |form: &Form| BoundingVolume::new(form).grown(max_end_offset);
        let bounds: Vec<BoundingVolume> = forms.into_iter().map(bound).collect();
        // A shadow ray that leaves the outside of a convex primitive cannot hit it again.
        let self_shadowing = |(b, outside_only): (&BoundingVolume, &bool)| {
            !(outside_only | (b.is_flat() & b.is_convex()))
        };
        let self_shadowing = bounds.iter().zip(outside_only).map(self_shadowing).collect();
        Self { lights, emitters, self_shadowing, bounds }
    }

    /// Creates the light buffer of each light without a size. Its occluders are the primitives in
    /// the BVH of `geometry`. An entry is `None` if the cells of the buffer would leave out too
    /// many occluders; see [`LightBuffer::new`].
    pub fn light_buffers<L: SimdFloat>(
        &self,
        geometry: &Aggregate<L>,
    ) -> Vec<Option<LightBuffer<L::Scalar>>> {
        let occluder = |primitive: u32| Occluder {
            ball: self.bounds[primitive as usize].ball,
            exempt_primitive: (!self.self_shadowing[primitive as usize]).then_some(primitive),
        };
        let occluders: Vec<Occluder> = geometry.in_tree().into_iter().map(occluder).collect();
        self.lights.iter().map(|light| LightBuffer::new(light, &occluders)).collect()
    }

    /// Returns the candidate primitives of the camera rays inside `frustum`, and of the shadow rays
    /// from their hit points. If `frustum` is `None`, all primitives are candidates of the camera
    /// rays.
    pub fn candidates<L: SimdFloat>(
        &self,
        geometry: &Aggregate<L>,
        frustum: Option<&Frustum>,
    ) -> TileCandidates {
        let visible_part = |bound: &BoundingVolume| match frustum {
            Some(frustum) => bound.clip_to(frustum),
            None => Some(bound.ball),
        };
        let parts: Vec<Option<BoundingSphere>> = self.bounds.iter().map(visible_part).collect();
        let primary = geometry.select(|primitive| parts[primitive as usize].is_some());
        // Selects the primitives that can occlude one light from the visible part of at least one
        // primitive. `occludes` tests one possible occluder and one visible part.
        let occluders_of = |occludes: &dyn Fn(&BoundingVolume, &BoundingSphere) -> bool| {
            geometry.select(|primitive| {
                let primitive = primitive as usize;
                let may_occlude_part = |(other, part): (usize, &Option<BoundingSphere>)| {
                    part.is_some_and(|part| {
                        (other != primitive || self.self_shadowing[primitive])
                            && occludes(&self.bounds[primitive], &part)
                    })
                };
                parts.iter().enumerate().any(may_occlude_part)
            })
        };
        let of_light =
            |light: &LightTarget| occluders_of(&|bounds, part| bounds.may_occlude(part, light));
        let of_emitter = |light: &BoundingSphere| {
            occluders_of(&|bounds, part| bounds.may_occlude_ball(part, light))
        };
        let lights = self.lights.iter().map(of_light);
        TileCandidates {
            primary,
            occluders: lights.chain(self.emitters.iter().map(of_emitter)).collect(),
        }
    }
}
