//! Materials: how a surface answers light.

mod bsdf;
mod bsdf_eval;
mod fields;
mod fresnel;
mod mapping;
mod properties;
mod refraction;
mod texture;
mod texture_eval;
mod texture_fields;

pub use bsdf::{
    Bsdf, MicrofacetDistribution, ReflectionLobe, SMOOTH_ALPHA, SpecularModel, Transmission,
    one_minus_cos_of_tan,
};
pub use bsdf_eval::BsdfSample;
pub use fields::FIELDS;
pub use fresnel::{Reflectance, f0_from_index, index_from_f0};
pub use mapping::{Projection, TexCoord, TextureMapping};
pub use properties::{BsdfProperties, Energy};
pub use refraction::{FresnelSplit, Interface};
pub use texture::{
    Axis, Bump, Checker, HeightImage, ImageTexture, Mapping, Placement, Texture, TextureFilter,
    Wrap,
};
pub use texture_eval::{BumpMap, CompiledTexture};

use crate::value::{Color, ValidationError, Validator};
use serde::{Deserialize, Serialize};

/// A surface's finish. Every key may be left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Material {
    /// Body colour: multiplies the ambient and the diffuse part.
    pub color: Color,
    /// Ambient coefficient k_a.
    pub ambient: f64,
    /// Diffuse coefficient k_d.
    pub diffuse: f64,
    /// Highlight coefficient k_s.
    pub specular: f64,
    /// Phong exponent alpha of (R.V)^alpha.
    pub exponent: f64,
    /// Which formula gives the highlight of a light.
    pub highlight: Highlight,
    /// Weight k_r of the traced reflection; not energy-conserving with the other coefficients.
    pub reflection: f64,
    /// Weight k_t of the transmitted light; not energy-conserving with the other coefficients.
    pub transmission: f64,
    /// Index of refraction n of what the surface encloses; 1 outside of everything.
    pub ior: f64,
    /// Tangent of the half-angle of the reflection cone, not a microfacet alpha; 0 is a perfect
    /// mirror.
    pub roughness: f64,
    /// How the reflected ray is spread.
    pub lobe: Lobe,
    /// Microfacet slope; without it roughness / (2 sqrt 2).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha: Option<f64>,
    /// Masking and shadowing of microfacets.
    pub masking: Masking,
    /// How reflectance depends on the angle; without it `exact` for a metal, else `constant`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fresnel: Option<Fresnel>,
    /// Reflectance F0 at normal incidence, per channel; without it white.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f0: Option<Color>,
    /// A metal's F0 instead of `f0`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub metal: Option<Metal>,
    /// Whether the back of a surface is finished like its front; otherwise the back is black.
    pub two_sided: bool,
    /// What multiplies the body colour.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub texture: Option<Texture>,
    /// What turns the normals that light is computed with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bump: Option<Bump>,
}

/// The formula of a light's highlight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Highlight {
    /// k_s (R.V)^alpha.
    Phong,
    /// k_s D G F / (4 N.L N.V): microfacets with the lobe's distribution (Beckmann unless the lobe
    /// is ggx).
    CookTorrance,
}

/// The spread of the reflected ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lobe {
    /// No spread, whatever the roughness.
    Mirror,
    /// Uniform in a cone.
    Cone,
    /// Uniform on a square perpendicular to the mirror direction: the cheap stand-in for the cone.
    Square,
    /// Microfacets, Beckmann distribution.
    Beckmann,
    /// Microfacets, GGX (Trowbridge-Reitz) distribution.
    Ggx,
}

/// Masking and shadowing between microfacets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Masking {
    /// Torrance-Sparrow's V-shaped grooves.
    VCavity,
    /// Smith, height-correlated.
    Smith,
}

/// Reflectance against angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fresnel {
    /// F0 at every angle.
    Constant,
    /// Schlick's approximation.
    Schlick,
    /// The Fresnel equations for the index of refraction that F0 stands for.
    Exact,
    /// The Fresnel equations for the indices of refraction on both sides, F reflected and 1 - F
    /// transmitted.
    Dielectric,
}

