//! Refraction and transmission of the reference tracer, an independent slow implementation. It
//! finds the media on both sides of a surface by testing two points, one just in front of the
//! surface and one just behind it.

use crate::harness::*;
use crate::reference::compounds::Body;
use crate::reference::reflection::{
    Indices, fresnel, has_facets, is_sharp, reflect, refracted_at_facet, spread,
};
use crate::reference::tracer::{Hit, Mutation, Tracer};

/// Distance from a surface to the two tested points in front of it and behind it, in scene units.
const ASIDE: f64 = 1e-6;

/// Direction and throughput of a path's next ray.
type Next = (DVec3, DVec3);

/// Continuation of a path at a transmitting surface.
pub enum Way {
    /// The path continues unchanged. The surface has no effect, because another solid fills the
    /// space on both sides.
    Straight,
    /// The path continues with this direction and throughput; `None` if it ends.
    On(Option<(DVec3, DVec3)>),
}

/// Returns the reflectance of both polarisations. `i` and `t` are the angles of incidence and
/// refraction; `t` is `None` for total internal reflection.
fn polarised(i: f64, t: Option<f64>, n_i: f64, n_t: f64) -> [f64; 2] {
    let Some(t) = t else { return [1.0; 2] };
    if i < 1e-4 {
        return [((n_t - n_i) / (n_t + n_i)).powi(2); 2];
    }
    [((i - t).sin() / (i + t).sin()).powi(2), ((i - t).tan() / (i + t).tan()).powi(2)]
}

/// Returns the reflectance of unpolarised light. `c` is the cosine of the angle of incidence.
pub fn reflectance(c: f64, n_i: f64, n_t: f64) -> f64 {
    let i = c.clamp(0.0, 1.0).acos();
    let sin_t = n_i / n_t * i.sin();
    let t = (sin_t < 1.0).then(|| sin_t.asin());
    polarised(i, t, n_i, n_t).iter().sum::<f64>() / 2.0
}

/// Returns the transmitting material that fills `body`. Returns `None` for an opaque body and for a
/// surface without a volume.
pub fn medium<'a>(scene: &'a Scene, body: &Body) -> Option<&'a Material> {
    let mut materials = body.leaves.iter().filter_map(|leaf| scene.materials.get(&leaf.material));
    if body.is_open() { None } else { materials.find(|m| m.transmission > 0.0) }
}

