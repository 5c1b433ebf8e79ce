//! `World`: a compiled scene, as the integrators read it.

use crate::culling::light_buffer::LightBuffer;
use crate::culling::tile::{CullingMode, TileCandidates};
use crate::integrator::first_hit::{self, FirstHit};
use crate::integrator::indirect_diffuse::{DiffuseLimits, trace_generations};
use crate::integrator::nested_dielectrics::NestedDielectrics;
use crate::integrator::opaque::trace_opaque;
use crate::integrator::path::{Counts, Path, Radiance};
use crate::integrator::surface_textures::SurfaceTextures;
use crate::integrator::transmission::{Branch, TransmissionIntegrator};
use crate::light_choice::LightChoice;
use crate::light_groups::LightGroups;
use crate::lights_on_surfaces::OnSurface;
use crate::surface_emission::SurfaceEmission;
use crate::tile_tracer::CameraTracer;
use zerkalo_kernel::lanes::{Double, Float, SimdFloat, Single, Vec3};
use zerkalo_kernel::primitive::Aggregate;
use zerkalo_kernel::sampling::{CameraDimensions, PacketSampler, SampleSettings};
use zerkalo_scene::camera::PerspectiveCamera;
use zerkalo_scene::light::{DeltaLight, Emitter, EnvironmentLight};
use zerkalo_scene::material::Bsdf;

/// Compiled light of type `T`, with its light group. `S` is the scalar type.
pub(super) struct LightSource<T, S> {
    pub light: T,
    /// Index of the light group (part of the picture that the film stores separately) that the
    /// light belongs to.
    pub group: usize,
    /// Emission (colour times intensity) by which the tracer multiplies the light's samples, for a
    /// light that shares its light group. `None` for a light with a group of its own.
    pub emission: Option<[S; 3]>,
    /// `true` if the camera and reflected rays see the light. Lights without a size are never
    /// visible; the field has no effect on them.
    pub visible: bool,
}

impl<T, S: Float> LightSource<T, S> {
    /// Returns `value` times the light's emission (colour times intensity) if the light shares its
    /// light group, otherwise `value`.
    #[inline(always)]
    pub fn emitted<L: SimdFloat<Scalar = S>>(&self, value: Vec3<L>) -> Vec3<L> {
        match self.emission {
            Some(emission) => value.component_mul(Vec3::splat(emission)),
            None => value,
        }
    }

    /// Returns a copy of this source in which `light` takes the place of the light.
    #[inline(always)]
    pub fn with_light<U>(&self, light: U) -> LightSource<U, S> {
        let Self { group, emission, visible, .. } = *self;
        LightSource { light, group, emission, visible }
    }
}

/// Light without a size, and the end points of shadow rays to it.
pub(super) struct ShadowRayTarget<S> {
    pub light: DeltaLight<S>,
    /// End points of shadow rays to a light that is located on a surface. `None` for other lights,
    /// whose shadow rays end at the light itself.
    pub on_surface: Option<OnSurface<S>>,
}

/// A light without a size, with its light group.
pub(super) type DeltaSource<S> = LightSource<ShadowRayTarget<S>, S>;

/// A light with a size, with its light group.
pub(super) type EmitterSource<S> = LightSource<Emitter<S>, S>;

/// An environment light, with its light group.
pub(super) type EnvironmentSource<S> = LightSource<EnvironmentLight, S>;

