//! Light groups that users name.
//! ```toml
//! groups."stage left" = { intensity = 0.5 }
//! light = [{ group = "stage left", point.position = [-2, 3, 0] }]
//! ```

use crate::value::{Color, description};

description! {
    /// Mix of a light group: the lights and emissive materials whose `group` is its name. The mix
    /// of a scene in progress changes without new samples.
    pub struct LightGroup {
        /// Colour, by which the light of the group is multiplied.
        color: Color = [1.0, 1.0, 1.0], in LIGHT;
        /// Factor of the light of the group.
        intensity: f64 = 1.0, in LIGHT;
        /// `false` switches the group off.
        on: bool = true;
    }
}

impl LightGroup {
    /// Returns the factor of the light of the group in each channel.
    pub fn factor(&self) -> [f64; 3] {
        if self.on { self.color.scaled(self.intensity).0 } else { [0.0; 3] }
    }
}
