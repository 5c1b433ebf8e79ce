//! Materials: descriptions of surfaces in scene files, and the compiled BSDFs.

#![cfg_attr(not(test), deny(clippy::wildcard_enum_match_arm))]

mod bsdf;
mod fresnel;
mod mapping;
mod microfacet;
mod preset;
mod refraction;
mod rough_interface;
mod texture;
mod texture_eval;
mod visible_normals;

pub use bsdf::{
    Bsdf, BsdfQuery, BsdfSample, BsdfValue, ReflectionLobe, SpecularModel, Transmission,
};
pub use fresnel::{Reflectance, f0_from_index, index_from_f0};
pub use mapping::TextureMapping;
pub use microfacet::{FacetNormals, MicrofacetDistribution, SMOOTH_ALPHA};
pub use preset::Preset;
pub use refraction::{FresnelSplit, Interface};
pub use rough_interface::{InterfaceMedia, InterfaceQuery, InterfaceSample};
pub use texture::{
    Axis, Bump, Checker, HeightImage, ImageTexture, Mapping, Placement, Texture, TextureFilter,
    Wrap,
};
pub use texture_eval::{BumpMap, CompiledTexture};

use crate::value::{Color, Description, Field, KeyNode, ValidationError, choices, description};

description! {
    /// A surface's material. Every key may be left out.
    pub struct Material {
        /// Material by name, whose values the other keys override.
        preset: Option<Preset>, or "no preset";
        /// Body colour: multiplies the ambient and the diffuse part.
        color: Color = [0.8, 0.8, 0.8], in COEFFICIENT;
        /// Ambient coefficient k_a.
        ambient: f64 = 1.0, in COEFFICIENT;
        /// Diffuse coefficient k_d.
        diffuse: f64 = 1.0, in COEFFICIENT;
        /// Highlight coefficient k_s.
        specular: f64 = 0.0, in COEFFICIENT;
        /// Phong exponent alpha of (R.V)^alpha: the larger, the smaller the highlight.
        exponent: f64 = 32.0, in closed(0.0, 1e9);
        /// Formula of the highlights that lights make on the surface.
        highlight: Highlight = "phong";
        /// Weight k_r of the traced reflection. It does not reduce the other coefficients: their sum
        /// may exceed 1.
        reflection: f64 = 0.0, in COEFFICIENT;
        /// Weight k_t of the transmitted light; 0 is opaque. It does not reduce the other
        /// coefficients: their sum may exceed 1.
        transmission: f64 = 0.0, in COEFFICIENT;
        /// Index of refraction n inside of the solid; outside of all solids it is 1.
        ior: f64 = 1.5, in closed(0.1, 1e4);
        /// Transmittance of each channel over the distance `attenuation_distance` inside of a solid
        /// with `transmission`, by Beer's law; white absorbs nothing.
        attenuation_color: Color = [1.0, 1.0, 1.0], in SHARE;
        /// Distance inside of a solid over which the transmittance is `attenuation_color`.
        attenuation_distance: f64 = 1.0, in SIZE;
        /// Tangent of the half-angle of the cone of reflected and of transmitted rays, not a
        /// microfacet alpha; 0 is a perfect mirror and clear glass.
        // The blur of roughness 0.001 is just visible at the far end of a room.
        roughness: f64 = 0.0, in closed(0.0, 1e6), step Rungs(0.01);
        /// Distribution of reflected and transmitted rays. The same roughness gives a comparable
        /// blur with each.
        lobe: Lobe = "cone";
        /// Roughness parameter alpha of the microfacet distribution.
        alpha: Option<f64>, or "roughness / (2 √2)", in closed(0.0, 1e6), step Rungs(0.005);
        /// Model of masking and shadowing between microfacets.
        masking: Masking = "v-cavity";
        /// Dependence of the reflectance on the angle.
        fresnel: Option<Fresnel>, or "`exact` for a metal, that of `preset`, or `constant`";
        /// Reflectance F0 at normal incidence. Not together with `metal`.
        f0: Option<Color>, or "that of `preset`, or white", in SHARE;
        /// Metal whose reflectance the surface has. Not together with `f0`.
        metal: Option<Metal>, or "no metal";
        /// Radiance that the surface emits, the same at every point and in every direction; 0 emits
        /// nothing. It is added to the light that the surface reflects, and illuminates other
        /// objects.
        emission: f64 = 0.0, in LIGHT "W/(sr m²)";
        /// Colour of the emitted light; multiplies `emission`.
        emission_color: Color = [1.0, 1.0, 1.0], in LIGHT;
        /// Light group in which the emission is mixed with other lights.
        group: String, or "a group of its own";
        /// `true`: the back of a surface has the same material as its front. `false`: the back is
        /// black. Only its `transmission` remains, and total internal reflection unless `fresnel`
        /// is `dielectric`.
        two_sided: bool = true;
        /// Texture that multiplies `color`.
        texture: Option<Texture>, or "a uniform colour";
        /// Heights that perturb the shading normals; the outline of the surface does not change.
        bump: Option<Bump>, or "no bumps";
        based on preset_material;
    }
}

