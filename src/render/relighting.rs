//! Which scenes a film serves, and how its light groups are mixed for each: enough to show a change of
//! light without the renderer.

use crate::film::LightWeights;
use crate::scene::Scene;
use crate::world::LightGroups;
use std::sync::Arc;

/// The light groups of a film and the scene that they were compiled for.
#[derive(Clone, Debug)]
pub struct Relighting {
    compiled: Arc<Scene>,
    groups: LightGroups,
}

impl Relighting {
    /// `groups` as compiled for the scene.
    pub fn new(compiled: Arc<Scene>, groups: LightGroups) -> Self {
        Self { compiled, groups }
    }

    /// The mix in which the film shows `scene`; `None`: it needs samples of its own, because it
    /// differs in more than colours, intensities and switches of lights, ambient and background that
    /// have groups of their own.
    pub fn mix(&self, scene: &Scene) -> Option<LightWeights> {
        let serves =
            std::ptr::eq(scene, &*self.compiled) || self.groups.can_reuse(&self.compiled, scene);
        serves.then(|| LightWeights { weights: self.groups.mix(scene) })
    }

    /// A name for each group, for layers of files; `scene` is one that the film serves.
    pub fn names(&self, scene: &Scene) -> Vec<String> {
        self.groups.names(scene)
    }
}
