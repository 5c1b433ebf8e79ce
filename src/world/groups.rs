//! Light groups: parts of the picture that are linear in one light's colour and strength, kept apart
//! so that these can change without new samples.

use crate::lanes::Real;
use crate::light::{Lamp, Light};
use crate::scene::Scene;
use crate::value::Color;
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
pub enum Member {
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
#[derive(Clone, Debug)]
pub struct Groups {
    /// In the order of the film.
    pub members: Vec<Member>,
}

impl Groups {
    /// The groups of `scene`. `lit`: some surface answers lights.
    pub fn new(scene: &Scene, lit: bool, ambient: bool) -> Self {
        let mut members = Vec::new();
        if ambient && scene.ambient.color != Color::BLACK {
            members.push(Member::Ambient);
        }
        if scene.background.color != Color::BLACK {
            members.push(Member::Background);
        }
        let shining: Vec<usize> =
            (0..scene.lights.len()).filter(|i| lit && shines(&scene.lights[*i])).collect();
        let pixels = scene.film.size.iter().map(|n| u64::from(*n)).product::<u64>().max(1);
        let affordable = (FILM_BYTES / (pixels * GROUP_BYTES)) as usize;
        let room = affordable.saturating_sub(members.len()).clamp(1, MAX_LIGHT_GROUPS);
        let (own, shared) =
            shining.split_at(if shining.len() <= room { shining.len() } else { room - 1 });
        members.extend(own.iter().map(|i| Member::Light(*i)));
        if !shared.is_empty() {
            members.push(Member::Shared(shared.to_vec()));
        }
        if members.is_empty() {
            // A black picture is a picture too: it needs one group to hold it.
            members.push(Member::Background);
        }
        Self { members }
    }

    /// Position of a member, if there is such a group.
    pub fn find(&self, wanted: &Member) -> Option<usize> {
        self.members.iter().position(|m| m == wanted)
    }

    /// Each shining light's number with its group and its weight in the samples of that group.
    pub fn lights(&self, scene: &Scene) -> Vec<(usize, usize, [f64; 3])> {
        let mut out = Vec::new();
        for (group, member) in self.members.iter().enumerate() {
            match member {
                Member::Light(i) => out.push((*i, group, [1.0; 3])),
                Member::Shared(list) => {
                    out.extend(list.iter().map(|i| (*i, group, strength(&scene.lights[*i]))));
                }
                Member::Ambient | Member::Background => {}
            }
        }
        out
    }

    /// Weight of each group in the picture of `scene`, which may differ from the compiled one in the
    /// colours, intensities and switches of lights, ambient and background.
    pub fn mix(&self, scene: &Scene) -> Vec<[f64; 3]> {
        let weight = |member: &Member| match member {
            Member::Ambient => scene.ambient.color.0,
            Member::Background => scene.background.color.0,
            Member::Light(i) => scene.lights.get(*i).map_or([0.0; 3], strength),
            Member::Shared(_) => [1.0; 3],
        };
        self.members.iter().map(weight).collect()
    }

    /// A name for each group, for layers of files.
    pub fn names(&self, scene: &Scene) -> Vec<String> {
        let name = |member: &Member| match member {
            Member::Ambient => "ambient".to_string(),
            Member::Background => "background".to_string(),
            Member::Light(i) if scene.lights[*i].name.is_empty() => format!("light {}", i + 1),
            Member::Light(i) => scene.lights[*i].name.clone(),
            Member::Shared(list) => format!("{} lights", list.len()),
        };
        self.members.iter().map(name).collect()
    }

    /// Steps per unit of radiance in the film's integers, a power of two for each group: 2^28 at the
    /// irradiance that the group's light typically gives in this scene. Samples may exceed that
    /// 2^22 times, the sum of a billion such samples still fits 64 bits.
    pub fn scales<S: Real>(&self, scene: &Scene, origin: DVec3, radius: f64) -> Vec<f64> {
        let typical = |i: usize| {
            Lamp::<S>::new(&scene.lights[i], origin)
                .map_or(1.0, |lamp| lamp.typical_irradiance(radius) / std::f64::consts::PI)
        };
        let brightness = |member: &Member| match member {
            Member::Ambient | Member::Background => 1.0,
            Member::Light(i) => typical(*i),
            Member::Shared(list) => list
                .iter()
                .map(|i| typical(*i) * strength(&scene.lights[*i]).into_iter().fold(0.0, f64::max))
                .fold(0.0, f64::max),
        };
        let scale = |member| {
            let exponent = 28.0 - brightness(member).log2().ceil();
            exponent.clamp(-900.0, 900.0).exp2()
        };
        self.members.iter().map(scale).collect()
    }
}

/// Colour times intensity; black if it is off.
fn strength(light: &Light) -> [f64; 3] {
    if light.on { light.color.scaled(light.intensity).0 } else { [0.0; 3] }
}

fn shines(light: &Light) -> bool {
    strength(light) != [0.0; 3]
}
