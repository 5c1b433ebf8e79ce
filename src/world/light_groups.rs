//! Light groups: parts of the picture that are linear in one light's colour and strength, kept apart
//! so that these can change without new samples.

use crate::lanes::Float;
use crate::light::{DeltaLight, Light};
use crate::scene::Scene;
use crate::value::Color;
use crate::world::radiance_range::{RadianceRange, SceneDistances};
use glam::DVec3;

/// The most lights with a group of their own; more share the last group.
const MAX_LIGHT_GROUPS: usize = 8;

/// The most groups: the lights', ambient and background.
pub const MAX_GROUPS: usize = MAX_LIGHT_GROUPS + 2;

/// Memory for sums beyond which lights share groups, in bytes.
const FILM_BYTES: u64 = 1 << 30;

/// Bytes per pixel and group: two replicates of three channels.
const GROUP_BYTES: u64 = 2 * 3 * 8;

/// What one group holds.
#[derive(Clone, Debug, PartialEq)]
pub enum LightGroupSource {
    /// Ambient light.
    Ambient,
    /// What rays see that meet nothing.
    Background,
    /// One light, by its number in the scene.
    Light(usize),
    /// Several lights, each with its colour and strength already in the samples.
    Shared(Vec<usize>),
}

/// The groups of a scene: those that can be other than black.
#[derive(Clone, Debug, PartialEq)]
pub struct LightGroups {
    /// In the order of the film.
    pub members: Vec<LightGroupSource>,
    /// Some surface answers lights.
    pub(super) lit: bool,
    /// Some surface answers ambient light.
    pub(super) ambient: bool,
}

impl LightGroups {
    /// The groups of `scene`. `lit`: some surface answers lights.
    pub fn new(scene: &Scene, lit: bool, ambient: bool) -> Self {
        let mut members = Vec::new();
        if ambient && scene.ambient.color != Color::BLACK {
            members.push(LightGroupSource::Ambient);
        }
        if scene.background.color != Color::BLACK {
            members.push(LightGroupSource::Background);
        }
        let shining: Vec<usize> =
            (0..scene.lights.len()).filter(|i| lit && emits(&scene.lights[*i])).collect();
        let pixels = scene.film.size.iter().map(|n| u64::from(*n)).product::<u64>().max(1);
        let affordable = (FILM_BYTES / (pixels * GROUP_BYTES)) as usize;
        let room = affordable.saturating_sub(members.len()).clamp(1, MAX_LIGHT_GROUPS);
        let (own, shared) =
            shining.split_at(if shining.len() <= room { shining.len() } else { room - 1 });
        members.extend(own.iter().map(|i| LightGroupSource::Light(*i)));
        if !shared.is_empty() {
            members.push(LightGroupSource::Shared(shared.to_vec()));
        }
        if members.is_empty() {
            // A black picture is a picture too: it needs one group to hold it.
            members.push(LightGroupSource::Background);
        }
        Self { members, lit, ambient }
    }

    /// Position of a member, if there is such a group.
    pub fn find(&self, wanted: &LightGroupSource) -> Option<usize> {
        self.members.iter().position(|m| m == wanted)
    }

    /// Each shining light's number with its group and its weight in the samples of that group.
    pub fn lights(&self, scene: &Scene) -> Vec<(usize, usize, [f64; 3])> {
        let mut out = Vec::new();
        for (group, member) in self.members.iter().enumerate() {
            match member {
                LightGroupSource::Light(i) => out.push((*i, group, [1.0; 3])),
                LightGroupSource::Shared(list) => {
                    out.extend(list.iter().map(|i| (*i, group, emission(&scene.lights[*i]))));
                }
                LightGroupSource::Ambient | LightGroupSource::Background => {}
            }
        }
        out
    }

    /// Weight of each group in the picture of `scene`, which may differ from the compiled one in the
    /// colours, intensities and switches of lights, ambient and background.
    pub fn mix(&self, scene: &Scene) -> Vec<[f64; 3]> {
        let weight = |member: &LightGroupSource| match member {
            LightGroupSource::Ambient => scene.ambient.color.0,
            LightGroupSource::Background => scene.background.color.0,
            LightGroupSource::Light(i) => scene.lights.get(*i).map_or([0.0; 3], emission),
            LightGroupSource::Shared(_) => [1.0; 3],
        };
        self.members.iter().map(weight).collect()
    }

    /// A name for each group, for layers of files.
    pub fn names(&self, scene: &Scene) -> Vec<String> {
        let name = |member: &LightGroupSource| match member {
            LightGroupSource::Ambient => "ambient".to_string(),
            LightGroupSource::Background => "background".to_string(),
            LightGroupSource::Light(i) => match scene.lights.get(*i) {
                Some(light) if !light.name.is_empty() => light.name.clone(),
                _ => format!("light {}", i + 1),
            },
            LightGroupSource::Shared(list) => format!("{} lights", list.len()),
        };
        self.members.iter().map(name).collect()
    }

    /// Steps per unit of radiance in the film's integers, a power of two for each group, as
    /// [`RadianceRange`] has it.
    pub(super) fn scales<S: Float>(
        &self,
        scene: &Scene,
        origin: DVec3,
        surroundings: &SceneDistances,
    ) -> Vec<f64> {
        let of_light = |i: usize| {
            let lamp = DeltaLight::<S>::new(&scene.lights[i], origin)?;
            Some(surroundings.lamp(&lamp))
        };
        let of_shared = |i: &usize| {
            let channels = emission(&scene.lights[*i]).into_iter().filter(|s| *s > 0.0);
            let (least, most) = (channels.clone().reduce(f64::min)?, channels.reduce(f64::max)?);
            Some(of_light(*i)?.times(least, most))
        };
        let brightness = |member: &LightGroupSource| match member {
            LightGroupSource::Ambient => Some(surroundings.ambient()),
            LightGroupSource::Background => Some(surroundings.background()),
            LightGroupSource::Light(i) => of_light(*i),
            LightGroupSource::Shared(list) => {
                list.iter().filter_map(of_shared).reduce(RadianceRange::or)
            }
        };
        // The limits of samples and their squares are numbers in the precision of the samples.
        let (least, most) = if S::EPSILON > 1e-10 { (-78.0, 170.0) } else { (-400.0, 900.0) };
        let scale = |member| {
            brightness(member).map_or(0.0, |b| b.scale_exponent()).clamp(least, most).exp2()
        };
        self.members.iter().map(scale).collect()
    }
}

