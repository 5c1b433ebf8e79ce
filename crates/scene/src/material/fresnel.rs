//! Fresnel reflectance of materials as a function of the angle, per colour channel.

use crate::material::{Fresnel, Material};
use zerkalo_kernel::lanes::{Float, SimdFloat, Vec3};

/// Returns the index of refraction with the reflectance `f0` at normal incidence: (1 + sqrt F0) /
/// (1 - sqrt F0); infinite for F0 = 1.
///
/// Cook and Torrance 1982, *A Reflectance Model for Computer Graphics*.
pub fn index_from_f0(f0: f64) -> f64 {
    let root = f0.sqrt();
    (1.0 + root) / (1.0 - root)
}

/// Returns the reflectance of a dielectric of index `n` at normal incidence, ((n - 1) / (n + 1))^2:
/// the inverse of [`index_from_f0`].
pub fn f0_from_index(n: f64) -> f64 {
    ((n - 1.0) / (n + 1.0)).powi(2)
}

/// Fresnel reflectance of a material, compiled for the kernels.
#[derive(Clone, Copy, Debug)]
pub struct Reflectance<S> {
    mode: Fresnel,
    f0: [S; 3],
    /// Squared index of refraction minus 1, for the modes `Exact` and `Dielectric`.
    index2_less_1: [S; 3],
    /// `true` for channels with an infinite index of refraction (F0 = 1).
    total: [bool; 3],
}

impl<S: Float> Reflectance<S> {
    /// Creates a reflectance of 1 at every angle.
    pub fn white() -> Self {
        Self::new(&Material::default())
    }

    /// Compiles the Fresnel mode and the reflectance F0 of a material.
    pub fn new(material: &Material) -> Self {
        let f0 = material.f0().0;
        let mode = material.fresnel_mode();
        let index2 = match mode {
            Fresnel::Dielectric => [material.ior.powi(2) - 1.0; 3],
            Fresnel::Constant | Fresnel::Schlick | Fresnel::Exact => {
                f0.map(|f| index_from_f0(f).powi(2) - 1.0)
            }
        };
        let total = f0.map(|f| f >= 1.0 - f64::powi(2.0, -24));
        Self {
            mode,
            f0: f0.map(S::from_f64),
            index2_less_1: std::array::from_fn(|i| {
                S::from_f64(if total[i] { 0.0 } else { index2[i] })
            }),
            total,
        }
    }

    /// Returns `value` times the reflectance at the angle whose cosine `c` returns. `c` is not called
    /// if the reflectance is the same at every angle.
    #[inline(always)]
    pub fn times<L: SimdFloat<Scalar = S>>(&self, c: impl FnOnce() -> L, value: L) -> Vec3<L> {
        match self.mode {
            Fresnel::Constant => Vec3::splat(self.f0) * value,
            Fresnel::Schlick | Fresnel::Exact | Fresnel::Dielectric => self.at(c()) * value,
        }
    }

    /// Returns the reflectance at `c`, the cosine (0..1) between the directions of the light and
    /// the microfacet normal.
    #[inline(always)]
    pub fn at<L: SimdFloat<Scalar = S>>(&self, c: L) -> Vec3<L> {
        let f0 = Vec3::splat(self.f0);
        match self.mode {
            Fresnel::Constant => f0,
            Fresnel::Schlick => {
                let k = L::one() - c;
                let k2 = k * k;
                let one_minus_f0 = Vec3::new(L::one() - f0.x, L::one() - f0.y, L::one() - f0.z);
                one_minus_f0.mul_add(k2 * k2 * k, f0)
            }
            Fresnel::Exact => Vec3::new(self.exact(c, 0), self.exact(c, 1), self.exact(c, 2)),
            Fresnel::Dielectric => {
                let f = self.exact(c, 0);
                Vec3::new(f, f, f)
            }
        }
    }

