//! Directional light.

use crate::light::{Handles, LightDesc, LightForm, Placement};
use crate::value::{description, unit};
use glam::DVec3;

description! {
    /// Light from infinitely far away.
    pub struct Directional: Copy {
        /// Direction in which the light travels.
        direction: [f64; 3], as Direction;
    }
}

impl Directional {
    /// Creates parallel rays in the given direction.
    pub fn along(direction: [f64; 3]) -> Self {
        Self { direction }
    }
}

impl LightDesc for Directional {
    fn form(&self) -> LightForm<'_> {
        LightForm::Distant { wi: -unit(self.direction).unwrap_or(DVec3::NEG_Y) }
    }

    fn handles(&mut self) -> Handles<'_> {
        Handles { direction: Some(&mut self.direction), ..Handles::default() }
    }

    fn placed(placement: &Placement) -> Self {
        Self::along(placement.direction)
    }
}
