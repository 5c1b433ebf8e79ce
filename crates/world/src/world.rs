//! `World`: a compiled scene, as the integrators read it.

use crate::any_world::Precision;
use crate::compile::CompiledLights;
use crate::culling::tile::{Culling, TileCandidates};
use crate::integrator::indirect_diffuse::DiffuseLimits;
use crate::integrator::mirror_light::FlatMirror;
use crate::integrator::nested_dielectrics::NestedDielectrics;
use crate::integrator::surface_textures::SurfaceTextures;
use crate::integrator::turned_material::TurnedMaterial;
use crate::lights::groups::LightGroups;
use crate::lights::on_surfaces::OnSurface;
use zerkalo_kernel::lanes::{Float, SimdFloat, Vec3};
use zerkalo_kernel::primitive::Aggregate;
use zerkalo_kernel::sampling::CameraDimensions;
use zerkalo_scene::IntegratorSettings;
use zerkalo_scene::camera::CompiledCamera;
use zerkalo_scene::light::{DeltaLight, EnvironmentLight};
use zerkalo_scene::material::Bsdf;

/// Compiled light of type `T`, with its light group. `S` is the scalar type.
pub(super) struct LightSource<T, S> {
    pub light: T,
    /// Index of the light group.
    pub group: usize,
    /// Emission, colour times intensity, of a light that shares its group. `None` for a light with
    /// a group of its own, which is traced as white light of intensity 1.
    pub emission: Option<[S; 3]>,
    /// `true` if the camera and reflected rays see the light; not used for lights without a size.
    pub visible: bool,
}

impl<T, S: Float> LightSource<T, S> {
    /// Returns `value` times the emission of a light that shares its group.
    #[inline(always)]
    pub fn emitted<L: SimdFloat<Scalar = S>>(&self, value: Vec3<L>) -> Vec3<L> {
        match self.emission {
            Some(emission) => value.component_mul(Vec3::splat(emission)),
            None => value,
        }
    }

    /// Returns this source with another `light`.
    #[inline(always)]
    pub fn with_light<U>(&self, light: U) -> LightSource<U, S> {
        let Self { group, emission, visible, .. } = *self;
        LightSource { light, group, emission, visible }
    }
}

/// Light without a size, and the end points of shadow rays to it.
pub(super) struct ShadowRayTarget<S> {
    pub light: DeltaLight<S>,
    /// End points of the shadow rays; `None` if they end at the light itself.
    pub on_surface: Option<OnSurface<S>>,
}

/// Light groups of the samples in the lanes of a packet.
#[derive(Clone, Copy)]
pub(super) enum LaneGroups<L> {
    All(usize),
    /// Number of the group in each lane.
    Each(L),
}

pub(super) type DeltaSource<S> = LightSource<ShadowRayTarget<S>, S>;

pub(super) type EnvironmentSource<S> = LightSource<EnvironmentLight, S>;

/// Scene compiled for the SIMD type `L`. Fields of features that the scene does not use are empty
/// or `None`.
pub struct World<L: SimdFloat> {
    /// All primitives of the scene, in coordinates relative to the scene's centre.
    pub(super) geometry: Aggregate<L>,
    /// Number of the object of each form in the scene file.
    pub(super) objects: Vec<u32>,
    /// `true` for each primitive that rays hit only from outside: a convex solid in which no camera
    /// ray starts and no transmitted ray runs.
    pub(super) outside_only: Vec<bool>,
    /// For each primitive, the index of its BSDF in `bsdfs`.
    pub(super) bsdf_of: Vec<u32>,
    pub(super) bsdfs: Vec<Bsdf<L::Scalar>>,
    /// Material whose lobe is divided; `None` if there is none.
    pub(super) turned: Option<TurnedMaterial>,
    pub(super) lights: CompiledLights<L::Scalar>,
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
    /// `true` if the world is neither `smooth` nor `colored`, has no emitters, and all its primitives
    /// are in linear lists, without BVH and bounding boxes. Kernels have a faster instance for such
    /// worlds.
    pub(super) simple: bool,
    pub(super) surface_textures: SurfaceTextures<L>,
    /// Mirrors that throw light; empty without `mirror_light`.
    pub(super) mirrors: Vec<FlatMirror<L::Scalar>>,
    pub(super) nested_dielectrics: Option<NestedDielectrics<L>>,
    /// Largest number of surfaces on a path after the first; 0 if no surface reflects or transmits.
    pub(super) depth: u32,
    /// Limits of indirect diffuse light; `None` if the scene has none.
    pub(super) diffuse_limits: Option<DiffuseLimits>,
    /// Smallest throughput, in its largest channel, with which a path continues.
    pub(super) min_throughput: f64,
    /// `true` if sampled reflections below the horizon are mirrored, `false` if they are absorbed.
    pub(super) fold: bool,
    /// Camera, in coordinates relative to the scene's centre.
    pub camera: CompiledCamera,
    pub(super) culling: Culling<L::Scalar>,
    /// Properties that do not depend on the SIMD type.
    pub info: WorldInfo,
    /// `true` if samples are distributed over the area of their pixel, not at its centre.
    pub jitter: bool,
}

