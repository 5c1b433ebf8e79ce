//! Light from a sphere. Points inside it are lit from all sides.

use crate::light::{EmissiveSurface, Handles, LightDesc, LightForm, Placement, registry};
use crate::value::description;
use glam::DVec3;

description! {
    /// Light from a sphere, such as a bulb: soft shadows.
    pub struct SphereLight: Copy {
        /// Centre of the sphere.
        center: [f64; 3], in COORDINATE "scene units";
        /// Radius of the sphere.
        radius: f64, in SIZE "scene units";
    }
}

impl LightDesc for SphereLight {
    fn form(&self) -> LightForm<'_> {
        let Self { center, radius } = *self;
        LightForm::Surface(EmissiveSurface::Sphere { center: DVec3::from(center), radius })
    }

    fn handles(&mut self) -> Handles<'_> {
        Handles { position: Some(&mut self.center), ..Handles::default() }
    }

    fn place(&mut self, placement: &Placement) {
        (self.center, self.radius) = registry::rounded_ball(placement);
    }
}
