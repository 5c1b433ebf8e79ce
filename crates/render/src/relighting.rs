//! Relighting: shows the samples of one scene under the light weights of another scene.

use crate::film::LightWeights;
use std::sync::Arc;
use zerkalo_scene::Scene;
use zerkalo_world::LightGroups;

/// Light groups of a film, and the scene for which its samples were traced.
#[derive(Clone, Debug)]
pub struct Relighting {
    pub compiled: Arc<Scene>,
    pub groups: LightGroups,
}

impl Relighting {
    /// Returns the light weights with which the film shows `scene`. Returns `None` if `scene` needs
    /// new samples, as [`LightGroups::can_reuse`] decides.
    pub fn weights(&self, scene: &Scene) -> Option<LightWeights> {
        let can_reuse =
            std::ptr::eq(scene, &*self.compiled) || self.groups.can_reuse(&self.compiled, scene);
        can_reuse.then(|| LightWeights { weights: self.groups.weights(scene) })
    }
}