/// Keys of a `[materials.NAME]` table in scene files.
pub const FIELDS: &[Field] = Material::FIELDS;

choices! {
    /// Formula of a light's highlight.
    pub enum Highlight {
        /// Phong's formula k_s (R.V)^alpha
        Phong = "phong",
        /// highlight of microfacets with the distribution of `lobe`
        CookTorrance = "cook-torrance",
    }
}

choices! {
    /// Distribution of reflected rays.
    pub enum Lobe {
        /// mirror direction only, whatever the roughness
        Mirror = "mirror",
        /// uniform directions in a cone
        Cone = "cone",
        /// uniform points of a square perpendicular to the mirror direction; takes less time than
        /// `cone`
        Square = "square",
        /// microfacets with the Beckmann distribution
        Beckmann = "beckmann",
        /// microfacets with the GGX (Trowbridge-Reitz) distribution
        Ggx = "ggx",
    }
}

choices! {
    /// Masking and shadowing between microfacets.
    pub enum Masking {
        /// masking by V-shaped grooves (Torrance-Sparrow)
        VCavity = "v-cavity",
        /// Smith's masking, height-correlated
        Smith = "smith",
    }
}

choices! {
    /// Dependence of the reflectance on the angle of incidence.
    pub enum Fresnel {
        /// the same reflectance at every angle
        Constant = "constant",
        /// Schlick's approximation
        Schlick = "schlick",
        /// Fresnel's equations for the index of refraction that gives the reflectance F0
        Exact = "exact",
        /// Fresnel's equations for `ior`: `reflection` weighs the share F that is reflected,
        /// `transmission` the share 1 - F that is not
        Dielectric = "dielectric",
    }
}

choices! {
    /// Metals by reflectance at normal incidence.
    pub enum Metal {
        /// reflectance F0 = 0.989 0.876 0.349
        Gold = "gold",
        /// reflectance F0 = 0.950 0.930 0.880
        Silver = "silver",
        /// reflectance F0 = 0.755 0.490 0.095
        Copper = "copper",
        /// reflectance F0 = 0.530 0.505 0.480
        Iron = "iron",
    }
}

/// Remedy for a metal without effect.
pub(crate) const METAL_REMEDY: &str =
    "Only a reflection shows a metal: give it reflection = 1.0 and diffuse = 0.0, or a preset.";

impl Metal {
    /// Returns the reflectance F0 at normal incidence.
    pub fn f0(self) -> Color {
        Color(match self {
            Self::Gold => [0.989, 0.876, 0.349],
            Self::Silver => [0.950, 0.930, 0.880],
            Self::Copper => [0.755, 0.490, 0.095],
            Self::Iron => [0.530, 0.505, 0.480],
        })
    }
}

impl Material {
    /// Returns the material without overrides if there is a preset.
    fn preset_material(&self) -> Option<Self> {
        self.preset.map(Preset::material)
    }

    /// Returns the reflectance at normal incidence: that of `metal`, or `f0`, or that of a
    /// dielectric with the index `ior`, or that of `preset`; white if none of these is given.
    pub fn f0(&self) -> Color {
        let default = match self.fresnel_mode() {
            Fresnel::Dielectric => Color([f0_from_index(self.ior); 3]),
            Fresnel::Constant | Fresnel::Schlick | Fresnel::Exact => {
                self.preset.and_then(Preset::f0).unwrap_or(Color::WHITE)
            }
        };
        self.metal.map(Metal::f0).or(self.f0).unwrap_or(default)
    }

    /// Returns the value of the key `fresnel`, or its default.
    pub fn fresnel_mode(&self) -> Fresnel {
        let of_metal = self.metal.map(|_| Fresnel::Exact);
        let given = self.fresnel.or(of_metal).or_else(|| self.preset?.fresnel());
        given.unwrap_or(Fresnel::Constant)
    }

    /// Returns the alpha of the microfacet distribution. By default, the distribution has the same
    /// second moment as the reflection cone of `roughness`.
    pub fn microfacet_alpha(&self) -> f64 {
        self.alpha.unwrap_or(self.roughness / 8f64.sqrt())
    }

