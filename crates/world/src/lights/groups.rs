//! Light groups. A *light group* is the part of the picture that comes from one source: a light, an
//! emissive material, ambient light or the background. It is proportional to the *emission* of the
//! source, its colour times its intensity. The film stores each group separately, so that emissions
//! can change without new samples. Several lights and materials share a group if the user has named
//! it; the samples of each are multiplied by its own emission, and the light weight is the mix of the
//! group.

use crate::analysis::radiance_range::{RadianceRange, SceneDistances};
use crate::lights::choice::ManyLights;
use crate::world::LightSource;
use std::collections::HashMap;
use zerkalo_kernel::lanes::Float;
use zerkalo_scene::light::{Light, LightGroup};
use zerkalo_scene::material::Material;
use zerkalo_scene::value::Color;
use zerkalo_scene::{Object, Scene};

/// Largest number of light groups for lights and emissive materials. Further lights and materials
/// share the last of these groups.
const MAX_LIGHT_GROUPS: usize = 8;

/// Largest number of light groups, with ambient light and background.
pub const MAX_GROUPS: usize = MAX_LIGHT_GROUPS + 2;

/// Largest size of the film's integer sums \[bytes\]. Lights get groups of their own until the sums
/// reach this size.
const FILM_BYTES: u64 = 1 << 30;

/// Bytes of the film per pixel and light group: two replicates, three channels, eight bytes.
const GROUP_BYTES: u64 = 2 * 3 * 8;

/// Source of a light group.
#[derive(Clone, Debug, PartialEq)]
pub enum LightGroupSource {
    /// Ambient light.
    Ambient,
    /// Radiance of rays that miss all primitives.
    Background,
    /// Light by its index in the scene.
    Light(usize),
    /// Emission of all objects with the material of this name.
    Material(String),
    /// Lights and materials of a group of the user, by its name. The name is empty if the group holds
    /// those for which the film has no room.
    Shared(String, Vec<LightGroupSource>),
}

impl LightGroupSource {
    /// Returns the lights and materials in the group; empty for ambient light and background.
    pub fn emitting(&self) -> &[Self] {
        match self {
            Self::Ambient | Self::Background => &[],
            Self::Light(_) | Self::Material(_) => std::slice::from_ref(self),
            Self::Shared(_, list) => list,
        }
    }

    /// Returns the light weight of the group in the picture of `scene`.
    pub(crate) fn weight(&self, scene: &Scene) -> [f64; 3] {
        match self {
            Self::Shared(_, list) if list.len() == 1 => list[0].weight(scene),
            Self::Shared(name, _) => mix(scene, name),
            Self::Ambient | Self::Background | Self::Light(_) | Self::Material(_) => {
                let (own, mix) = (self.emission(scene), mix(scene, self.name(scene)));
                std::array::from_fn(|i| own[i] * mix[i])
            }
        }
    }

    /// Returns the factor of the samples of `source`, one of this group.
    pub(crate) fn traced(&self, source: &Self, scene: &Scene) -> [f64; 3] {
        match self {
            Self::Shared(_, list) if list.len() == 1 => [1.0; 3],
            Self::Shared(name, _) if name.is_empty() => source.weight(scene),
            Self::Shared(..) => source.emission(scene),
            Self::Ambient | Self::Background | Self::Light(_) | Self::Material(_) => [1.0; 3],
        }
    }

    /// Returns `true` if the group has several lights and materials, whose proportions are fixed.
    pub(crate) fn is_shared(&self) -> bool {
        matches!(self, Self::Shared(_, list) if list.len() > 1)
    }

    /// Returns the name of the light group that the user has given to the source; may be empty.
    pub(crate) fn name<'a>(&'a self, scene: &'a Scene) -> &'a str {
        match self {
            Self::Ambient | Self::Background => "",
            Self::Light(i) => scene.lights.get(*i).map_or("", |light| &light.group),
            Self::Material(name) => scene.materials.get(name).map_or("", |m| &m.group),
            Self::Shared(name, _) => name,
        }
    }

    /// Returns the emission of the source without the mix of its group.
    fn emission(&self, scene: &Scene) -> [f64; 3] {
        match self {
            Self::Ambient => scene.ambient.color.0,
            Self::Background => scene.background.color.0,
            Self::Light(i) => scene.lights.get(*i).map_or([0.0; 3], emission),
            Self::Material(name) => scene.materials.get(name).map_or([0.0; 3], Material::emitted),
            Self::Shared(..) => [1.0; 3],
        }
    }
}

