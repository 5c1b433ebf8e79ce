//! Compilation of lights for the kernels.

use crate::light::{
    DeltaLight, EmissiveSurface, Emitter, EnvironmentLight, Falloff, Light, LightForm, SpotCone,
};
use glam::DVec3;
use zerkalo_kernel::lanes::Float;

/// Light that is compiled for the kernels, white and of intensity 1. Colour and intensity are
/// applied later, by the weight of the light's group.
pub enum CompiledLight<S> {
    /// Light without a size.
    Delta(DeltaLight<S>),
    /// Light with a size.
    Emitter(Emitter<S>),
    /// Environment light.
    Environment(EnvironmentLight),
}

impl Light {
    /// Compiles the light, which must be valid. Positions become relative to `origin`, the scene's
    /// centre. `lift` returns the distance by which a surface is moved off the surfaces that it
    /// touches. Returns `None` if the light has no area, or if its image is not loaded.
    pub fn compile<S: Float>(
        &self,
        origin: DVec3,
        lift: impl FnOnce(&EmissiveSurface) -> f64,
    ) -> Option<CompiledLight<S>> {
        let vector = |v: DVec3| v.to_array().map(S::from_f64);
        Some(match self.form() {
            LightForm::Point { position, cone } => CompiledLight::Delta(DeltaLight::Point {
                position: vector(position - origin),
                inverse_square: self.falloff == Falloff::InverseSquare,
                cone: cone.map(SpotCone::new),
            }),
            LightForm::Distant { wi, radius } if radius > 0.0 => {
                CompiledLight::Emitter(Emitter::distant_disk(wi, radius))
            }
            LightForm::Distant { wi, .. } => {
                CompiledLight::Delta(DeltaLight::Directional { wi: vector(wi) })
            }
            LightForm::Surface(surface) => {
                let lift = lift(&surface);
                CompiledLight::Emitter(Emitter::without_body(surface, self.unit, origin, lift)?)
            }
            LightForm::Environment(environment) => {
                CompiledLight::Environment(EnvironmentLight::new(environment)?)
            }
        })
    }
}
