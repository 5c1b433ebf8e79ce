//! Inventory: list of the features that a compiled scene contains, such as numbers of primitives
//! and kinds of materials, for the user.

use crate::lights::groups::LightGroupSource;
use crate::world::World;
use zerkalo_kernel::lanes::SimdFloat;
use zerkalo_scene::light::LightKind;
use zerkalo_scene::material::{Bsdf, FacetNormals, ReflectionLobe, SpecularModel};
use zerkalo_scene::{BelowHorizon, Filter, RayTypes, Scene};

/// Returns the list of the features of `world`, which was compiled from `scene`: separated by
/// commas, in one line.
pub(crate) fn inventory<L: SimdFloat>(scene: &Scene, world: &World<L>) -> String {
    let groups = &world.info.groups.members;
    let (emissive, unsampled) = world.lights.emitters.object_counts();
    let mut parts = vec![world.geometry.description.clone()];
    parts.extend(world.surface_textures.features().into_iter().map(String::from));
    parts.extend(material_features(scene, world));
    let counted = |n: usize, name: &str| match n {
        0 => None,
        1 => Some(format!("1 {name}")),
        n => Some(format!("{n} {name}s")),
    };
    let light_count = |kind: &str| {
        let is_kind = |source: &&LightGroupSource| matches!(source, LightGroupSource::Light(i) if scene.lights[*i].kind.key() == kind);
        groups.iter().flat_map(LightGroupSource::emitting).filter(is_kind).count()
    };
    for kind in LightKind::KEYS {
        parts.extend(counted(light_count(kind), &format!("{kind} light")));
    }
    parts.extend(present([(world.lights.choice.is_some(), "choice of lights")]));
    parts.extend(counted(emissive, "emissive object"));
    parts.extend(present([(!world.lights.emitters.choices.is_empty(), "choice of emitters")]));
    if unsampled > 0 {
        parts.push(format!("{unsampled} of them without sampled points"));
    }
    parts.extend(present([
        (world.camera.lens.is_some(), "thin lens"),
        (world.camera.is_panorama(), "panorama"),
    ]));
    if let Some(limits) = &world.diffuse_limits {
        parts.extend(counted(limits.depth as usize, "diffuse bounce"));
        parts.extend(present([(!limits.caustics, "no caustics")]));
    }
    let ray_types = scene.trace.ray_types;
    let lights = &world.lights;
    let has_lights =
        !lights.delta_lights.is_empty() || lights.choice.is_some() || lights.has_emitters();
    let nested_dielectrics = world.nested_dielectrics.as_ref();
    let passes = nested_dielectrics.is_some_and(|nested| nested.clear_panes.is_some());
    let shared = |is_named: bool| {
        let is_shared = |group: &&LightGroupSource| matches!(group, LightGroupSource::Shared(name, _) if name.is_empty() != is_named);
        groups.iter().filter(is_shared).count()
    };
    parts.extend(counted(shared(true), "named light group"));
    parts.extend(present([
        (shared(false) > 0, "shared light group"),
        (groups.contains(&LightGroupSource::Ambient), "ambient"),
        (groups.contains(&LightGroupSource::Background), "background"),
        (passes && has_lights, "shadow rays through clear panes"),
        (!world.mirrors.is_empty(), "mirror light"),
        (ray_types == RayTypes::Primary, "no shadows"),
        (ray_types == RayTypes::Shadows && has_lights, "shadows only"),
        (scene.film.filter == Filter::Point, "no anti-aliasing"),
    ]));
    parts.push(format!("{} precision", world.info.precision.name()));
    parts.join(", ")
}

/// Returns the features of the materials of `world`.
fn material_features<L: SimdFloat>(
    scene: &Scene,
    world: &World<L>,
) -> impl Iterator<Item = String> {
    let any = |test: &dyn Fn(&Bsdf<L::Scalar>) -> bool| world.bsdfs.iter().any(test);
    let any_lobe = |test: fn(&ReflectionLobe<L::Scalar>) -> bool| {
        any(&|bsdf| bsdf.reflection.is_some() && test(&bsdf.lobe))
    };
    let absorbs = scene.trace.below_horizon == BelowHorizon::Absorb;
    present([
        (any(&|b| matches!(b.specular, SpecularModel::Phong { .. })), "Phong"),
        (any(&|b| matches!(b.specular, SpecularModel::Microfacet { .. })), "Cook-Torrance"),
        (any_lobe(|lobe| matches!(lobe, ReflectionLobe::Mirror)), "perfect mirror"),
        (any_lobe(|lobe| matches!(lobe, ReflectionLobe::Cone { .. })), "cone lobe"),
        (any_lobe(|lobe| matches!(lobe, ReflectionLobe::Square { .. })), "square lobe"),
        (any_lobe(|lobe| has_facets(lobe, FacetNormals::Beckmann)), "Beckmann lobe"),
        (any_lobe(|lobe| has_facets(lobe, FacetNormals::Ggx)), "GGX lobe"),
        (any(&|b| b.transmission.as_ref().is_some_and(|t| !t.dielectric)), "transmission"),
        (any(&|b| b.transmission.as_ref().is_some_and(|t| t.dielectric)), "dielectric"),
        (any(&|b| b.transmission.is_some() && !b.is_delta()), "rough transmission"),
        (any(&Bsdf::absorbs), "absorption"),
        (absorbs && any_lobe(|lobe| !matches!(lobe, ReflectionLobe::Mirror)), "absorbing horizon"),
    ])
}

fn has_facets<S>(lobe: &ReflectionLobe<S>, normals: FacetNormals) -> bool {
    matches!(lobe, ReflectionLobe::Microfacet(facets) if facets.normals == normals)
}

/// Returns the names in `features` whose flag is `true`: the features that are present.
fn present<const N: usize>(features: [(bool, &str); N]) -> impl Iterator<Item = String> {
    features.into_iter().filter(|(present, _)| *present).map(|(_, name)| name.to_string())
}