/// Properties of a compiled scene that do not depend on its SIMD type.
pub struct WorldInfo {
    /// Light groups.
    pub groups: LightGroups,
    /// Scale of each light group: the number of integer steps per unit of radiance in the film, a
    /// power of two.
    pub scales: Vec<f64>,
    /// Precision of the SIMD type, single or double.
    pub precision: Precision,
    /// Name of the SIMD type, such as `f32x8`.
    pub lanes: &'static str,
    /// Number of successive samples of a pixel that together trace a shadow ray to each light once;
    /// 1 if every sample traces shadow rays to all lights.
    pub light_period: u32,
    /// List of the features that the compiled scene contains.
    pub inventory: String,
    /// One sentence for each setting of the scene that ends paths early, such as `max_depth`. Each
    /// sentence gives an upper bound of the light that is lost.
    pub biases: Vec<String>,
    /// Light that the settings of the scene leave out, such as `no bounces`.
    pub left_out: Vec<&'static str>,
    /// Number of primitives, with each triangle of a mesh.
    pub primitives: u64,
}

impl<L: SimdFloat> World<L> {
    /// Returns which random positions camera rays use: in the pixel, on the lens, both or none.
    pub fn camera_dimensions(&self) -> CameraDimensions {
        CameraDimensions { pixel: self.jitter, lens: self.camera.lens.is_some() }
    }

    /// Lets paths be longer than `trace`, the settings of the scene, permits: twice as long for each
    /// of `doublings`. Reflections and bounces that these settings switch off stay off.
    pub fn lengthen_paths(&mut self, trace: &IntegratorSettings, doublings: u32) {
        if self.depth > 0 {
            self.depth = trace.max_depth << doublings;
        }
        if let Some(limits) = &mut self.diffuse_limits {
            limits.depth = trace.max_diffuse_depth << doublings;
        }
        self.min_throughput = trace.min_throughput * 0.0625f64.powi(doublings as i32);
    }

    /// Divides the lobe of the one material that is rougher than in the world `inner` of an otherwise
    /// equal scene: into the lobe of `inner` and the rest. Returns the share of the lobe of `inner`.
    /// `None` if the lobes are not nested, or if paths do more than reflect.
    pub(super) fn turn(&mut self, inner: &Self) -> Option<f64> {
        let plain = self.nested_dielectrics.is_none() && self.diffuse_limits.is_none();
        if !plain || self.bsdf_of != inner.bsdf_of || self.bsdfs.len() != inner.bsdfs.len() {
            return None;
        }
        let divided = |(i, (own, inner)): (usize, (&Bsdf<_>, &Bsdf<_>))| {
            own.outside(inner).map(|(rest, share)| (i, rest, share))
        };
        let mut divided = self.bsdfs.iter().zip(&inner.bsdfs).enumerate().filter_map(divided);
        let (index, rest, share) = divided.next().filter(|_| divided.next().is_none())?;
        drop(divided);
        let parts = self.bsdfs.len() as u32;
        self.bsdfs.extend([rest, inner.bsdfs[index]]);
        self.turned = Some(TurnedMaterial { index: index as u32, parts, share, order: 0 });
        Some(share)
    }

    /// Returns `true` if all samples of a tile with these candidates are black.
    pub(super) fn is_black(&self, candidates: &TileCandidates) -> bool {
        self.background.is_none()
            && candidates.primary.is_empty()
            && self.lights.emitters.visible_lights().next().is_none()
            && !self.lights.environments.iter().any(|source| source.visible)
    }

    /// Returns the lanes in which `throughput` is large enough for the path to continue.
    #[inline(always)]
    pub(super) fn reaches_min_throughput(&self, throughput: Vec3<L>) -> L::Mask {
        let max_throughput = throughput.max_element();
        max_throughput.gt(L::zero()) & max_throughput.ge(L::from_f64(self.min_throughput))
    }
}
