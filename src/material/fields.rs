//! What may be written in a material.

use crate::material::texture_fields::{BUMP_KINDS, TEXTURE_KINDS};
use crate::value::{Choice, Field, NumberRange, ValueType};

/// The keys of `[materials.NAME]`.
pub const FIELDS: &[Field] = &[
    Field::preset(
        "color",
        ValueType::Color(NumberRange::COEFFICIENT),
        "",
        "[0.8, 0.8, 0.8]",
        "Body colour: multiplies the ambient and the diffuse part.",
    ),
    Field::preset("ambient", COEFFICIENT, "", "1.0", "Ambient coefficient k_a."),
    Field::preset("diffuse", COEFFICIENT, "", "1.0", "Diffuse coefficient k_d."),
    Field::preset("specular", COEFFICIENT, "", "0.0", "Highlight coefficient k_s."),
    Field::preset(
        "exponent",
        ValueType::Number(NumberRange::closed(0.0, 1e9)),
        "",
        "32.0",
        "Phong exponent alpha of (R.V)^alpha: the larger, the smaller the highlight.",
    ),
    Field::preset(
        "highlight",
        ValueType::Choice(HIGHLIGHTS),
        "",
        "\"phong\"",
        "Formula of a light's highlight.",
    ),
    Field::preset(
        "reflection",
        COEFFICIENT,
        "",
        "0.0",
        "Weight k_r of the traced reflection; not energy-conserving with the other coefficients.",
    ),
    Field::preset(
        "transmission",
        COEFFICIENT,
        "",
        "0.0",
        "Weight k_t of the transmitted light, not energy-conserving with the other coefficients; 0 is opaque.",
    ),
    Field::preset(
        "ior",
        ValueType::Number(NumberRange::closed(0.1, 1e4)),
        "",
        "1.5",
        "Index of refraction n of the inside; outside of everything it is 1.",
    ),
    Field::preset(
        "roughness",
        ValueType::Number(NumberRange::closed(0.0, 1e6)),
        "",
        "0.0",
        "Tangent of the half-angle of the reflection cone, not a microfacet alpha; 0 is a perfect mirror.",
    ),
    Field::preset(
        "lobe",
        ValueType::Choice(LOBES),
        "",
        "\"cone\"",
        "How the reflected ray is spread; the same roughness means a comparable blur in each.",
    ),
    Field::optional(
        "alpha",
        ValueType::Number(NumberRange::closed(0.0, 1e6)),
        "",
        "roughness / (2 √2)",
        "Slope parameter of the microfacets.",
    ),
    Field::preset(
        "masking",
        ValueType::Choice(MASKINGS),
        "",
        "\"v-cavity\"",
        "Masking and shadowing between microfacets.",
    ),
    Field::optional(
        "fresnel",
        ValueType::Choice(FRESNELS),
        "",
        "`exact` for a metal, otherwise `constant`",
        "How the reflectance depends on the angle.",
    ),
    Field::optional(
        "f0",
        ValueType::Color(NumberRange::SHARE),
        "",
        "white",
        "Reflectance F0 at normal incidence. Not together with `metal`.",
    ),
    Field::optional(
        "metal",
        ValueType::Choice(METALS),
        "",
        "no metal",
        "A metal, for its reflectance. Not together with `f0`.",
    ),
    Field::preset(
        "two_sided",
        ValueType::Switch,
        "",
        "true",
        "Whether the back of a surface is finished like its front; otherwise the back is black: of its \
         finish only `transmission` is left there, and total reflection past the critical angle \
         unless `fresnel` is `dielectric`.",
    ),
    Field::optional(
        "texture",
        ValueType::OneOf(TEXTURE_KINDS),
        "",
        "one colour all over",
        "What multiplies `color`, from place to place.",
    ),
    Field::optional(
        "bump",
        ValueType::OneOf(BUMP_KINDS),
        "",
        "as smooth as the shape",
        "Heights that light sees on the surface; its outline stays as it is.",
    ),
];

const COEFFICIENT: ValueType = ValueType::Number(NumberRange::COEFFICIENT);

const HIGHLIGHTS: &[Choice] = &[
    Choice { name: "phong", doc: "k_s (R.V)^alpha" },
    Choice { name: "cook-torrance", doc: "microfacets with the distribution of the lobe" },
];

const LOBES: &[Choice] = &[
    Choice { name: "mirror", doc: "no spread, whatever the roughness" },
    Choice { name: "cone", doc: "uniform in a cone" },
    Choice { name: "square", doc: "uniform on a square across the mirror direction: cheaper" },
    Choice { name: "beckmann", doc: "microfacets, Beckmann distribution" },
    Choice { name: "ggx", doc: "microfacets, GGX (Trowbridge-Reitz) distribution" },
];

const MASKINGS: &[Choice] = &[
    Choice { name: "v-cavity", doc: "V-shaped grooves (Torrance-Sparrow)" },
    Choice { name: "smith", doc: "Smith, height-correlated" },
];

const FRESNELS: &[Choice] = &[
    Choice { name: "constant", doc: "the same at every angle" },
    Choice { name: "schlick", doc: "Schlick's approximation" },
    Choice {
        name: "exact",
        doc: "Fresnel's equations for the index of refraction that F0 stands for",
    },
    Choice {
        name: "dielectric",
        doc: "Fresnel's equations for `ior`: `reflection` weighs the share F that is reflected, \
              `transmission` the share 1 - F that is not",
    },
];

const METALS: &[Choice] = &[
    Choice { name: "gold", doc: "0.989 0.876 0.349" },
    Choice { name: "silver", doc: "0.950 0.930 0.880" },
    Choice { name: "copper", doc: "0.755 0.490 0.095" },
    Choice { name: "iron", doc: "0.530 0.505 0.480" },
];

#[cfg(test)]
mod tests {
    use super::{FIELDS, METALS};
    use crate::material::{Fresnel, Material, Metal};
    use crate::value::Color;

    #[test]
    fn documented_reflectances_are_the_ones_in_use() {
        for metal in METALS {
            let text = format!("metal = \"{}\"", metal.name);
            let metal_read: Metal = toml::from_str::<Material>(&text).unwrap().metal.unwrap();
            let told: Vec<f64> = metal.doc.split(' ').map(|n| n.parse().unwrap()).collect();
            assert_eq!(metal_read.f0().0.to_vec(), told, "{}", metal.name);
        }
    }

    #[test]
    fn every_number_is_checked() {
        let mut bad = Material {
            color: Color([-1.0, 0.0, 0.0]),
            ambient: f64::NAN,
            diffuse: -1.0,
            specular: f64::INFINITY,
            exponent: -1.0,
            reflection: -0.1,
            transmission: -0.1,
            ior: 0.0,
            roughness: -1e-9,
            alpha: Some(-1.0),
            f0: Some(Color([1.1, 0.0, 0.0])),
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
            "roughness",
            "alpha",
            "f0",
        ];
        assert_eq!(keys, numbers);
        assert_eq!(FIELDS.len(), numbers.len() + 8, "a new field? Check its range here");
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