/// Colour times intensity; black if it is off.
pub(super) fn emission(light: &Light) -> [f64; 3] {
    if light.on { light.color.scaled(light.intensity).0 } else { [0.0; 3] }
}

pub(super) fn emits(light: &Light) -> bool {
    emission(light) != [0.0; 3]
}

#[cfg(test)]
mod tests {
    use super::*;

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

    fn serves(groups: &LightGroups, scene: &Scene, change: impl Fn(&mut Scene)) -> bool {
        let mut changed = scene.clone();
        change(&mut changed);
        groups.can_reuse(scene, &changed)
    }

    #[test]
    fn samples_serve_scenes_that_differ_in_the_mix_only() {
        let scene = scene(LIGHTS);
        let groups = LightGroups::new(&scene, true, true);
        let serves = |change: fn(&mut Scene)| serves(&groups, &scene, change);
        assert!(serves(|_| ()));
        assert!(serves(|s| s.lights[0].intensity = 7.0));
        assert!(serves(|s| s.lights[0].color = Color([0.0, 0.5, 1.0])));
        assert!(serves(|s| s.lights[0].on = false));
        assert!(serves(|s| s.ambient.color = Color::BLACK));
        assert!(serves(|s| s.ambient.color = Color::WHITE));
        assert!(serves(|s| s.film.rays_per_pixel = 9));
        assert!(serves(|s| s.lights[0].name = "sun".to_string()));
        assert!(serves(|s| s.objects[0].name = "ball".to_string()));
        assert!(serves(|s| s.materials.retain(|name, _| name != "spare")));
        // A material under another name is the same material.
        assert!(serves(|s| {
            let red = s.materials.remove("red").unwrap();
            s.materials.insert("crimson".to_string(), red);
            s.objects[0].material = "crimson".to_string();
        }));
        // What does not shine may be anywhere, or nowhere.
        assert!(serves(|s| s.lights[1].intensity = 9.0));
        assert!(serves(|s| s.lights[1].point.as_mut().unwrap().position[0] = 5.0));
        assert!(serves(|s| s.lights.truncate(s.lights.len() - 1)));
        assert!(serves(|s| s.lights.clear()));
        assert!(serves(|s| {
            s.lights[0].on = false;
            s.lights[0].point.as_mut().unwrap().position[0] = 5.0;
        }));
    }

    #[test]
    fn other_scenes_need_samples_of_their_own() {
        let scene = scene(LIGHTS);
        let groups = LightGroups::new(&scene, true, true);
        let serves = |change: fn(&mut Scene)| serves(&groups, &scene, change);
        assert!(!serves(|s| s.lights[1].on = true));
        assert!(!serves(|s| s.background.color = Color::WHITE));
        assert!(!serves(|s| s.lights[0].point.as_mut().unwrap().position[0] = 5.0));
        assert!(!serves(|s| s.lights[0].falloff = crate::light::Falloff::InverseSquare));
        assert!(!serves(|s| s.lights.push(s.lights[0].clone())));
        assert!(!serves(|s| s.camera.eye[0] += 0.5));
        assert!(!serves(|s| s.film.size = [641, 480]));
        assert!(!serves(|s| s.trace.max_depth = 3));
        assert!(!serves(|s| s.materials.get_mut("red").unwrap().ambient = 0.5));
        assert!(!serves(|s| s.objects[0].material = "spare".to_string()));
        assert!(!serves(|s| s.objects.push(s.objects[0].clone())));
    }

    #[test]
    fn without_surfaces_that_answer_them_lights_do_not_matter() {
        let scene = scene(LIGHTS);
        let groups = LightGroups::new(&scene, false, false);
        assert!(serves(&groups, &scene, |s| s.lights[1].on = true));
        assert!(serves(&groups, &scene, |s| s.lights.push(s.lights[0].clone())));
        assert!(serves(&groups, &scene, |s| s.ambient.color = Color::WHITE));
        // The group of a black picture stands for no background.
        assert_eq!(groups.members, [LightGroupSource::Background]);
        assert!(!serves(&groups, &scene, |s| s.background.color = Color::WHITE));
    }

    #[test]
    fn lights_that_share_a_group_keep_their_strength() {
        let lamp = "[[light]]\npoint = { position = [0.0, 3.0, 0.0] }\n";
        let scene = scene(&lamp.repeat(MAX_LIGHT_GROUPS + 2));
        let groups = LightGroups::new(&scene, true, false);
        let own = MAX_LIGHT_GROUPS - 1;
        assert_eq!(groups.members[own], LightGroupSource::Shared((own..own + 3).collect()));
        assert!(serves(&groups, &scene, |s| s.lights[own - 1].intensity = 3.0));
        assert!(!serves(&groups, &scene, |s| s.lights[own].intensity = 3.0));
        assert!(!serves(&groups, &scene, |s| s.lights[own + 1].on = false));
        assert!(!serves(&groups, &scene, |s| s.lights.truncate(s.lights.len() - 1)));
    }
}
