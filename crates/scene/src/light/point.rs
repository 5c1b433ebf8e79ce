//! Point light.

use crate::light::{Handles, LightDesc, LightForm, Placement};
use crate::value::description;
use glam::DVec3;

description! {
    /// Light from one point, such as a lamp.
    pub struct Point: Copy {
        /// Position of the light.
        position: [f64; 3], in COORDINATE "scene units";
    }
}

impl LightDesc for Point {
    fn form(&self) -> LightForm<'_> {
        LightForm::Point { position: DVec3::from(self.position), cone: None }
    }

    fn handles(&mut self) -> Handles<'_> {
        Handles { position: Some(&mut self.position), ..Handles::default() }
    }

    fn place(&mut self, placement: &Placement) {
        self.position = placement.position;
    }
}
