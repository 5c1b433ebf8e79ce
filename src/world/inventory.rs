//! Inventory: list of the features that a compiled scene contains, for reports.

use crate::lanes::Float;
use crate::material::{Bsdf, ReflectionLobe, SpecularModel, Transmission};
use crate::scene::{BelowHorizon, Filter, RayTypes, Scene};
use crate::world::integrator::indirect_diffuse::DiffuseLimits;
use crate::world::light_groups::LightGroupSource;
use std::fmt;

/// List of the features that a world contains. `Display` formats it as one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Inventory {
    parts: Vec<String>,
}

/// Parts of a compiled scene from which the inventory is made.
pub(super) struct InventorySources<'a, S> {
    /// Description of the primitives.
    pub geometry: String,
    /// Names of the texture features that the scene uses, such as `bump`.
    pub textures: Vec<&'static str>,
    pub bsdfs: &'a [Bsdf<S>],
    pub groups: &'a [LightGroupSource],
    /// Number of lights that emit.
    pub lights: usize,
    /// `true` if paths choose among the point lights.
    pub light_choice: bool,
    /// Number of emissive objects from which light is sampled, and of other emissive objects.
    pub emissive: [usize; 2],
    pub diffuse_limits: Option<DiffuseLimits>,
    /// `single` or `double`.
    pub precision: &'static str,
}

impl Inventory {
    /// Creates the inventory of a compiled scene.
    pub(super) fn new<S: Float>(scene: &Scene, sources: InventorySources<S>) -> Self {
        let InventorySources {
            geometry,
            textures,
            bsdfs,
            groups,
            lights,
            light_choice,
            emissive,
            precision,
            diffuse_limits,
        } = sources;
        let mut parts = vec![geometry];
        parts.extend(textures.into_iter().map(String::from));
        let mut add_if = |present: bool, name: &str| {
            if present {
                parts.push(name.to_string());
            }
        };
        let any_specular =
            |test: fn(&SpecularModel<S>) -> bool| bsdfs.iter().any(|bsdf| test(&bsdf.specular));
        add_if(any_specular(|s| matches!(s, SpecularModel::Phong { .. })), "Phong");
        add_if(
            any_specular(|s| matches!(s, SpecularModel::MicrofacetDistribution { .. })),
            "Cook-Torrance",
        );
        let any_lobe = |test: fn(&ReflectionLobe<S>) -> bool| {
            bsdfs.iter().any(|bsdf| bsdf.reflection.as_ref().is_some_and(|(_, lobe)| test(lobe)))
        };
        add_if(any_lobe(|lobe| matches!(lobe, ReflectionLobe::Mirror)), "perfect mirror");
        add_if(any_lobe(|lobe| matches!(lobe, ReflectionLobe::Cone { .. })), "cone lobe");
        add_if(any_lobe(|lobe| matches!(lobe, ReflectionLobe::Square { .. })), "square lobe");
        add_if(
            any_lobe(|lobe| matches!(lobe, ReflectionLobe::MicrofacetDistribution(d) if !d.ggx)),
            "Beckmann lobe",
        );
        add_if(
            any_lobe(|lobe| matches!(lobe, ReflectionLobe::MicrofacetDistribution(d) if d.ggx)),
            "GGX lobe",
        );
        let any_transmission = |dielectric: bool| {
            let is_dielectric = |b: &Bsdf<S>| b.transmission.as_ref().map(|t| t.dielectric);
            bsdfs.iter().any(|bsdf| is_dielectric(bsdf) == Some(dielectric))
        };
        add_if(any_transmission(false), "transmission");
        add_if(any_transmission(true), "dielectric");
        let transmits = |test: fn(&Transmission<S>) -> bool| {
            bsdfs.iter().filter_map(|bsdf| bsdf.transmission.as_ref()).any(test)
        };
        add_if(transmits(|t| !matches!(t.lobe, ReflectionLobe::Mirror)), "rough transmission");
        add_if(bsdfs.iter().any(Bsdf::absorbs), "absorption");
        let absorbs = scene.trace.below_horizon == BelowHorizon::Absorb;
        add_if(
            absorbs && any_lobe(|lobe| !matches!(lobe, ReflectionLobe::Mirror)),
            "absorbing horizon",
        );
        let counted = |n: usize, name: &str| match n {
            0 => None,
            1 => Some(format!("1 {name}")),
            n => Some(format!("{n} {name}s")),
        };
        let light_count = |kind: &str| {
            let is_kind = |source: &&LightGroupSource| match source {
                LightGroupSource::Light(i) => scene.lights[*i].kinds() == [kind],
                _ => false,
            };
            groups.iter().flat_map(LightGroupSource::emitting).filter(is_kind).count()
        };
        for kind in ["point", "directional", "spot", "sphere", "rectangle", "disk", "environment"] {
            parts.extend(counted(light_count(kind), &format!("{kind} light")));
        }
        if light_choice {
            parts.push("choice of lights".to_string());
        }
        parts.extend(counted(emissive[0] + emissive[1], "emissive object"));
        if emissive[1] > 0 {
            parts.push(format!("{} of them without sampled points", emissive[1]));
        }
        let mut add_if = |present: bool, name: &str| {
            if present {
                parts.push(name.to_string());
            }
        };
        let is_shared = |source: &LightGroupSource| matches!(source, LightGroupSource::Shared(_));
        add_if(scene.camera.lens_radius() > 0.0, "thin lens");
        if let Some(limits) = diffuse_limits {
            let plural = if limits.depth == 1 { "" } else { "s" };
            parts.push(format!("{} diffuse bounce{plural}", limits.depth));
            if !limits.caustics {
                parts.push("no caustics".to_string());
            }
        }
        let mut add_if = |present: bool, name: &str| {
            if present {
                parts.push(name.to_string());
            }
        };
        add_if(groups.iter().any(is_shared), "shared light group");
        add_if(groups.contains(&LightGroupSource::Ambient), "ambient");
        add_if(groups.contains(&LightGroupSource::Background), "background");
        add_if(scene.trace.ray_types == RayTypes::Primary, "no shadows");
        add_if(scene.trace.ray_types == RayTypes::Shadows && lights > 0, "shadows only");
        add_if(scene.film.filter == Filter::Point, "no anti-aliasing");
        parts.push(format!("{precision} precision"));
        Self { parts }
    }

    /// Names of the features, in order.
    pub fn parts(&self) -> &[String] {
        &self.parts
    }
}

impl fmt::Display for Inventory {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.parts.join(", "))
    }
}
