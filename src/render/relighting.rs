//! Relighting: light weights with which a film shows scenes that differ only in their light groups.

use crate::film::LightWeights;
use crate::scene::Scene;
use crate::world::LightGroups;
use std::sync::Arc;

/// Light groups of a film and the scene that they were compiled for.
#[derive(Clone, Debug)]
pub struct Relighting {
    compiled: Arc<Scene>,
    groups: LightGroups,
}

impl Relighting {
    /// Creates the relighting of a film whose scene `compiled` has the light groups `groups`.
    pub fn new(compiled: Arc<Scene>, groups: LightGroups) -> Self {
        Self { compiled, groups }
    }

    /// Light weights with which the film shows `scene`. `None` if the scene needs samples of its own: it
    /// differs in more than colours, intensities and switches of lights, ambient and background that have
    /// groups of their own.
    pub fn mix(&self, scene: &Scene) -> Option<LightWeights> {
        let can_reuse =
            std::ptr::eq(scene, &*self.compiled) || self.groups.can_reuse(&self.compiled, scene);
        can_reuse.then(|| LightWeights { weights: self.groups.mix(scene) })
    }

    /// Name of each group, for layers of files; `scene` is one that the film can show.
    pub fn names(&self, scene: &Scene) -> Vec<String> {
        self.groups.names(scene)
    }
}
