//! Light of environments, by multiple importance sampling.
//!
//! Three strategies find the light of an environment. The first samples a direction where the
//! environment is brighter than on average. The second is the reflected ray of a glossy lobe. The
//! third samples a cosine-weighted direction. Glossy lobes combine the first and the second by the
//! power heuristic, diffuse surfaces and highlights the first and the third. Mirrors and the camera
//! use only the light at the end of their ray.
//!
//! A ray that starts at a diffuse bounce adds nothing where it escapes, because direct lighting at
//! the start of the ray already includes all environments.

use crate::integrator::direct_lighting::cosine_pdf;
use crate::integrator::emitter_lighting::{ReflectedRays, power_heuristic};
use crate::integrator::indirect_diffuse::{NO_PDF, THROWN_PDF};
use crate::integrator::nested_dielectrics::{Media, attenuated};
use crate::integrator::path::{Path, Radiance};
use crate::integrator::vertex::Vertex;
use crate::world::{EnvironmentSource, LaneGroups, LightSource, World};
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Frame, Mask, SimdFloat, Vec3};
use zerkalo_kernel::sampling::warp;
use zerkalo_scene::light::LightSample;

/// First salt of the random numbers for environments. Each emitter has a salt of its own, smaller
/// than this one, and each environment has two, so that their random numbers are independent.
const ENVIRONMENT_SALT: u32 = 1 << 30;

/// Adds the radiance of the visible environments, weighted for multiple importance sampling, to
/// `out`. The rays of `lanes`, in `media`, hit no surface.
pub(crate) fn visible_environments<L: SimdFloat>(
    world: &World<L>,
    path: &Path<L>,
    lanes: L::Mask,
    media: Option<Media<'_, L>>,
    out: &mut Radiance<L>,
) {
    let lanes = lanes & path.lobe_pdf.gt(L::from_f64(NO_PDF));
    if lanes.none() {
        return;
    }
    for source in world.lights.environments.iter().filter(|source| source.visible) {
        let (radiance, pdf) = source.light.radiance(path.ray.direction, lanes);
        // No environment is sampled through a mirror.
        let is_sampled = path.lobe_pdf.gt(L::from_f64(THROWN_PDF));
        let weight = L::select(is_sampled, power_heuristic(path.lobe_pdf, pdf), L::one());
        let radiance = path.throughput.component_mul(radiance) * weight;
        let radiance = attenuated(media, radiance, L::from_f64(L::MAX));
        out.groups[source.group] += source.emitted(radiance).masked(lanes);
    }
}

impl<L: SimdFloat> Vertex<'_, L> {
    /// Adds the light of all environments that the surfaces reflect. `glossy` are the reflected
    /// rays of glossy lobes, the second strategy.
    #[inline(never)]
    pub fn environment_lighting(&mut self, glossy: &ReflectedRays<L>) {
        let interaction = self.interaction;
        self.out.counts.glossy = true;
        for (index, environment) in self.world.lights.environments.iter().enumerate() {
            let source = self.sample_environment(index, interaction.direct_mask | glossy.lanes);
            let light = &source.light;
            let arrives = self.arrives(light.wi);
            let rays = source.visible.then_some(glossy);
            let value =
                self.reflected(light, arrives, rays, |pdf| power_heuristic(light.density, pdf));
            self.add_environment(environment, light.wi, value.component_mul(light.irradiance));
            if interaction.direct_mask.any() {
                self.add_cosine_sample(index, environment);
            }
        }
    }

    /// Samples a direction of the environment with the number `index`, in `lanes`.
    #[inline(always)]
    pub fn sample_environment(
        &self,
        index: usize,
        lanes: L::Mask,
    ) -> LightSource<LightSample<L>, L::Scalar> {
        let numbers = self.sampler.light_2d(self.bounce, ENVIRONMENT_SALT + 2 * index as u32);
        let source = &self.world.lights.environments[index];
        source.with_light(source.light.sample(numbers, lanes))
    }

    /// Adds the light of an environment from a cosine-weighted direction (third strategy).
    #[inline(always)]
    fn add_cosine_sample(&mut self, index: usize, environment: &EnvironmentSource<L::Scalar>) {
        let interaction = self.interaction;
        let salt = ENVIRONMENT_SALT + 2 * index as u32 + 1;
        let (u, v) = self.sampler.light_2d(self.bounce, salt);
        let local = warp::cosine_hemisphere(u, v);
        let cos = local.z;
        let wi = Frame::around(interaction.normal).to_world(local).renormalize();
        let faces = self.arrives(wi) & cos.gt(L::zero());
        let arrives = interaction.direct_mask & faces;
        let (radiance, pdf) = environment.light.radiance(wi, arrives);
        let density = cosine_pdf(cos);
        let mut value = interaction.diffuse;
        let highlights = self.highlights_beside(environment.visible, interaction.highlight_mask);
        for (index, lanes) in interaction.bsdfs(highlights & arrives) {
            let highlight = self.world.bsdfs[index].highlight(&self.query(), wi);
            value += (highlight * (L::one() / density)).masked(lanes);
        }
        let weight = power_heuristic(density, pdf);
        let value = value.component_mul(radiance) * weight;
        self.add_environment(environment, wi, value.masked(arrives));
    }

    /// Adds reflected light of an environment. `wi` are the directions from which it arrives, and
    /// `value` is the reflected radiance if nothing occludes it.
    #[inline(always)]
    fn add_environment(
        &mut self,
        environment: &EnvironmentSource<L::Scalar>,
        wi: Vec3<L>,
        value: Vec3<L>,
    ) {
        let (geometry, origin) = (&self.world.geometry, self.shadow_origin::<false>());
        let shadow = |vertex: &Self, lit| {
            let (ray, t_max) = (Ray { origin, direction: wi }, L::from_f64(L::MAX));
            let occluded = geometry.occluded(&ray, t_max, lit, geometry.all());
            vertex.shadow(occluded, &ray, t_max, vertex.media)
        };
        let lit = value.max_element().gt(L::zero());
        self.add_light(LaneGroups::All(environment.group), lit, shadow, |vertex, _| {
            environment.emitted(vertex.path.throughput.component_mul(value))
        });
    }
}