/// Light or emissive material, with its light group.
#[derive(Debug, PartialEq)]
pub(crate) struct GroupedSource<'a> {
    pub source: &'a LightGroupSource,
    /// Index of the light group.
    pub group: usize,
    /// Factor of the samples; 1 for a source with a group of its own.
    pub emission: [f64; 3],
}

impl GroupedSource<'_> {
    /// Returns `light` as a source of the light group; see [`LightSource`].
    pub fn with_light<T, S: Float>(&self, light: T, visible: bool) -> LightSource<T, S> {
        let emission = (self.emission != [1.0; 3]).then(|| self.emission.map(S::from_f64));
        LightSource { light, group: self.group, emission, visible }
    }
}

/// Light groups of a scene, except for groups that would be black in every sample.
#[derive(Clone, Debug, PartialEq)]
pub struct LightGroups {
    /// Source of each group, in the order of the film's sums.
    pub members: Vec<LightGroupSource>,
    /// `true` if some surface reflects light that arrives directly from lights.
    pub(crate) lit: bool,
    /// `true` if some surface reflects ambient light.
    pub(crate) ambient: bool,
    pub(crate) many: ManyLights,
}

impl LightGroups {
    /// Creates the light groups of `scene`. Lights and emissive materials have groups of their own,
    /// or that which the user has given them, with three exceptions that share the last group: all of
    /// them if `merge_lights` is `true`, the lights without a given group of a kind of which the scene
    /// has many (see `ManyLights`), and the lights and materials beyond the largest number of groups.
    ///
    /// `lit` is `true` if some surface reflects direct light, and `ambient` if some surface
    /// reflects ambient light. A light that no surface reflects has a group only if the camera can
    /// see it.
    pub fn new(scene: &Scene, (lit, ambient): (bool, bool), merge_lights: bool) -> Self {
        let mut members = Vec::new();
        if ambient && scene.ambient.color != Color::BLACK {
            members.push(LightGroupSource::Ambient);
        }
        if scene.background.color != Color::BLACK {
            members.push(LightGroupSource::Background);
        }
        let mut emitting: Vec<usize> = (0..scene.lights.len()).collect();
        emitting.retain(|i| contributes(&scene.lights[*i], lit));
        // Many point lights share one group: separate sums for seven of them would take a quarter
        // of the rendering time. The same holds for many spot lights.
        let many = ManyLights::new(emitting.iter().map(|i| &scene.lights[*i]));
        let lights = emitting.into_iter().map(LightGroupSource::Light);
        let materials = emissive_materials(scene).into_iter().map(LightGroupSource::Material);
        let (mut shared, mut separate, mut own) = (Vec::new(), Vec::new(), Vec::new());
        for source in lights.chain(materials) {
            let name = source.name(scene);
            let is_named =
                |group: &&mut _| matches!(group, LightGroupSource::Shared(n, _) if n == name);
            match (separate.iter_mut().find(is_named), &source) {
                (Some(LightGroupSource::Shared(_, list)), _) => list.push(source),
                (_, LightGroupSource::Light(i))
                    if name.is_empty() && many.includes(&scene.lights[*i]) =>
                {
                    shared.push(source);
                }
                _ if name.is_empty() => own.push(source),
                _ => separate.push(LightGroupSource::Shared(name.to_string(), vec![source])),
            }
        }
        separate.append(&mut own);
        let pixels = scene.film.size.iter().map(|n| u64::from(*n)).product::<u64>().max(1);
        let max_groups = (FILM_BYTES / (pixels * GROUP_BYTES)) as usize;
        let max_light_groups = match merge_lights {
            true => 1,
            false => max_groups.saturating_sub(members.len()).clamp(1, MAX_LIGHT_GROUPS),
        };
        if separate.len() + usize::from(!shared.is_empty()) > max_light_groups {
            let rest: Vec<_> = separate.drain(max_light_groups - 1..).collect();
            shared.splice(0..0, rest.iter().flat_map(|group| group.emitting().iter().cloned()));
            shared.retain(|source| source.weight(scene) != [0.0; 3]);
        }
        members.extend(separate);
        match shared.len() {
            0 | 1 => members.append(&mut shared),
            _ => members.push(LightGroupSource::Shared(String::new(), shared)),
        }
        if members.is_empty() {
            // The film needs at least one group, even for a black picture.
            members.push(LightGroupSource::Background);
        }
        Self { members, lit, ambient, many }
    }

