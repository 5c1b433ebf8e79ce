//! Light at the boundary of two transparent media: Snell's law and Fresnel's equations, for SIMD
//! packets.
//!
//! Born and Wolf, *Principles of Optics*, sections 1.5.2 and 1.5.4.

use crate::material::bsdf::Transmission;
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3};

/// Refraction of incident rays, one per lane, at the boundary of two media.
#[derive(Clone, Copy, Debug)]
pub struct Interface<L: SimdFloat> {
    /// Unit direction of the refracted rays; undefined in lanes of `tir`.
    pub refracted: Vec3<L>,
    /// Lanes with total internal reflection (TIR).
    pub tir: L::Mask,
    /// Cosine of the angle of incidence at the boundary.
    cos_i: L,
    /// Cosine of the angle of refraction; 0 beyond the critical angle.
    cos_t: L,
    /// Index of refraction on the side of the incident rays.
    n_i: L,
    /// Index of refraction on the side of the refracted rays.
    n_t: L,
}

/// Factors of the radiance along reflected and transmitted rays at the boundary of two media.
#[derive(Clone, Copy, Debug)]
pub struct FresnelSplit<L> {
    /// Factor of the reflection lobe.
    pub reflected: L,
    /// Factor of the transmitted ray.
    pub transmitted: L,
    /// Factor of the mirror reflection that replaces the transmitted ray in total internal
    /// reflection.
    pub tir: L,
}

impl<L: SimdFloat> Interface<L> {
    /// Refracts rays with the unit direction `incident` at a boundary with the unit normal `n` on
    /// their side, where the index of refraction is `n_i`; behind the boundary it is `n_t`.
    ///
    /// The sine of the angle of refraction is sin t = (n_i / n_t) sin i. It is computed from the
    /// part of the direction along the boundary, so that grazing rays keep full precision. With
    /// equal indices the direction is unchanged.
    #[inline(always)]
    pub fn new(incident: Vec3<L>, n: Vec3<L>, n_i: L, n_t: L) -> Self {
        let cos_i = -incident.dot(n);
        let along = n.mul_add(cos_i, incident);
        let ratio = n_i / n_t;
        let same = n_i.le(n_t) & n_t.le(n_i);
        let sin2_t = ratio * ratio * along.length_squared();
        let tir = sin2_t.ge(L::one()).and_not(same);
        let cos_t = (L::one() - sin2_t).max(L::zero()).sqrt();
        let bent = n.mul_add(-cos_t, along * ratio).renormalize();
        Self {
            refracted: Vec3::select(same, incident, bent),
            tir,
            cos_i: cos_i.max(L::zero()),
            cos_t: L::select(same, cos_i.max(L::zero()), cos_t),
            n_i,
            n_t,
        }
    }

    /// Returns the reflectances of the boundary for s and p polarisation.
    #[inline(always)]
    fn polarised(&self) -> (L, L) {
        let Self { cos_i, cos_t, n_i, n_t, .. } = *self;
        let reflectance = |a: L, b: L| {
            // With equal indices and a grazing ray, a and b are zero: there is no boundary.
            let r = (a - b) / (a + b).max(L::from_f64(1e-30));
            r * r
        };
        let s = reflectance(n_i * cos_i, n_t * cos_t);
        let p = reflectance(n_t * cos_i, n_i * cos_t);
        (L::select(self.tir, L::one(), s), L::select(self.tir, L::one(), p))
    }

    /// Returns the reflectance F of the boundary for unpolarised light.
    #[inline(always)]
    pub fn reflectance(&self) -> L {
        let (s, p) = self.polarised();
        (s + p) * L::from_f64(0.5)
    }

    /// Returns the reflectance of a thin pane, with all inner reflections, for unpolarised light: the
    /// mean of 2 F / (1 + F) over both polarisations.
    #[inline(always)]
    pub fn pane_reflectance(&self) -> L {
        let (s, p) = self.polarised();
        s / (L::one() + s) + p / (L::one() + p)
    }

