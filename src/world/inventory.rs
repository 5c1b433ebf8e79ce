//! What a world contains, in words.

use crate::material::{Bsdf, ReflectionLobe, SpecularModel};
use crate::scene::{BelowHorizon, Filter, RayTypes, Scene};
use crate::world::light_groups::LightGroupSource;
use std::fmt;

/// What a world contains; printing it gives one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Inventory {
    parts: Vec<String>,
}

impl Inventory {
    /// Of a compiled scene.
    pub(super) fn new<S>(
        scene: &Scene,
        geometry: String,
        textures: &[&str],
        finishes: &[Bsdf<S>],
        members: &[LightGroupSource],
        lamps: usize,
        precision: &str,
    ) -> Self {
        let mut parts = vec![geometry];
        parts.extend(textures.iter().map(|word| word.to_string()));
        let mut say = |present: bool, what: &str| {
            if present {
                parts.push(what.to_string());
            }
        };
        let specular =
            |test: fn(&SpecularModel<S>) -> bool| finishes.iter().any(|f| test(&f.specular));
        say(specular(|s| matches!(s, SpecularModel::Phong { .. })), "Phong");
        say(
            specular(|s| matches!(s, SpecularModel::MicrofacetDistribution { .. })),
            "Cook-Torrance",
        );
        let spread = |test: fn(&ReflectionLobe<S>) -> bool| {
            finishes.iter().any(|f| f.reflection.as_ref().is_some_and(|r| test(&r.1)))
        };
        say(spread(|s| matches!(s, ReflectionLobe::Mirror)), "perfect mirror");
        say(spread(|s| matches!(s, ReflectionLobe::Cone { .. })), "cone lobe");
        say(spread(|s| matches!(s, ReflectionLobe::Square { .. })), "square lobe");
        say(
            spread(|s| matches!(s, ReflectionLobe::MicrofacetDistribution(f) if !f.ggx)),
            "Beckmann lobe",
        );
        say(
            spread(|s| matches!(s, ReflectionLobe::MicrofacetDistribution(f) if f.ggx)),
            "GGX lobe",
        );
        let through = |dielectric: bool| {
            let test = |f: &Bsdf<S>| f.transmission.as_ref().map(|t| t.dielectric);
            finishes.iter().any(|f| test(f) == Some(dielectric))
        };
        say(through(false), "transmission");
        say(through(true), "dielectric");
        let absorbs = scene.trace.below_horizon == BelowHorizon::Absorb;
        say(absorbs && spread(|s| !matches!(s, ReflectionLobe::Mirror)), "absorbing horizon");
        let count = |n: usize, what: &str| match n {
            0 => None,
            1 => Some(format!("1 {what}")),
            n => Some(format!("{n} {what}s")),
        };
        let kind = |directional: bool| {
            let shining = |m: &LightGroupSource| match m {
                LightGroupSource::Light(i) => vec![*i],
                LightGroupSource::Shared(list) => list.clone(),
                _ => Vec::new(),
            };
            members
                .iter()
                .flat_map(shining)
                .filter(|i| scene.lights[*i].directional.is_some() == directional)
                .count()
        };
        parts.extend(count(kind(false), "point light"));
        parts.extend(count(kind(true), "directional light"));
        let mut say = |present: bool, what: &str| {
            if present {
                parts.push(what.to_string());
            }
        };
        let shared = members.iter().any(|m| matches!(m, LightGroupSource::Shared(_)));
        say(shared, "shared light group");
        say(members.contains(&LightGroupSource::Ambient), "ambient");
        say(members.contains(&LightGroupSource::Background), "background");
        say(scene.trace.ray_types == RayTypes::Primary, "no shadows");
        say(scene.trace.ray_types == RayTypes::Shadows && lamps > 0, "shadows only");
        say(scene.film.filter == Filter::Point, "no anti-aliasing");
        parts.push(format!("{precision} precision"));
        Self { parts }
    }

    /// Its parts, in order.
    pub fn parts(&self) -> &[String] {
        &self.parts
    }
}

impl fmt::Display for Inventory {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.parts.join(", "))
    }
}