impl Tracer<'_> {
    /// Returns the index of the solid that fills the space at `point`, and the index of refraction
    /// there. Of several solids at the point, the one listed last in the scene fills the space.
    fn medium(&self, point: DVec3) -> (Option<usize>, f64) {
        self.filling(point).map_or((None, 1.0), |(i, material)| (Some(i), material.ior))
    }

    fn filling(&self, point: DVec3) -> Option<(usize, &Material)> {
        let bodies = self.bodies.iter().zip(&self.media).enumerate().rev();
        bodies
            .filter_map(|(i, (body, medium))| Some((i, body, (*medium)?)))
            .find(|(_, body, _)| body.holds(point))
            .map(|(i, _, material)| (i, material))
    }

    /// Returns the share of light that is not absorbed on the way from `origin` to `end`. If `end`
    /// is `None`, the way extends to infinity along `direction`.
    pub fn transmittance(&self, origin: DVec3, end: Option<DVec3>, direction: DVec3) -> DVec3 {
        if self.scene.trace.ray_types < RayTypes::Full || !self.absorbs {
            return DVec3::ONE;
        }
        let middle = end.map_or(origin + direction * ASIDE, |end| 0.5 * (origin + end));
        let Some((_, material)) = self.filling(middle) else { return DVec3::ONE };
        let distance = end.map_or(f64::INFINITY, |end| origin.distance(end));
        let mut share = distance / material.attenuation_distance;
        if self.mutation == Mutation::HalfAbsorption {
            share *= 0.5;
        }
        let left = |c: f64| if c == 1.0 { 1.0 } else { c.powf(share) };
        DVec3::from(material.attenuation_color.0.map(left))
    }

    /// Returns `true` if body `i` is a pane without roughness, through which lights shine.
    pub fn is_clear_pane(&self, i: usize) -> bool {
        let (trace, material) = (&self.scene.trace, self.materials[i][0]);
        let traced = trace.ray_types == RayTypes::Full && trace.max_depth > 0;
        traced && self.bodies[i].is_open() && material.transmission > 0.0 && is_sharp(material)
    }

    /// Returns the share of light in the direction `direction` that the pane at `hit` transmits.
    pub fn pane_transmittance(&self, hit: &Hit, direction: DVec3) -> f64 {
        let (_, n_i) = self.medium(hit.point + hit.normal * ASIDE);
        let (f, _) = self.reflectance(hit, -direction.dot(hit.seen), (n_i, hit.material.ior));
        let dielectric = hit.material.fresnel_mode() == Fresnel::Dielectric;
        hit.material.transmission * if dielectric { 1.0 - f } else { 1.0 }
    }

    /// Chooses reflection or transmission at random for a ray in the direction `direction` that
    /// hits a transmitting material.
    pub fn through(&self, hit: &Hit, direction: DVec3, numbers: &mut Numbers) -> Way {
        let (material, n) = (hit.material, hit.seen);
        let open = self.bodies[hit.body].is_open();
        let (before, n_i) = self.medium(hit.point + hit.normal * ASIDE);
        let (behind, mut n_t) = self.medium(hit.point - hit.normal * ASIDE);
        if open {
            n_t = material.ior;
        } else if before == behind {
            return Way::Straight;
        }
        if !is_sharp(material) {
            let [mirrored, passed] = self.rough(hit, direction, (n_i, n_t), numbers);
            return self.one_of(hit, mirrored, passed, numbers);
        }
        let i = (-direction.dot(n)).min(1.0).acos();
        let sin_t = n_i / n_t * i.sin();
        let t = (sin_t < 1.0).then(|| sin_t.asin());
        if self.mutation == Mutation::NoBending && !open {
            n_t = n_i;
        }
        let onward = if open || n_t == n_i {
            Some(direction)
        } else {
            t.map(|t| {
                let along = (direction + n * i.cos()).normalize_or_zero();
                along * t.sin() - n * t.cos()
            })
        };
        let dielectric = material.fresnel_mode() == Fresnel::Dielectric;
        let f = match (dielectric, open) {
            (true, false) => polarised(i, t, n_i, n_t).iter().sum::<f64>() / 2.0,
            // Mean of both polarisations. The term of each, 2 r / (1 + r), is the sum over all
            // internal reflections between the two sides of a pane.
            (true, true) => polarised(i, t, n_i, n_t).iter().map(|r| r / (1.0 + r)).sum(),
            (false, _) => 1.0,
        };
        let mirrors = match (dielectric, open) {
            _ if hit.bare => false,
            (false, false) => hit.front && t.is_some(),
            _ => true,
        };
        let plain = Material { fresnel: None, ..material.clone() };
        let reflecting = if dielectric { &plain } else { material };
        let horizon = self.scene.trace.below_horizon;
        let mirrored = if !dielectric && !open && t.is_none() {
            Some((direction - 2.0 * direction.dot(n) * n, DVec3::ONE))
        } else if mirrors && material.reflection > 0.0 {
            reflect(reflecting, n, -direction, horizon, self.mutation, numbers)
                .map(|(d, k)| (d, k * f))
        } else {
            None
        };
        let k_t = material.transmission * if dielectric { 1.0 - f } else { 1.0 };
        let passed = onward.map(|d| (d, DVec3::splat(k_t)));
        self.one_of(hit, mirrored, passed, numbers)
    }

    /// Chooses at random between the reflected and the transmitted ray, in proportion to their
    /// weights.
    fn one_of(
        &self,
        hit: &Hit,
        mirrored: Option<Next>,
        passed: Option<Next>,
        numbers: &mut Numbers,
    ) -> Way {
        let share = |way: &Option<(DVec3, DVec3)>| way.map_or(0.0, |w| w.1.max_element());
        let (r, t) = (share(&mirrored), share(&passed));
        if r + t == 0.0 {
            return Way::On(None);
        }
        let p = r / (r + t);
        let (way, chance, side) =
            if numbers.unit() < p { (mirrored, p, 1.0) } else { (passed, 1.0 - p, -1.0) };
        // Bump maps can give a direction on the wrong side of the surface. It is mirrored to the
        // right side.
        let to = side * hit.normal;
        Way::On(way.map(|(d, k)| (d - 2.0 * d.dot(to).min(0.0) * to, k / chance)))
    }

    /// Returns the reflectance of a smooth surface or a microfacet, and `true` for total
    /// reflection. `c` is the cosine of the angle of incidence. The reflectance is 1 for a material
    /// that is not dielectric.
    fn reflectance(&self, hit: &Hit, c: f64, (n_i, n_t): Indices) -> (f64, bool) {
        let i = c.clamp(0.0, 1.0).acos();
        let sin_t = n_i / n_t * i.sin();
        let t = (sin_t < 1.0).then(|| sin_t.asin());
        let polarised = polarised(i, t, n_i, n_t);
        let open = self.bodies[hit.body].is_open();
        let f = match hit.material.fresnel_mode() {
            Fresnel::Dielectric if open => polarised.iter().map(|r| r / (1.0 + r)).sum(),
            Fresnel::Dielectric => polarised.iter().sum::<f64>() / 2.0,
            _ => 1.0,
        };
        (f, t.is_none() && !open)
    }

    /// Samples the reflected and the transmitted ray at a rough surface, each with random numbers
    /// of its own.
    fn rough(
        &self,
        hit: &Hit,
        direction: DVec3,
        indices: Indices,
        numbers: &mut Numbers,
    ) -> [Option<Next>; 2] {
        let (material, n, v) = (hit.material, hit.seen, -direction);
        let open = self.bodies[hit.body].is_open();
        let facets = has_facets(material);
        let dielectric = material.fresnel_mode() == Fresnel::Dielectric;
        let horizon = self.scene.trace.below_horizon;
        let white =
            Material { fresnel: None, f0: None, metal: None, reflection: 1.0, ..material.clone() };
        let reflect_white =
            |numbers: &mut Numbers| reflect(&white, n, v, horizon, self.mutation, numbers);
        // Cosine of the angle between `v` and the normal of the microfacet that reflects `v` to
        // `l`. Without microfacets, the surface normal is used.
        let cosine = |l: DVec3| v.dot(if facets { (v + l).normalize() } else { n });
        let mirrored = reflect_white(numbers).and_then(|(l, weight)| {
            let (f, total) = self.reflectance(hit, cosine(l), indices);
            if total && !dielectric {
                return Some((l, weight));
            }
            if hit.bare || !(dielectric || open || hit.front) {
                return None;
            }
            let k = if dielectric {
                DVec3::splat(material.reflection)
            } else {
                fresnel(material, v.dot((v + l).normalize())) * material.reflection
            };
            Some((l, weight * k * f))
        });
        if indices.0 == indices.1 && !open {
            return [mirrored, Some((direction, DVec3::splat(material.transmission)))];
        }
        let k_t = |c: f64| {
            let (f, total) = self.reflectance(hit, c, indices);
            let left = if dielectric { 1.0 - f } else { 1.0 };
            material.transmission * if total { 0.0 } else { left }
        };
        let passed = if facets && open {
            // The ray that a pane of microfacets transmits is sampled as a reflected ray, which is
            // then mirrored to the other side.
            reflect_white(numbers)
                .map(|(l, weight)| (l - 2.0 * l.dot(n) * n, weight * k_t(cosine(l))))
        } else if facets {
            refracted_at_facet(material, n, v, indices, self.mutation, numbers)
                .map(|(l, weight, h)| (l, DVec3::splat(weight * k_t(v.dot(h)))))
        } else {
            let c = v.dot(n);
            let ratio = indices.0 / indices.1;
            let cos_t = (1.0 - ratio * ratio * (1.0 - c * c)).max(0.0).sqrt();
            let axis = if open { direction } else { direction * ratio + n * (ratio * c - cos_t) };
            let mut l = spread(material, axis.normalize(), material.roughness, numbers);
            let wrong = l.dot(n) >= 0.0;
            if wrong {
                l -= 2.0 * l.dot(n) * n;
            }
            let kept = !wrong || horizon == BelowHorizon::Fold;
            kept.then(|| (l, DVec3::splat(k_t(c))))
        };
        [mirrored, passed]
    }
}
