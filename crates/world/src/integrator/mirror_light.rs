//! Light that clear flat mirrors throw: one reflection of each light, as direct light of the surfaces
//! in front of the mirror.
//!
//! A mirror shows a light at its image. The light is sampled for the image of the receiver, which sees
//! the light as the receiver sees its image, at the same distance and with the same density. A ray
//! to the mirror and a shadow ray from there test both segments. Diffuse bounces do not find
//! these emitters directly after a single reflection.

use crate::integrator::direct_lighting::cosine_pdf;
use crate::integrator::vertex::Vertex;
use crate::lights::emitters::Sampled;
use crate::lights::mirror_images::MirrorFace;
use crate::world::{LaneGroups, LightSource, World};
use glam::DVec3;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Float, Mask, SimdFloat, Vec3};
use zerkalo_scene::light::LightSample;
use zerkalo_scene::material::BsdfQuery;

/// First salt of the random numbers for lights in mirrors.
const MIRROR_SALT: u32 = 1 << 28;

/// Largest distance of the hit of a ray to a point of a mirror, as a multiple of that of the point. A
/// ray beside one face of a solid may hit another one behind it.
const FARTHEST_HIT: f64 = 1.001;

/// Flat face of a clear mirror that throws light.
pub(crate) struct FlatMirror<S> {
    primitive: u32,
    normal: [S; 3],
    center: [S; 3],
    radius: S,
    /// Height above the mirror at which shadow rays start.
    lift: S,
}

/// Packet of receivers as seen in a mirror.
struct Mirrored<L: SimdFloat> {
    /// Images of the receivers behind the mirror.
    origin: Vec3<L>,
    height: L,
    lanes: L::Mask,
}

impl<S: Float> FlatMirror<S> {
    pub fn new(primitive: u32, face: &MirrorFace, lift: f64) -> Self {
        let vector = |v: DVec3| v.to_array().map(S::from_f64);
        let (normal, center) = (vector(face.normal), vector(face.ball.center));
        let (radius, lift) = (S::from_f64(face.ball.radius), S::from_f64(lift));
        Self { primitive, normal, center, radius, lift }
    }
}

impl<L: SimdFloat> World<L> {
    /// Returns `true` if points of emitters are sampled for mirrors: there are few emitters, and no
    /// transmission.
    fn throws_emitters(&self) -> bool {
        self.lights.emitters.choices.is_empty() && self.nested_dielectrics.is_none()
    }

    /// Returns `density`, the density of reflected rays, with the mark of rays that sampling of lights
    /// in mirrors replaces, in the lanes of `bounced` that left a mirror `primitives` that throws light.
    #[inline(always)]
    pub(crate) fn thrown(&self, primitives: L, bounced: L, density: L) -> L {
        if self.mirrors.is_empty() || !self.throws_emitters() {
            return density;
        }
        let first = bounced.le(L::from_f64(super::indirect_diffuse::NO_PDF));
        let thrown = self
            .mirrors
            .iter()
            .fold(L::mask(false), |lanes, mirror| lanes | primitives.id_eq(mirror.primitive));
        L::select(first & thrown, L::from_f64(super::indirect_diffuse::THROWN_PDF), density)
    }
}

impl<L: SimdFloat> Vertex<'_, L> {
    /// Adds the light of all lights that arrives by one reflection at a mirror of `world.mirrors`.
    #[inline(never)]
    pub fn mirror_light(&mut self) {
        let (world, origin) = (self.world, self.shadow_origin::<false>());
        for (mirror, number) in world.mirrors.iter().zip(0..) {
            let normal = Vec3::splat(mirror.normal);
            let height = (origin - Vec3::splat(mirror.center)).dot(normal);
            let lanes = self.interaction.direct_mask & height.gt(L::splat(mirror.lift));
            if lanes.none() {
                continue;
            }
            let seen = Mirrored {
                origin: normal.mul_add(height * L::from_f64(-2.0), origin),
                height,
                lanes,
            };
            for source in &world.lights.delta_lights {
                let light = source.light.light.sample_li(seen.origin);
                self.add_mirrored(mirror, &seen, &source.with_light(light), None);
            }
            if !world.throws_emitters() {
                continue;
            }
            for index in 0.. {
                let salt = MIRROR_SALT + (number << 16) + index as u32;
                let numbers = self.sampler.light_2d(self.bounce, salt);
                let Some(source) = world.lights.emitters.sample(index, seen.origin, numbers) else {
                    break;
                };
                if source.visible {
                    self.out.counts.glossy = true;
                    self.add_mirrored(mirror, &seen, &source, Some(Sampled::One(index)));
                }
            }
        }
    }

    /// Adds the light of `source`, sampled for the `seen` receivers, that `mirror` throws.
    #[inline(always)]
    fn add_mirrored(
        &mut self,
        mirror: &FlatMirror<L::Scalar>,
        seen: &Mirrored<L>,
        source: &LightSource<LightSample<L>, L::Scalar>,
        emitter: Option<Sampled<'_>>,
    ) {
        let (world, light) = (self.world, &source.light);
        let (normal, zero) = (Vec3::splat(mirror.normal), L::zero());
        let rise = light.wi.dot(normal);
        let near = seen.height / rise;
        let point = light.wi.mul_add(near, seen.origin);
        let wi = normal.mul_add(rise * L::from_f64(-2.0), light.wi);
        let radius = L::splat(mirror.radius);
        let on_mirror = (point - Vec3::splat(mirror.center)).length_squared().le(radius * radius);
        let lit = seen.lanes & on_mirror & rise.gt(zero) & near.lt(light.distance);
        let lit = lit & self.facing::<false>(wi) & light.irradiance.x.gt(zero);
        if lit.none() {
            return;
        }
        self.out.counts.add_rays(lit);
        let ray = Ray { origin: self.shadow_origin::<false>(), direction: wi };
        let hit = world.geometry.closest_masked(&ray, world.geometry.all(), lit);
        let farthest = near.mul_add(L::from_f64(FARTHEST_HIT), L::splat(mirror.lift));
        let lit = lit & hit.t.lt(farthest) & hit.primitive.id_eq(mirror.primitive);
        let shadow = |vertex: &Self, lit| {
            let ray =
                Ray { origin: normal.mul_add(L::splat(mirror.lift), point), direction: light.wi };
            let end = light.distance - near;
            let occluded = world.geometry.occluded(&ray, end, lit, world.geometry.all());
            match emitter {
                Some(emitter) => {
                    vertex.emitter_shadow(emitter, (&ray, end), (lit, occluded), vertex.media)
                }
                None => vertex.shadow(occluded, &ray, end, vertex.media),
            }
        };
        self.add_light(LaneGroups::All(source.group), lit, shadow, |vertex, lit| {
            let bsdf = &world.bsdfs[world.bsdf_of[mirror.primitive as usize] as usize];
            let query = BsdfQuery { incident: wi, normal, fold: world.fold };
            let reflectance = bsdf.sample(&query, (zero, zero)).weight;
            let diffuse = cosine_pdf(vertex.interaction.normal.dot(wi));
            let highlights = vertex.highlights_beside(emitter.is_some() && source.visible, lit);
            let value = vertex.direct_value(wi, diffuse, highlights).component_mul(reflectance);
            source.emitted(vertex.unoccluded(value, light))
        });
    }
}
