//! Relighting: shows the samples of one scene under the lights of another scene. A film stores the
//! light of each light group separately; relighting changes the weights of these groups.

use crate::film::LightWeights;
use std::sync::Arc;
use zerkalo_scene::Scene;
use zerkalo_world::LightGroups;

/// Light groups of a film (lights that share one weight), and the scene for which the film's
/// samples were traced.
#[derive(Clone, Debug)]
pub struct Relighting {
    compiled: Arc<Scene>,
    groups: LightGroups,
}

impl Relighting {
    /// Creates the relighting of a film whose samples belong to the scene `compiled` with the light
    /// groups `groups`.
    pub fn new(compiled: Arc<Scene>, groups: LightGroups) -> Self {
        Self { compiled, groups }
    }

    /// Returns the scene for which the samples were traced.
    pub fn compiled(&self) -> &Arc<Scene> {
        &self.compiled
    }

    /// Returns the light weights with which the film shows `scene`. Returns `None` if `scene` needs
    /// new samples, because it differs from the compiled scene in more than the colours,
    /// intensities and on/off switches of sources that have light groups of their own.
    pub fn mix(&self, scene: &Scene) -> Option<LightWeights> {
        let can_reuse =
            std::ptr::eq(scene, &*self.compiled) || self.groups.can_reuse(&self.compiled, scene);
        can_reuse.then(|| LightWeights { weights: self.groups.mix(scene) })
    }
}