    /// Returns the factors of reflected and transmitted radiance. `outer` has the lanes of rays
    /// from outside a solid, `thin` the lanes of thin panes, which do not refract.
    ///
    /// Without Fresnel's equations, a solid reflects only on its outer side and in total internal
    /// reflection. This prevents endless reflections between its inner walls.
    #[inline(always)]
    pub fn split(
        &self,
        transmission: &Transmission<L::Scalar>,
        outer: L::Mask,
        thin: L::Mask,
    ) -> FresnelSplit<L> {
        let k_t = L::splat(transmission.strength);
        let tir = self.tir.and_not(thin);
        if !transmission.dielectric {
            return FresnelSplit {
                reflected: L::one().masked(thin | outer.and_not(self.tir)),
                transmitted: k_t.masked(!tir),
                tir: L::one().masked(tir),
            };
        }
        let mut f = self.reflectance();
        if thin.any() {
            f = L::select(thin, self.pane_reflectance(), f);
        }
        let transmitted = (k_t * (L::one() - f)).masked(!tir);
        FresnelSplit { reflected: f, transmitted, tir: L::zero() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::f0_from_index;
    use zerkalo_kernel::lanes::{Double, Single};

    /// Returns the interface at which a ray passes from a medium of index `n_i` to one of index
    /// `n_t`. The ray travels downwards, at `degrees` from the normal +z.
    fn interface<L: SimdFloat>(degrees: f64, n_i: f64, n_t: f64) -> Interface<L> {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let up = Vec3::of([0.0, 0.0, 1.0]);
        Interface::new(Vec3::of([sin, 0.0, -cos]), up, L::from_f64(n_i), L::from_f64(n_t))
    }

    /// Returns the fraction of the energy of unpolarised light that is transmitted: n_t cos t /
    /// (n_i cos i) times the mean of the squared amplitudes of both polarisations. i is the angle
    /// of incidence, t that of refraction.
    fn transmittance(i: &Interface<f64>) -> f64 {
        let Interface { cos_i, cos_t, n_i, n_t, .. } = *i;
        let s = 2.0 * n_i * cos_i / (n_i * cos_i + n_t * cos_t);
        let p = 2.0 * n_i * cos_i / (n_t * cos_i + n_i * cos_t);
        n_t * cos_t / (n_i * cos_i) * 0.5 * (s * s + p * p)
    }

    #[test]
    fn closed_form_11_normal_incidence_brewster_and_critical_angle() {
        for n in [1.0, 1.33, 1.5, 2.4, 1e3] {
            let f = f0_from_index(n);
            assert!((interface::<f64>(0.0, 1.0, n).reflectance() - f).abs() < 1e-14);
            assert!((interface::<f64>(0.0, n, 1.0).reflectance() - f).abs() < 1e-14);
            // Slab with all orders of inner reflection: R = 2 F / (1 + F), T = (1 - F) / (1 + F).
            let pane = interface::<f64>(0.0, 1.0, n).pane_reflectance();
            assert!((pane - 2.0 * f / (1.0 + f)).abs() < 1e-14, "{n}");
            assert!((1.0 - pane - (1.0 - f) / (1.0 + f)).abs() < 1e-14, "{n}");
            // At Brewster's angle p-polarised light is not reflected.
            let (_, p) = interface::<f64>(n.atan().to_degrees(), 1.0, n).polarised();
            assert!(p < 1e-20, "{n}: {p}");
            // At grazing incidence F is 1, except for n = 1: there is no boundary then.
            let grazing = interface::<f64>(90.0, 1.0, n).reflectance();
            assert!((grazing - if n == 1.0 { 0.0 } else { 1.0 }).abs() < 1e-9, "{n}: {grazing}");
        }
    }

    /// Checks that reflectance and transmittance add up to 1 at all angles, also near the critical
    /// angle, and that the reflectance is continuous there.
    #[test]
    fn extreme_25_total_reflection() {
        let mut worst = 0f64;
        for n in [1.0, 1.000_001, 1.5, 1e3] {
            let critical = (1.0f64 / n).asin().to_degrees();
            for step in -1000..=1000i32 {
                let degrees = (critical + f64::from(step) * 1e-10 * 57.3).min(90.0);
                let i = interface::<f64>(degrees, n, 1.0);
                let f = i.reflectance();
                assert!((0.0..=1.0).contains(&f), "{n} {degrees} {f}");
                assert_eq!(i.tir, f == 1.0 && n > 1.0, "{n} {degrees}");
                if !i.tir && n > 1.0 {
                    assert!((f + transmittance(&i) - 1.0).abs() < 1e-12, "{n} {degrees}");
                    // Let d be the angular distance from the critical angle c. Then cos^2 t = 2 d
                    // cot c, and 1 - F is at most 4 n cos t / cos i.
                    let d = f64::from(step.abs()) * 1e-10 * 57.3_f64.to_radians();
                    let cos_t = (2.0 * d * (n * n - 1.0).sqrt()).sqrt();
                    let jump = 4.0 * n * cos_t / (1.0 - 1.0 / (n * n)).sqrt();
                    assert!(f >= 1.0 - 1.01 * jump - 1e-5 * n, "{n} {degrees} {f}");
                }
                for c in [i.refracted.x, i.refracted.y, i.refracted.z] {
                    assert!(c.is_finite(), "{n} {degrees}");
                }
            }
            for degrees in 0..=900 {
                let degrees = f64::from(degrees) * 0.1;
                for (n_i, n_t) in [(1.0, n), (n, 1.0)] {
                    let i = interface::<f64>(degrees, n_i, n_t);
                    let f = i.reflectance();
                    let t = if i.tir || degrees == 90.0 { 1.0 - f } else { transmittance(&i) };
                    assert!((f + t - 1.0).abs() < 1e-12, "{n_i} {n_t} {degrees}: {f} {t}");
                    worst = worst.max((f + t - 1.0).abs());
                    let single = interface::<f32>(degrees, n_i, n_t).reflectance();
                    assert!((0.0..=1.000_001).contains(&single), "{n_i} {n_t} {degrees}");
                }
            }
        }
        println!("extreme 25 | double | R + T = 1 within {worst:.0e}, finite");
        println!("extreme 25 | single | R in [0, 1 + 1e-6]");
    }

    /// Checks Snell's law, and that the refracted ray refracts back into the incident one.
    #[test]
    fn refraction_obeys_snell_and_is_reversible() {
        for degrees in [0.0, 1e-6, 20.0, 45.0, 70.0, 89.0, 89.999] {
            let t = interface::<f64>(degrees, 1.0, 1.5).refracted;
            assert!((t.x - degrees.to_radians().sin() / 1.5).abs() < 1e-15);
            assert!((t.length_squared() - 1.0).abs() < 1e-14 && t.z < 0.0);
            let up = Vec3::of([0.0, 0.0, -1.0]);
            let back = Interface::<f64>::new(-t, up, 1.5, 1.0).refracted;
            let (sin, cos) = degrees.to_radians().sin_cos();
            assert!((back.x + sin).abs() < 1e-12 && (back.z - cos).abs() < 1e-9, "{degrees}");
        }
        let straight = interface::<Single>(50.0, 1.3, 1.3);
        let (sin, _) = 50f64.to_radians().sin_cos();
        assert_eq!(SimdFloat::lane(straight.refracted.x, 3), sin as f32);
        assert!(straight.tir.none());
        assert_eq!(SimdFloat::lane(straight.reflectance(), 0), 0.0);
    }

    #[test]
    fn wide_refraction_equals_scalar() {
        for degrees in [0.0, 30.0, 41.810_3, 41.810_4, 60.0, 89.9] {
            let (wide, one) =
                (interface::<Double>(degrees, 1.5, 1.0), interface::<f64>(degrees, 1.5, 1.0));
            assert_eq!(SimdFloat::lane(wide.refracted.x, 1), one.refracted.x);
            assert_eq!(SimdFloat::lane(wide.reflectance(), 2), one.reflectance());
            assert_eq!(Mask::lane(wide.tir, 0), one.tir);
        }
    }
}