    /// Returns the absorption coefficients of Beer's law [1 / scene unit], at most 1e30. Channels of
    /// `attenuation_color` below 1e-38 count as 1e-38, so that their logarithms are finite.
    pub fn absorption(&self) -> [f64; 3] {
        let coefficient = |c: f64| -c.max(1e-38).ln() / self.attenuation_distance;
        self.attenuation_color.0.map(|c| coefficient(c).clamp(0.0, 1e30))
    }

    /// Returns the radiance that the surface emits.
    pub fn emitted(&self) -> [f64; 3] {
        self.emission_color.scaled(self.emission).0
    }

    /// Returns `true` if the surface emits light.
    pub fn emits(&self) -> bool {
        self.emitted() != [0.0; 3]
    }

    /// Returns `true` if the reflectance F0 has an effect.
    pub fn shows_f0(&self) -> bool {
        self.reflection > 0.0 || self.highlight == Highlight::CookTorrance && self.specular > 0.0
    }

    /// Returns `true` if the reflection or the highlight uses a microfacet distribution.
    pub fn has_microfacets(&self) -> bool {
        matches!(self.lobe, Lobe::Beckmann | Lobe::Ggx)
            || self.highlight == Highlight::CookTorrance && self.specular > 0.0
    }

    /// Returns the validation errors of the material's keys and values.
    pub fn faults(&self) -> Vec<ValidationError> {
        let both = self.f0.is_some() && self.metal.is_some();
        let given = self.metal.map(|_| "metal").or(self.f0.map(|_| "f0"));
        let redundant = given.filter(|_| self.fresnel_mode() == Fresnel::Dielectric);
        self.validator()
            .and(both.then(|| {
                ValidationError::new(
                    "metal",
                    "both metal and f0 are given",
                    "only one of them: a metal stands for its f0",
                )
            }))
            .and(redundant.map(|other| {
                ValidationError::new(
                    "fresnel",
                    format!("`dielectric` together with {other}"),
                    format!(
                        "no {other}: `ior` gives a dielectric's reflectance at normal incidence"
                    ),
                )
            }))
            .errors()
    }
}

#[cfg(test)]
mod tests {
    use super::{FIELDS, Fresnel, Material, Metal};
    use crate::TomlText;
    use crate::value::Color;

    #[test]
    fn documented_f0_of_metals_are_used() {
        for metal in Metal::CHOICES {
            let text = format!("metal = \"{}\"", metal.name);
            let metal_read: Metal = Material::from_text(&text).unwrap().metal.unwrap();
            let numbers = metal.doc.split(' ').filter_map(|word| word.parse().ok());
            let documented: Vec<f64> = numbers.collect();
            assert_eq!(metal_read.f0().0.to_vec(), documented, "{}", metal.name);
        }
    }

    #[test]
    fn material_ranges_are_checked() {
        let mut bad = Material {
            color: Color([-1.0, 0.0, 0.0]),
            ambient: f64::NAN,
            diffuse: -1.0,
            specular: f64::INFINITY,
            exponent: -1.0,
            reflection: -0.1,
            transmission: -0.1,
            ior: 0.0,
            attenuation_color: Color([0.5, 1.1, 0.5]),
            attenuation_distance: 0.0,
            roughness: -1e-9,
            alpha: Some(-1.0),
            f0: Some(Color([1.1, 0.0, 0.0])),
            emission: -1.0,
            emission_color: Color([0.0, -0.1, 0.0]),
            ..Material::default()
        };
        let keys: Vec<_> = bad.faults().into_iter().map(|f| f.key).collect();
        let numbers = [
            "color",
            "ambient",
            "diffuse",
            "specular",
            "exponent",
            "reflection",
            "transmission",
            "ior",
            "attenuation_color",
            "attenuation_distance",
            "roughness",
            "alpha",
            "f0",
            "emission",
            "emission_color",
        ];
        assert_eq!(keys, numbers);
        assert_eq!(FIELDS.len(), numbers.len() + 10, "check the range of the new field here");
        bad = Material { metal: Some(Metal::Gold), ..Material::default() };
        assert!(bad.faults().is_empty());
        bad.f0 = Some(Color::WHITE);
        assert_eq!(bad.faults()[0].key, "metal");
        let dielectric = Material { fresnel: Some(Fresnel::Dielectric), ..Material::default() };
        assert!(dielectric.faults().is_empty());
        bad = Material { metal: Some(Metal::Gold), ..dielectric.clone() };
        assert_eq!(bad.faults()[0].key, "fresnel");
        bad = Material { f0: Some(Color::WHITE), ..dielectric };
        assert_eq!(bad.faults()[0].key, "fresnel");
    }
}
