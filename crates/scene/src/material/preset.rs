//! Presets: materials by name, of which a scene file overrides single keys.
//!
//! Reflectances of metals: Akenine-Möller et al., *Real-Time Rendering*, 4th edition, table 9.2,
//! linear sRGB from measured indices of refraction. Indices of glass and water at 589 nm:
//! refractiveindex.info, BK7 and water at 20 °C.

use crate::material::{Fresnel, Highlight, Lobe, Material};
use crate::value::{Color, choices};

choices! {
    /// Materials by name.
    pub enum Preset {
        /// polished gold, reflectance F0 = 1.000 0.782 0.344
        Gold = "gold",
        /// polished silver, reflectance F0 = 0.972 0.960 0.915
        Silver = "silver",
        /// polished copper, reflectance F0 = 0.955 0.638 0.538
        Copper = "copper",
        /// ground iron, reflectance F0 = 0.562 0.565 0.578
        Iron = "iron",
        /// polished brass, reflectance F0 = 0.910 0.778 0.423
        Brass = "brass",
        /// polished chromium, reflectance F0 = 0.549 0.556 0.554
        Chrome = "chrome",
        /// clear glass of the index 1.517
        Glass = "glass",
        /// glass with a ground surface
        FrostedGlass = "frosted glass",
        /// clear water of the index 1.333
        Water = "water",
        /// coloured plastic under a clear, slightly rough surface
        Plastic = "plastic",
        /// dark rubber with a wide, weak highlight
        Rubber = "rubber",
        /// surface without gloss
        Diffuse = "diffuse",
        /// mirror that reflects 95 % of the light
        Mirror = "mirror",
        /// brushed aluminium, reflectance F0 = 0.913 0.922 0.924
        BrushedMetal = "brushed metal",
    }
}

impl Preset {
    /// Returns the reflectance at normal incidence; `None` if `ior` gives it or it is constant.
    pub(super) fn f0(self) -> Option<Color> {
        Some(Color(match self {
            Self::Gold => [1.000, 0.782, 0.344],
            Self::Silver => [0.972, 0.960, 0.915],
            Self::Copper => [0.955, 0.638, 0.538],
            Self::Iron => [0.562, 0.565, 0.578],
            Self::Brass => [0.910, 0.778, 0.423],
            Self::Chrome => [0.549, 0.556, 0.554],
            Self::BrushedMetal => [0.913, 0.922, 0.924],
            // That of the index 1.5, as of most plastics.
            Self::Plastic | Self::Rubber => [0.04; 3],
            Self::Glass | Self::FrostedGlass | Self::Water | Self::Diffuse | Self::Mirror => {
                return None;
            }
        }))
    }

    /// Returns the model of the reflectance; `None` for the default.
    pub(super) fn fresnel(self) -> Option<Fresnel> {
        let is_clear = matches!(self, Self::Glass | Self::FrostedGlass | Self::Water);
        if is_clear { Some(Fresnel::Dielectric) } else { self.f0().map(|_| Fresnel::Schlick) }
    }

