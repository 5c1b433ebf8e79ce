//! Transmission of the reference tracer. The media on both sides of a surface are found by point
//! tests just in front of and just behind it.

use crate::answers::reflect;
use crate::common::Numbers;
use crate::compounds::Body;
use crate::tracer::{Hit, Mutation, Tracer};
use glam::DVec3;
use zerkalo::material::{Fresnel, Material};

/// Distance of the tested points from the surface.
const ASIDE: f64 = 1e-6;

/// Continuation of a path.
pub enum Way {
    /// Unchanged direction: another solid fills the space, so that the surface has no effect.
    Straight,
    /// Direction and throughput; `None` if the path ends.
    On(Option<(DVec3, DVec3)>),
}

/// Reflectance of both polarisations by the angles on both sides. The angle `t` is `None` for total
/// internal reflection.
fn polarised(i: f64, t: Option<f64>, n_i: f64, n_t: f64) -> [f64; 2] {
    let Some(t) = t else { return [1.0; 2] };
    if i < 1e-4 {
        return [((n_t - n_i) / (n_t + n_i)).powi(2); 2];
    }
    [((i - t).sin() / (i + t).sin()).powi(2), ((i - t).tan() / (i + t).tan()).powi(2)]
}

impl Tracer<'_> {
    fn transparent<'a>(&'a self, body: &'a Body) -> Option<&'a Material> {
        let materials = body.leaves.iter().map(|leaf| self.material(&leaf.material));
        if body.is_open() { None } else { materials.into_iter().find(|m| m.transmission > 0.0) }
    }

    /// Index and index of refraction of the solid that fills the space at `point`: the one listed
    /// last.
    fn medium(&self, point: DVec3) -> (Option<usize>, f64) {
        let bodies = self.bodies.iter().enumerate().rev();
        bodies
            .filter_map(|(i, body)| Some((i, body, self.transparent(body)?)))
            .find(|(_, body, _)| body.holds(point))
            .map_or((None, 1.0), |(i, _, material)| (Some(i), material.ior))
    }

    /// Chooses reflection or transmission at `hit`, whose material transmits, at random.
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
            // Sum over all internal reflections between the two sides of a pane.
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
        let share = |way: &Option<(DVec3, DVec3)>| way.map_or(0.0, |w| w.1.max_element());
        let (r, t) = (share(&mirrored), share(&passed));
        if r + t == 0.0 {
            return Way::On(None);
        }
        let p = r / (r + t);
        let (way, chance, side) =
            if numbers.unit() < p { (mirrored, p, 1.0) } else { (passed, 1.0 - p, -1.0) };
        // Directions on the wrong side because of bumps are mirrored to the right one.
        let to = side * hit.normal;
        Way::On(way.map(|(d, k)| (d - 2.0 * d.dot(to).min(0.0) * to, k / chance)))
    }
}