    /// Returns the number of groups that would remain if all lights and emissive materials shared a
    /// single group.
    pub fn merged_count(&self) -> usize {
        let lights = self.members.iter().filter(|member| !member.emitting().is_empty()).count();
        self.members.len() - lights.saturating_sub(1)
    }

    /// Returns the index of the group whose source is `wanted`.
    pub fn find(&self, wanted: &LightGroupSource) -> Option<usize> {
        self.members.iter().position(|m| m == wanted)
    }

    /// Iterates over all lights and emissive materials.
    pub(crate) fn sources(&self, scene: &Scene) -> impl Iterator<Item = GroupedSource<'_>> {
        let members = self.members.iter().enumerate();
        members.flat_map(move |(group, member)| {
            member.emitting().iter().map(move |source| GroupedSource {
                source,
                group,
                emission: member.traced(source, scene),
            })
        })
    }

    /// Returns the light weight of each group in the picture of `scene`, which may differ from the
    /// compiled scene in emissions and on/off switches, mixes of groups, ambient light and background.
    pub fn weights(&self, scene: &Scene) -> Vec<[f64; 3]> {
        let mut weights: Vec<_> = self.members.iter().map(|member| member.weight(scene)).collect();
        let is_alone: Vec<bool> =
            self.names(scene).iter().map(|name| *name == scene.film.solo).collect();
        if is_alone.contains(&true) {
            let others = weights.iter_mut().zip(&is_alone).filter(|(_, is_alone)| !**is_alone);
            others.for_each(|(weight, _)| *weight = [0.0; 3]);
        }
        weights
    }

    /// Returns the name of each group, for layers of image files.
    pub fn names(&self, scene: &Scene) -> Vec<String> {
        let name = |member: &LightGroupSource| match member {
            LightGroupSource::Ambient => "ambient".to_string(),
            LightGroupSource::Background => "background".to_string(),
            LightGroupSource::Light(i) => match scene.lights.get(*i) {
                Some(light) if !light.name.is_empty() => light.name.clone(),
                _ => format!("light {}", i + 1),
            },
            LightGroupSource::Material(name) => name.clone(),
            LightGroupSource::Shared(name, list) if name.is_empty() => {
                format!("{} lights", list.len())
            }
            LightGroupSource::Shared(name, _) => name.clone(),
        };
        self.members.iter().map(name).collect()
    }

    /// Returns the scale of each group: the number of integer steps per unit of radiance in the
    /// film, a power of two. It is derived from the group's [`RadianceRange`]. `ranges` has the
    /// range of each light, by its index in the scene, for intensity 1.
    pub(crate) fn scales<S: Float>(
        &self,
        scene: &Scene,
        ranges: &HashMap<usize, RadianceRange>,
        distances: &SceneDistances,
    ) -> Vec<f64> {
        let range_of_material = |name: &str| {
            let has_material = |object: &usize| scene.objects[*object].materials().contains(&name);
            let objects = (0..scene.objects.len()).filter(has_material);
            objects.map(|object| distances.object(object)).reduce(RadianceRange::or)
        };
        let range_of_one = |source: &LightGroupSource| match source {
            LightGroupSource::Ambient => Some(distances.ambient()),
            LightGroupSource::Background => Some(distances.background()),
            LightGroupSource::Light(i) => ranges.get(i).copied(),
            LightGroupSource::Material(name) => range_of_material(name),
            LightGroupSource::Shared(..) => None,
        };
        let range_of_traced = |member: &LightGroupSource, source: &LightGroupSource| {
            let channels = member.traced(source, scene).into_iter().filter(|s| *s > 0.0);
            let (low, high) = (channels.clone().reduce(f64::min)?, channels.reduce(f64::max)?);
            Some(range_of_one(source)?.times(low, high))
        };
        let range_of = |member: &LightGroupSource| {
            let LightGroupSource::Shared(_, list) = member else { return range_of_one(member) };
            let ranges = list.iter().filter_map(|source| range_of_traced(member, source));
            ranges.reduce(RadianceRange::or)
        };
        // The largest sample and its square have to be finite in the precision of the samples.
        let (min_exponent, max_exponent) =
            if S::EPSILON > 1e-10 { (-78.0, 170.0) } else { (-400.0, 900.0) };
        let scale = |member| {
            let exponent = range_of(member).map_or(0.0, |range| range.scale_exponent());
            exponent.clamp(min_exponent, max_exponent).exp2()
        };
        self.members.iter().map(scale).collect()
    }
}