/// Scene compiled for the SIMD type `L`. Fields of features that the scene does not use are empty
/// or `None`.
pub struct World<L: SimdFloat> {
    /// All primitives of the scene, in coordinates relative to the scene's centre.
    pub(super) geometry: Aggregate<L>,
    /// `true` for each primitive that rays hit only from outside: a convex solid in which no camera
    /// ray starts and no transmitted ray runs.
    pub(super) outside_only: Vec<bool>,
    /// For each primitive, the index of its BSDF in `bsdfs`.
    pub(super) bsdf_of: Vec<u32>,
    pub(super) bsdfs: Vec<Bsdf<L::Scalar>>,
    pub(super) sources: Vec<DeltaSource<L::Scalar>>,
    /// Point and spot lights of which paths choose a few at each hit; `sources` holds the other
    /// lights without a size. `None` if shadow rays go to all lights.
    pub(super) light_choice: Option<LightChoice<L::Scalar>>,
    /// Lights with a size, and their light groups.
    pub(super) emitters: Vec<EmitterSource<L::Scalar>>,
    /// Environment lights, and their light groups.
    pub(super) environments: Vec<EnvironmentSource<L::Scalar>>,
    /// Emission of objects with an emissive material.
    pub(super) emission: SurfaceEmission<L::Scalar>,
    /// Index of the light group of ambient light. `None` if no surface reflects ambient light.
    pub(super) ambient: Option<usize>,
    /// Index of the light group of the background. `None` if the background is black.
    pub(super) background: Option<usize>,
    /// `true` if shadow rays are traced: the scene has objects, and its ray types include shadow
    /// rays.
    pub(super) shadows: bool,
    /// `true` if shading normals differ from geometric normals on some surface.
    pub(super) smooth: bool,
    /// `true` if vertex colours or textures multiply the albedo of some surface.
    pub(super) colored: bool,
    /// `true` if the world is neither `smooth` nor `colored` and all its primitives are in linear
    /// lists, without BVH and bounding boxes. Kernels have a faster instance for such worlds.
    pub(super) simple: bool,
    /// Textures and bump maps of primitives. `None` if the scene has neither.
    pub(super) surface_textures: Option<SurfaceTextures<L>>,
    /// Transmissive surfaces and the media between them. `None` if the scene has none.
    pub(super) nested_dielectrics: Option<NestedDielectrics<L>>,
    /// Largest number of surfaces on a path after the first; 0 if no surface reflects or transmits.
    pub(super) depth: u32,
    /// Limits of diffuse bounces. `None` if the scene has no indirect diffuse light.
    pub(super) diffuse_limits: Option<DiffuseLimits>,
    /// Smallest throughput with which a path continues. The throughput of a path is that of its
    /// largest channel.
    pub(super) min_weight: f64,
    /// `true` if sampled directions that point into the surface are mirrored at its tangent plane.
    pub(super) fold: bool,
    pub(super) camera: PerspectiveCamera,
    /// Candidate primitives of all rays of the picture together, for rays that belong to no tile.
    pub(super) all_candidates: TileCandidates,
    /// Light buffer of each light without a size: its possible occluders by direction. Shadow rays
    /// to a light without a buffer traverse the BVH.
    pub(super) light_buffers: Vec<Option<LightBuffer<L::Scalar>>>,
    pub(super) culling: CullingMode,
    pub(super) groups: LightGroups,
    /// Name of each light group of the scene.
    pub(super) group_names: Vec<String>,
    /// Scale of each light group: the number of integer steps per unit of radiance in the film.
    pub(super) scales: Vec<f64>,
    /// `true` if samples are distributed over the area of their pixel; `false` if they are at its
    /// centre.
    pub(super) jitter: bool,
    pub(super) inventory: String,
    /// One sentence for each setting of the scene that ends paths early, with an upper bound of the
    /// light that is lost.
    pub(super) truncation_biases: Vec<String>,
}

impl<L: SimdFloat> World<L> {
    /// Returns the number of light groups.
    pub fn groups(&self) -> usize {
        self.scales.len()
    }

    /// Returns the scale of each light group: the number of integer steps per unit of radiance in
    /// the film.
    pub fn scales(&self) -> &[f64] {
        &self.scales
    }

    /// Returns `true` if samples are distributed over the area of their pixel, and `false` if they
    /// are at its centre.
    pub fn jitter(&self) -> bool {
        self.jitter
    }

    /// Returns two flags: whether camera rays use random numbers for their position in the pixel,
    /// and whether they use random numbers for their position on the lens.
    pub fn camera_dimensions(&self) -> CameraDimensions {
        CameraDimensions { pixel: self.jitter, lens: self.camera.lens().is_some() }
    }

    /// Returns the camera, in coordinates relative to the scene's centre.
    pub fn camera(&self) -> &PerspectiveCamera {
        &self.camera
    }