    /// Returns the material without any override.
    pub fn material(self) -> Material {
        let plain = Material { preset: Some(self), ..Material::default() };
        let glossy = |roughness: f64| Material {
            specular: 1.0,
            highlight: Highlight::CookTorrance,
            reflection: 1.0,
            roughness,
            lobe: Lobe::Ggx,
            ..plain.clone()
        };
        let metal = |roughness| Material { ambient: 0.0, diffuse: 0.0, ..glossy(roughness) };
        let clear = |ior| Material {
            ambient: 0.0,
            diffuse: 0.0,
            reflection: 1.0,
            transmission: 1.0,
            ior,
            ..plain.clone()
        };
        match self {
            Self::Gold | Self::Silver | Self::Copper | Self::Brass => metal(0.03),
            Self::Chrome => metal(0.01),
            Self::Iron => metal(0.5),
            Self::BrushedMetal => metal(0.4),
            Self::Glass => clear(1.517),
            Self::FrostedGlass => Material { roughness: 0.3, lobe: Lobe::Ggx, ..clear(1.517) },
            Self::Water => clear(1.333),
            Self::Plastic => Material { diffuse: 0.9, ..glossy(0.15) },
            Self::Rubber => Material { color: Color([0.03; 3]), reflection: 0.0, ..glossy(1.2) },
            Self::Diffuse => plain,
            Self::Mirror => Material { ambient: 0.0, diffuse: 0.0, reflection: 0.95, ..plain },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::{Target, set};
    use crate::{Document, Scene};

    #[test]
    fn documented_f0_is_used_and_no_preset_is_brighter_than_its_light() {
        for choice in Preset::CHOICES {
            let text = format!("[materials.a]\npreset = \"{}\"\n", choice.name);
            let scene = Scene::parse(&text, "a.toml").unwrap_or_else(|e| panic!("{e}"));
            let material = &scene.materials["a"];
            assert_eq!(*material, material.preset.unwrap().material());
            let documented: Vec<f64> =
                choice.doc.split(' ').filter_map(|word| word.parse().ok()).collect();
            if documented.len() == 3 {
                assert_eq!(material.f0().0.to_vec(), documented, "{}", choice.name);
            }
            let found: Vec<_> = scene.warnings().into_iter().map(|w| w.found).collect();
            assert_eq!(found, ["there is no object"], "{}", choice.name);
        }
    }

    const TEXT: &str = "[materials.a] # mine\nroughness = 0.2 # satin\npreset = \"gold\"\n";

    #[test]
    fn keys_override_the_preset_and_are_written_alone() {
        let mut document = Document::parse(TEXT.to_string(), "a.toml").unwrap();
        let scene = document.scene().clone();
        let a = Target::Material("a".into());
        assert_eq!(scene.materials["a"].roughness, 0.2);
        assert_eq!(scene.materials["a"].diffuse, 0.0);
        // Each edit with the lines of the table that it changes to.
        for (key, text, expected) in [
            ("diffuse", "1", "roughness = 0.2 # satin\npreset = \"gold\"\ndiffuse = 1.0\n"),
            ("roughness", "", "preset = \"gold\"\n"),
            ("preset", "frosted", "preset = \"frosted glass\"\n"),
            ("metal", "silver", "roughness = 0.2 # satin\npreset = \"gold\"\nmetal = \"silver\"\n"),
        ] {
            let edited = set(&scene, &a, key, text).unwrap_or_else(|e| panic!("{e}")).scene;
            document.apply(&edited);
            assert_eq!(document.text(), format!("[materials.a] # mine\n{expected}"), "{key}");
            assert_eq!(Scene::parse(document.text(), "a.toml").unwrap(), edited, "{key}");
        }
        // A default that the file does not name can override a preset.
        let mut plain = Document::parse("[materials.a]\nambient = 0.5\n".into(), "a.toml").unwrap();
        let gold = set(plain.scene(), &a, "preset", "gold").unwrap().scene;
        let cone = set(&gold, &a, "lobe", "cone").unwrap().scene;
        plain.apply(&cone);
        assert_eq!(plain.text(), "[materials.a]\npreset = \"gold\"\nlobe = \"cone\"\n");
        // Without its preset a material keeps all values.
        let free = set(&scene, &a, "preset", "").unwrap().scene;
        document.apply(&free);
        assert_eq!(Scene::parse(document.text(), "a.toml").unwrap(), free);
        assert_eq!(free.materials["a"].diffuse, 0.0);
        assert!(!document.text().contains("exponent"), "{}", document.text());
        document.apply(&scene);
        assert_eq!(document.text(), TEXT);
        let text = TEXT.replace("gold", "gould");
        let error = Scene::parse(&text, "a.toml").unwrap_err().to_string();
        assert!(
            error.contains("a.toml:3:10") && error.contains("Did you mean \"gold\"?"),
            "{error}"
        );
    }
}
