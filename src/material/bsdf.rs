//! Compiled BSDF: the numbers that the kernel needs.

use crate::lanes::Float;
use crate::material::fresnel::Reflectance;
use crate::material::{Fresnel, Highlight, Lobe, Masking, Material};

/// Smallest microfacet alpha. Below it the reflection lobe is a mirror, and the highlights of lights use
/// this value.
pub const SMOOTH_ALPHA: f64 = 1e-3;

/// Largest Phong exponent for which a single-precision cosine is accurate enough: the relative error of
/// the power is the exponent times about 1.5e-7.
pub const SHARP_EXPONENT: f64 = 1024.0;

/// A distribution of microfacets.
#[derive(Clone, Copy, Debug)]
pub struct MicrofacetDistribution<S> {
    /// `true` for GGX, `false` for Beckmann.
    pub ggx: bool,
    /// Roughness parameter alpha, at least [`SMOOTH_ALPHA`].
    pub alpha: S,
    /// Square of `alpha`.
    pub alpha2: S,
    /// Inverse square of `alpha`.
    pub inverse_alpha2: S,
    /// Masking and shadowing between microfacets.
    pub masking: Masking,
}

impl<S: Float> MicrofacetDistribution<S> {
    /// Creates a distribution with the parameter `alpha`.
    pub fn new(ggx: bool, alpha: f64, masking: Masking) -> Self {
        let alpha2 = alpha * alpha;
        let [alpha, alpha2, inverse_alpha2] = [alpha, alpha2, 1.0 / alpha2].map(S::from_f64);
        Self { ggx, alpha, alpha2, inverse_alpha2, masking }
    }
}

/// Formula of a light's highlight.
#[derive(Clone, Copy, Debug)]
pub enum SpecularModel<S> {
    /// No highlight.
    None,
    /// k_s (R.V)^alpha.
    Phong {
        /// k_s.
        strength: S,
        /// alpha.
        exponent: S,
        /// alpha exceeds `SHARP_EXPONENT`.
        sharp: bool,
    },
    /// k_s D G F / (4 N.L N.V).
    MicrofacetDistribution {
        /// k_s.
        strength: S,
        /// D and G.
        facets: MicrofacetDistribution<S>,
    },
}

/// Distribution of reflected rays.
#[derive(Clone, Copy, Debug)]
pub enum ReflectionLobe<S> {
    /// All in the mirror direction.
    Mirror,
    /// Uniform in a cone.
    Cone {
        /// 1 - cos of the half-angle.
        one_minus_cos: S,
    },
    /// Uniform on a square at unit distance.
    Square {
        /// Side of the square.
        side: S,
    },
    /// Reflection by microfacets.
    MicrofacetDistribution(MicrofacetDistribution<S>),
}

/// Transmission through a surface.
#[derive(Clone, Copy, Debug)]
pub struct Transmission<S> {
    /// k_t.
    pub strength: S,
    /// Index of refraction of the inside.
    pub index: S,
    /// `true` if Fresnel's equations split the light between reflection and transmission; otherwise k_r
    /// and k_t are used unchanged.
    pub dielectric: bool,
}

/// A compiled material.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf<S> {
    /// k_a x colour.
    pub ambient: [S; 3],
    /// k_d x colour.
    pub diffuse: [S; 3],
    /// Highlights of lights.
    pub specular: SpecularModel<S>,
    /// k_r and the reflection lobe; `None` if nothing is reflected.
    pub reflection: Option<(S, ReflectionLobe<S>)>,
    /// k_t and the index of refraction; `None` if the material is opaque.
    pub transmission: Option<Transmission<S>>,
    /// Fresnel reflectance of the highlight.
    pub highlight_fresnel: Reflectance<S>,
    /// Fresnel reflectance of the reflection, except the part that depends on the medium on the other
    /// side.
    pub reflection_fresnel: Reflectance<S>,
    /// `true` if lights contribute to its colour.
    pub has_direct: bool,
    /// `true` if its back is like its front.
    pub two_sided: bool,
}

/// Returns 1 - cos(atan(r)) without cancellation: r^2 / (1 + r^2 + sqrt(1 + r^2)).
pub fn one_minus_cos_of_tan(r: f64) -> f64 {
    let square = r * r;
    if square.is_infinite() { 1.0 } else { square / (1.0 + square + (1.0 + square).sqrt()) }
}

impl<S: Float> Bsdf<S> {
    /// Compiles `material`. `reflects` is `true` if the scene traces reflected and transmitted rays.
    pub fn new(material: &Material, reflects: bool) -> Self {
        let alpha = material.microfacet_alpha().max(SMOOTH_ALPHA);
        let facets = |ggx| MicrofacetDistribution::new(ggx, alpha, material.masking);
        let strength = S::from_f64(material.specular);
        let specular = match material.highlight {
            _ if material.specular == 0.0 => SpecularModel::None,
            Highlight::Phong => SpecularModel::Phong {
                strength,
                exponent: S::from_f64(material.exponent),
                sharp: material.exponent > SHARP_EXPONENT,
            },
            Highlight::CookTorrance => SpecularModel::MicrofacetDistribution {
                strength,
                facets: facets(material.lobe == Lobe::Ggx),
            },
        };
        let r = material.roughness;
        let lobe = match material.lobe {
            Lobe::Mirror => ReflectionLobe::Mirror,
            Lobe::Cone | Lobe::Square if r == 0.0 => ReflectionLobe::Mirror,
            Lobe::Cone => {
                ReflectionLobe::Cone { one_minus_cos: S::from_f64(one_minus_cos_of_tan(r)) }
            }
            Lobe::Square => {
                ReflectionLobe::Square { side: S::from_f64(std::f64::consts::PI.sqrt() * r) }
            }
            Lobe::Beckmann | Lobe::Ggx if material.microfacet_alpha() < SMOOTH_ALPHA => {
                ReflectionLobe::Mirror
            }
            Lobe::Beckmann => ReflectionLobe::MicrofacetDistribution(facets(false)),
            Lobe::Ggx => ReflectionLobe::MicrofacetDistribution(facets(true)),
        };
        let (k_r, k_t) = (material.reflection, material.transmission);
        let dielectric = material.fresnel_mode() == Fresnel::Dielectric;
        let transmission = (reflects && k_t > 0.0).then(|| Transmission {
            strength: S::from_f64(k_t),
            index: S::from_f64(material.ior),
            dielectric,
        });
        let reflectance = Reflectance::new(material);
        let shared = dielectric && transmission.is_some();
        let black = material.diffuse == 0.0 || material.color.0 == [0.0; 3];
        Self {
            ambient: material.color.0.map(|c| S::from_f64(c * material.ambient)),
            diffuse: material.color.0.map(|c| S::from_f64(c * material.diffuse)),
            specular,
            reflection: (reflects && k_r > 0.0).then(|| (S::from_f64(k_r), lobe)),
            transmission,
            highlight_fresnel: reflectance,
            reflection_fresnel: if shared { Reflectance::white() } else { reflectance },
            has_direct: !black || material.specular != 0.0,
            two_sided: material.two_sided,
        }
    }
}