    /// Creates the tracer of camera samples. `sampling` has the seed and the sample sequence.
    pub fn camera_tracer(&self, sampling: &SampleSettings) -> CameraTracer<'_, L> {
        CameraTracer::new(self, sampling)
    }

    /// Returns the primitives that the camera rays through a rectangle of the picture can hit, and
    /// those that can occlude shadow rays from the hit points of these camera rays. `origin` is the
    /// upper left corner of the rectangle, and `extent` its size \[pixels\]. Returns `None` if rays
    /// must be tested against all primitives.
    pub(super) fn candidates(
        &self,
        origin: [usize; 2],
        extent: [usize; 2],
    ) -> Option<TileCandidates> {
        self.culling.candidates(&self.geometry, self.light_lists(), &self.camera, (origin, extent))
    }

    /// Returns the number of lists of possible occluders: one for each light, and one for each
    /// stratum (spatial group) of the lights among which paths choose.
    pub(super) fn light_lists(&self) -> usize {
        self.all_candidates.occluders.len()
    }

    /// Returns the index of the first stratum (spatial group of the lights among which paths
    /// choose) in the lists of possible occluders.
    #[inline(always)]
    pub(super) fn first_stratum(&self) -> usize {
        self.sources.len() + self.emitters.len() + self.emission.counts()[0]
    }

    /// Returns `true` if the world has lights with a size, environment lights or emissive objects.
    #[inline(always)]
    pub(super) fn has_emitters(&self) -> bool {
        !self.emitters.is_empty() || !self.environments.is_empty() || !self.emission.is_empty()
    }

    /// Returns `true` if all samples of a tile with these candidate primitives are black: its
    /// camera rays have no candidate, the background is black, and no emitter is visible.
    pub(super) fn is_black(&self, candidates: &TileCandidates) -> bool {
        self.background.is_none()
            && candidates.primary.is_empty()
            && !self.emitters.iter().any(|source| source.visible)
            && !self.environments.iter().any(|source| source.visible)
    }

    /// Traces one packet of paths from the camera, and overwrites `path`. Lanes outside of `active`
    /// stay black. `candidates` are the primitives that the camera rays and the shadow rays from
    /// their hit points are tested against; `None` means all primitives.
    #[inline(always)]
    pub fn trace(
        &self,
        path: &mut Path<L>,
        candidates: Option<&TileCandidates>,
        sampler: &PacketSampler<'_, L>,
        active: L::Mask,
        out: &mut Radiance<L>,
    ) -> Counts {
        for group in &mut out.groups[..self.groups()] {
            *group = Vec3::zero();
        }
        let candidates = candidates.unwrap_or(&self.all_candidates);
        if let Some(limits) = self.diffuse_limits {
            return trace_generations(self, limits, path.ray, candidates, sampler, active, out);
        }
        if let Some(nested_dielectrics) = &self.nested_dielectrics {
            let mut start = Branch::camera(path.ray, active);
            nested_dielectrics.add_at_start(&path.ray, &mut start.media);
            TransmissionIntegrator { world: self, nested_dielectrics, sampler }
                .trace(&mut start, self.depth, candidates, None, out)
        } else {
            let trace = match (self.simple, !self.has_emitters()) {
                (true, true) => trace_opaque::<_, true, false>,
                (false, true) => trace_opaque::<_, false, false>,
                (_, false) => trace_opaque::<_, false, true>,
            };
            trace(self, (path, active, self.depth), candidates, sampler, None, out)
        }
    }

    /// Writes the first hit of the camera ray through each of `points` into `hits`, a slice of the
    /// same length. A point is a position in the picture: a column and a row in pixels, with
    /// fractions.
    pub fn first_hit(&self, points: &[[f64; 2]], hits: &mut [FirstHit]) {
        first_hit::trace_first_hits(self, points, hits);
    }
}

/// Type of [`World::trace`] for the SIMD type `L`.
type Trace<L> = fn(
    &World<L>,
    &mut Path<L>,
    Option<&TileCandidates>,
    &PacketSampler<'_, L>,
    <L as SimdFloat>::Mask,
    &mut Radiance<L>,
) -> Counts;

/// [`World::trace`] in both precisions. No code reads this static: it makes the compiler generate
/// the machine code of the kernels in this crate, so that other crates call it instead of
/// generating their own.
#[doc(hidden)]
pub static KERNELS: (Trace<Single>, Trace<Double>) = (World::trace, World::trace);