/// Metals by reflectance at normal incidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Metal {
    /// 0.989 0.876 0.349
    Gold,
    /// 0.950 0.930 0.880
    Silver,
    /// 0.755 0.490 0.095
    Copper,
    /// 0.530 0.505 0.480
    Iron,
}

impl Metal {
    /// Reflectance F0 at normal incidence.
    pub fn f0(self) -> Color {
        Color(match self {
            Self::Gold => [0.989, 0.876, 0.349],
            Self::Silver => [0.950, 0.930, 0.880],
            Self::Copper => [0.755, 0.490, 0.095],
            Self::Iron => [0.530, 0.505, 0.480],
        })
    }
}

impl Default for Material {
    fn default() -> Self {
        Self {
            color: Color([0.8; 3]),
            ambient: 1.0,
            diffuse: 1.0,
            specular: 0.0,
            exponent: 32.0,
            highlight: Highlight::Phong,
            reflection: 0.0,
            transmission: 0.0,
            ior: 1.5,
            roughness: 0.0,
            lobe: Lobe::Cone,
            alpha: None,
            masking: Masking::VCavity,
            fresnel: None,
            f0: None,
            metal: None,
            two_sided: true,
            texture: None,
            bump: None,
        }
    }
}

impl Material {
    /// Reflectance at normal incidence: the metal's, the given one, that of a dielectric, or white.
    pub fn f0(&self) -> Color {
        let own = match self.fresnel_mode() {
            Fresnel::Dielectric => Color([f0_from_index(self.ior); 3]),
            _ => Color::WHITE,
        };
        self.metal.map(Metal::f0).or(self.f0).unwrap_or(own)
    }

    /// How reflectance depends on the angle.
    pub fn fresnel_mode(&self) -> Fresnel {
        let usual = if self.metal.is_some() { Fresnel::Exact } else { Fresnel::Constant };
        self.fresnel.unwrap_or(usual)
    }

    /// Slope alpha of the microfacets: the given one, or that with the second moment of the cone.
    pub fn microfacet_alpha(&self) -> f64 {
        self.alpha.unwrap_or(self.roughness / 8f64.sqrt())
    }

    /// Whether a microfacet distribution is asked for, by the reflection or by the highlight.
    pub fn has_microfacets(&self) -> bool {
        matches!(self.lobe, Lobe::Beckmann | Lobe::Ggx)
            || self.highlight == Highlight::CookTorrance && self.specular > 0.0
    }

    /// What is wrong with it.
    pub fn faults(&self) -> Vec<ValidationError> {
        let both = self.f0.is_some() && self.metal.is_some();
        let dielectric = self.fresnel == Some(Fresnel::Dielectric);
        let other = if self.metal.is_some() { "metal" } else { "f0" };
        let twice = dielectric && (self.metal.is_some() || self.f0.is_some());
        Validator::new(FIELDS)
            .numbers("color", &self.color.0)
            .numbers("ambient", &[self.ambient])
            .numbers("diffuse", &[self.diffuse])
            .numbers("specular", &[self.specular])
            .numbers("exponent", &[self.exponent])
            .numbers("reflection", &[self.reflection])
            .numbers("transmission", &[self.transmission])
            .numbers("ior", &[self.ior])
            .numbers("roughness", &[self.roughness])
            .optional("alpha", self.alpha.as_ref().map(std::slice::from_ref))
            .optional("f0", self.f0.as_ref().map(|c| &c.0[..]))
            .and(both.then(|| {
                ValidationError::new(
                    "metal",
                    "both metal and f0 are given",
                    "only one of them: a metal stands for its f0",
                )
            }))
            .and(twice.then(|| {
                ValidationError::new(
                    "fresnel",
                    format!("`dielectric` together with {other}"),
                    format!(
                        "no {other}: `ior` gives a dielectric's reflectance at normal incidence"
                    ),
                )
            }))
            .nested("texture", self.texture.as_ref().map(Texture::faults).unwrap_or_default())
            .nested("bump", self.bump.as_ref().map(Bump::faults).unwrap_or_default())
            .validate()
    }
}