/// Returns the names of the materials that emit light and are used, in order of first use.
pub(crate) fn emissive_materials(scene: &Scene) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for name in scene.objects.iter().flat_map(Object::materials) {
        let emits = scene.materials.get(name).is_some_and(Material::emits);
        if emits && !names.iter().any(|known| known == name) {
            names.push(name.to_string());
        }
    }
    names
}

/// Returns the emission of a light; black if it is off.
fn emission(light: &Light) -> [f64; 3] {
    if light.on { light.color.scaled(light.intensity).0 } else { [0.0; 3] }
}

/// Returns the factor of the light group `name`; 1 if the scene has none.
fn mix(scene: &Scene, name: &str) -> [f64; 3] {
    scene.groups.get(name).map_or([1.0; 3], LightGroup::factor)
}

/// Returns `true` if the light changes the picture: it emits, and surfaces reflect its light
/// (`lit`) or the camera sees it.
pub(crate) fn contributes(light: &Light, lit: bool) -> bool {
    emission(light) != [0.0; 3] && (lit || light.visible && light.has_radiance())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::choice::MIN_LIGHTS;

    const LIGHTS: &str = "
        [ambient]
        color = [0.1, 0.1, 0.1]
        [[light]]
        name = \"lamp\"
        point = { position = [0.0, 3.0, 0.0] }
        [[light]]
        point = { position = [1.0, 3.0, 0.0] }
        on = false
        [materials.red]
        color = [1.0, 0.0, 0.0]
        [materials.spare]
        [[object]]
        material = \"red\"
        shape.sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }
    ";

    fn scene(text: &str) -> Scene {
        Scene::parse(text, "test").unwrap_or_else(|e| panic!("{e}"))
    }

    fn move_right(light: &mut Light) {
        light.position_mut().unwrap()[0] = 5.0;
    }

    fn can_reuse(groups: &LightGroups, scene: &Scene, change: impl Fn(&mut Scene)) -> bool {
        let mut changed = scene.clone();
        change(&mut changed);
        groups.can_reuse(scene, &changed)
    }

    #[test]
    fn samples_are_reused_for_scenes_that_differ_in_group_weights_only() {
        let scene = scene(LIGHTS);
        let groups = LightGroups::new(&scene, (true, true), false);
        let reusable = |change: fn(&mut Scene)| can_reuse(&groups, &scene, change);
        assert!(reusable(|_| ()));
        assert!(reusable(|s| s.lights[0].intensity = 7.0));
        assert!(reusable(|s| s.lights[0].color = Color([0.0, 0.5, 1.0])));
        assert!(reusable(|s| s.lights[0].on = false));
        assert!(reusable(|s| s.ambient.color = Color::BLACK));
        assert!(reusable(|s| s.ambient.color = Color::WHITE));
        assert!(reusable(|s| s.film.rays_per_pixel = 9));
        assert!(reusable(|s| s.lights[0].name = "sun".to_string()));
        assert!(reusable(|s| s.objects[0].name = "ball".to_string()));
        assert!(reusable(|s| s.materials.retain(|name, _| name != "spare")));
        // A material under another name is the same material.
        assert!(reusable(|s| {
            let red = s.materials.remove("red").unwrap();
            s.materials.insert("crimson".to_string(), red);
            s.objects[0].material = "crimson".to_string();
        }));
        // Lights that do not emit may move or be absent.
        assert!(reusable(|s| s.lights[1].intensity = 9.0));
        assert!(reusable(|s| move_right(&mut s.lights[1])));
        assert!(reusable(|s| s.lights.truncate(s.lights.len() - 1)));
        assert!(reusable(|s| s.lights.clear()));
        assert!(reusable(|s| {
            s.lights[0].on = false;
            move_right(&mut s.lights[0]);
        }));
    }

    #[test]
    fn samples_are_not_reused_for_other_scenes() {
        let scene = scene(LIGHTS);
        let groups = LightGroups::new(&scene, (true, true), false);
        let reusable = |change: fn(&mut Scene)| can_reuse(&groups, &scene, change);
        assert!(!reusable(|s| s.lights[1].on = true));
        assert!(!reusable(|s| s.background.color = Color::WHITE));
        assert!(!reusable(|s| move_right(&mut s.lights[0])));
        assert!(!reusable(|s| s.lights[0].falloff = zerkalo_scene::light::Falloff::InverseSquare));
        assert!(!reusable(|s| s.lights.push(s.lights[0].clone())));
        assert!(!reusable(|s| s.camera.eye[0] += 0.5));
        assert!(!reusable(|s| s.film.size = [641, 480]));
        assert!(!reusable(|s| s.trace.max_depth = 3));
        assert!(!reusable(|s| s.materials.get_mut("red").unwrap().ambient = 0.5));
        assert!(!reusable(|s| s.objects[0].material = "spare".to_string()));
        assert!(!reusable(|s| s.objects.push(s.objects[0].clone())));
    }

    const GLOWING: &str = "
        [materials.lamp]
        emission = 4.0
        [materials.white]
        [[object]]
        material = \"lamp\"
        shape.sphere = { center = [0.0, 3.0, 0.0], radius = 1.0 }
        [[object]]
        material = \"white\"
        shape.sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }
    ";

    #[test]
    fn emission_of_a_material_is_a_group_weight() {
        let scene = scene(GLOWING);
        let groups = LightGroups::new(&scene, (true, false), false);
        assert_eq!(groups.members, [LightGroupSource::Material("lamp".to_string())]);
        assert_eq!(groups.names(&scene), ["lamp"]);
        assert_eq!(groups.weights(&scene), [[4.0; 3]]);
        let reusable = |change: fn(&mut Scene)| can_reuse(&groups, &scene, change);
        fn lamp(scene: &mut Scene) -> &mut Material {
            scene.materials.get_mut("lamp").unwrap()
        }
        assert!(reusable(|_| ()));
        assert!(reusable(|s| lamp(s).emission = 7.0));
        assert!(reusable(|s| lamp(s).emission = 0.0));
        assert!(reusable(|s| lamp(s).emission_color = Color([1.0, 0.5, 0.0])));
        assert!(!reusable(|s| lamp(s).diffuse = 0.5));
        assert!(!reusable(|s| s.materials.get_mut("white").unwrap().emission = 1.0));
        assert!(!reusable(|s| s.objects[1].material = "lamp".to_string()));
        // A light group is identified by the name of its material, so the samples cannot be reused
        // if the material has another name.
        assert!(!reusable(|s| {
            let lamp = s.materials.remove("lamp").unwrap();
            s.materials.insert("bulb".to_string(), lamp);
            s.objects[0].material = "bulb".to_string();
        }));
        let mut dark = scene.clone();
        lamp(&mut dark).emission = 0.0;
        assert_eq!(groups.weights(&dark), [[0.0; 3]]);
        assert!(!LightGroups::new(&dark, (true, false), false).can_reuse(&dark, &scene));
    }

    #[test]
    fn lights_and_materials_share_the_last_group() {
        let light = "[[light]]\npoint = { position = [0.0, 3.0, 0.0] }\n";
        let scene = scene(&(light.repeat(MAX_LIGHT_GROUPS) + GLOWING));
        let groups = LightGroups::new(&scene, (true, false), false);
        let shared = [
            LightGroupSource::Light(MAX_LIGHT_GROUPS - 1),
            LightGroupSource::Material("lamp".to_string()),
        ];
        assert_eq!(
            groups.members.last(),
            Some(&LightGroupSource::Shared(String::new(), shared.to_vec()))
        );
        let group = MAX_LIGHT_GROUPS - 1;
        let lamp = GroupedSource { source: &shared[1], group, emission: [4.0; 3] };
        assert_eq!(groups.sources(&scene).last(), Some(lamp));
        let change = |s: &mut Scene| s.materials.get_mut("lamp").unwrap().emission = 3.0;
        assert!(!can_reuse(&groups, &scene, change));
    }

    #[test]
    fn many_point_lights_share_a_group() {
        let point = "[[light]]\npoint = { position = [0.0, 3.0, 0.0] }\n";
        let sphere = "[[light]]\nsphere = { center = [0.0, 3.0, 0.0], radius = 0.1 }\n";
        let members = |points: usize| {
            let scene = scene(&(point.repeat(points) + sphere + GLOWING));
            LightGroups::new(&scene, (true, false), false).members
        };
        let lights =
            |range| -> Vec<_> { std::ops::Range::map(range, LightGroupSource::Light).collect() };
        let lamp = LightGroupSource::Material("lamp".to_string());

        let single = MAX_LIGHT_GROUPS - 1;
        let few = members(MIN_LIGHTS - 1);
        assert_eq!(few[..single], lights(0..single));
        let rest = [lights(single..MIN_LIGHTS), vec![lamp.clone()]].concat();
        assert_eq!(few[single..], [LightGroupSource::Shared(String::new(), rest)]);

        let shared = LightGroupSource::Shared(String::new(), lights(0..MIN_LIGHTS));
        assert_eq!(members(MIN_LIGHTS), [LightGroupSource::Light(MIN_LIGHTS), lamp, shared]);
    }

    #[test]
    fn many_spot_lights_share_a_group() {
        let point = "[[light]]\npoint = { position = [0.0, 3.0, 0.0] }\n";
        let spot = "[[light]]\nspot = { position = [0.0, 3.0, 0.0], direction = [0.0, -1.0, 0.0], \
                    inner_angle = 20.0, outer_angle = 100.0 }\n";
        let members = |points: usize, spots: usize| {
            let scene = scene(&(point.repeat(points) + &spot.repeat(spots) + GLOWING));
            LightGroups::new(&scene, (true, false), false).members
        };
        let lights = |range: std::ops::Range<usize>| {
            let lights = range.map(LightGroupSource::Light).collect();
            LightGroupSource::Shared(String::new(), lights)
        };
        let lamp = LightGroupSource::Material("lamp".to_string());
        let single = LightGroupSource::Light;
        let many = MIN_LIGHTS;
        assert_eq!(members(1, many), [single(0), lamp.clone(), lights(1..many + 1)]);
        assert_eq!(members(many, 1), [single(many), lamp.clone(), lights(0..many)]);
        assert_eq!(members(many, many), [lamp, lights(0..2 * many)]);
    }

    #[test]
    fn lights_do_not_matter_without_surfaces_that_return_light() {
        let scene = scene(LIGHTS);
        let groups = LightGroups::new(&scene, (false, false), false);
        assert!(can_reuse(&groups, &scene, |s| s.lights[1].on = true));
        assert!(can_reuse(&groups, &scene, |s| s.lights.push(s.lights[0].clone())));
        assert!(can_reuse(&groups, &scene, |s| s.ambient.color = Color::WHITE));
        // A black picture has a group for the background, because the film needs one. Its samples
        // cannot be reused for a background that is not black.
        assert_eq!(groups.members, [LightGroupSource::Background]);
        assert!(!can_reuse(&groups, &scene, |s| s.background.color = Color::WHITE));
    }

    #[test]
    fn samples_are_not_reused_when_a_light_of_a_shared_group_changes() {
        let light = "[[light]]\npoint = { position = [0.0, 3.0, 0.0] }\n";
        let scene = scene(&light.repeat(MAX_LIGHT_GROUPS + 2));
        let groups = LightGroups::new(&scene, (true, false), false);
        let single = MAX_LIGHT_GROUPS - 1;
        assert_eq!(
            groups.members[single],
            LightGroupSource::Shared(
                String::new(),
                (single..single + 3).map(LightGroupSource::Light).collect()
            )
        );
        assert!(can_reuse(&groups, &scene, |s| s.lights[single - 1].intensity = 3.0));
        assert!(!can_reuse(&groups, &scene, |s| s.lights[single].intensity = 3.0));
        assert!(!can_reuse(&groups, &scene, |s| s.lights[single + 1].on = false));
        assert!(!can_reuse(&groups, &scene, |s| s.lights.truncate(s.lights.len() - 1)));
    }
}