    /// Returns the reflectance of a colour channel with the index n at the cosine `c`: 1/2 A^2 (1 +
    /// B^2), where g^2 = n^2 + c^2 - 1, A = (g - c) / (g + c), B = (c (g + c) - 1) / (c (g - c) +
    /// 1). This is Cook and Torrance's form of Fresnel's equations.
    #[inline(always)]
    fn exact<L: SimdFloat<Scalar = S>>(&self, c: L, channel: usize) -> L {
        if self.total[channel] {
            return L::one();
        }
        let g = c.mul_add(c, L::splat(self.index2_less_1[channel])).max(L::zero()).sqrt();
        let (plus, minus) = (g + c, g - c);
        // At n = 1 and grazing incidence, g = c = 0: there is no boundary.
        let ratio = minus / plus.max(L::from_f64(1e-30));
        let other = (c * plus - L::one()) / (c * minus + L::one());
        L::from_f64(0.5) * ratio * ratio * (L::one() + other * other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::Color;
    use zerkalo_kernel::lanes::SimdFloat;

    fn exact(f0: f64) -> Reflectance<f64> {
        Reflectance::new(&Material {
            f0: Some(Color([f0; 3])),
            fresnel: Some(Fresnel::Exact),
            ..Material::default()
        })
    }

    /// Checks the Fresnel reflectance F for every reflectance F0 at normal incidence and every
    /// cosine: F is in [0, 1] and never NaN, and F is F0 for the cosine 1.
    #[test]
    fn extreme_24_fresnel() {
        let mut worst = 0f64;
        for f0 in [0.0, 1e-9, 0.04, 0.349, 0.989, 1.0 - 2f64.powi(-24), 1.0] {
            for mode in [Fresnel::Constant, Fresnel::Schlick, Fresnel::Exact] {
                let material = Material {
                    f0: Some(Color([f0; 3])),
                    fresnel: Some(mode),
                    ..Material::default()
                };
                let (double, single) =
                    (Reflectance::<f64>::new(&material), Reflectance::<f32>::new(&material));
                for i in 0..=1000 {
                    let c = f64::from(i) / 1000.0;
                    let f = double.at(c).x;
                    assert!((0.0..=1.0 + 1e-12).contains(&f), "{mode:?} F0 {f0} c {c}: {f}");
                    let f = single.at(c as f32).x;
                    assert!((0.0..=1.0 + 1e-6).contains(&f), "{mode:?} F0 {f0} c {c}: {f}");
                }
                assert!((double.at(1.0).x - f0).abs() <= 1e-7, "{mode:?} {f0}");
                worst = worst.max((double.at(1.0).x - f0).abs());
            }
        }
        println!("extreme 24 | double | F(1) {worst:.0e} off at most, all in [0, 1]");
        println!("extreme 24 | single | all in [0, 1 + 1e-6]");
    }

    /// Checks the Fresnel reflectance of glass (n = 1.5): 1 at grazing incidence and 4 % at normal
    /// incidence.
    #[test]
    fn fresnel_has_textbook_values() {
        assert!((index_from_f0(0.04) - 1.5).abs() < 1e-12);
        assert!((exact(0.04).at(0.0).x - 1.0).abs() < 1e-12);
        // Reflectances at 60 degrees for n = 1.5: s 0.1770, p 0.0014, mean 0.0892.
        let sin_t = 3f64.sqrt() / 2.0 / 1.5;
        let (ci, ct) = (0.5, (1.0 - sin_t * sin_t).sqrt());
        let s = ((ci - 1.5 * ct) / (ci + 1.5 * ct)).powi(2);
        let p = ((1.5 * ci - ct) / (1.5 * ci + ct)).powi(2);
        assert!((exact(0.04).at(0.5).x - 0.5 * (s + p)).abs() < 1e-12);
        let lanes: zerkalo_kernel::lanes::Double = exact(0.04).at(SimdFloat::from_f64(0.5)).x;
        assert_eq!(lanes.lane(2), exact(0.04).at(0.5).x);
    }
}
