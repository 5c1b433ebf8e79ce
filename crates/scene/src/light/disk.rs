//! Light from a disk.

use crate::light::{
    EmissiveSurface, Handles, LightDesc, LightForm, Placement, rectangle, registry,
};
use crate::value::description;
use glam::DVec3;

description! {
    /// Light from one side of a disk.
    pub struct DiskLight: Copy {
        /// Centre of the disk.
        center: [f64; 3], in COORDINATE "scene units";
        /// Radius of the disk.
        radius: f64, in SIZE "scene units";
        /// Direction that the emitting side faces.
        normal: [f64; 3], as Direction;
    }
}

impl LightDesc for DiskLight {
    fn form(&self) -> LightForm<'_> {
        let Self { center, radius, normal } = *self;
        let axes = rectangle::frame(normal, [0.0, 1.0, 0.0]);
        LightForm::Surface(EmissiveSurface::Disk { center: DVec3::from(center), axes, radius })
    }

    fn handles(&mut self) -> Handles<'_> {
        Handles {
            position: Some(&mut self.center),
            direction: Some(&mut self.normal),
            ..Handles::default()
        }
    }

    fn place(&mut self, placement: &Placement) {
        (self.center, self.radius) = registry::rounded_ball(placement);
        self.normal = placement.direction;
    }
}
