//! Physical properties that the tests demand of each reflection model.

use crate::harness::*;

/// Energy balance of a reflection model at coefficient 1 and reflectance 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Energy {
    /// The albedo is 1 at every angle, if directions below the horizon are mirrored up.
    Conserving,
    /// The albedo is at most 1: multiple scattering between microfacets is lost.
    Losing,
    /// The albedo may exceed 1.
    Unbounded,
}

/// Physical properties of a reflection model that tests check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BsdfProperties {
    /// `true` if f(light, view) = f(view, light).
    pub reciprocal: bool,
    /// Energy balance of the model: whether its albedo is 1, at most 1, or unbounded.
    pub energy: Energy,
}

pub trait ReflectionModel {
    /// Returns the properties of reflection by this model.
    fn properties(self) -> BsdfProperties;
}

impl ReflectionModel for Lobe {
    // The lobes `cone` and `square` are uniform about the mirror direction, so that their density
    // is symmetric in light and view. The BSDF is this density divided by the cosine of the angle
    // between normal and light; it is therefore not symmetric.
    fn properties(self) -> BsdfProperties {
        match self {
            Self::Mirror => BsdfProperties { reciprocal: true, energy: Energy::Conserving },
            Self::Cone | Self::Square => {
                BsdfProperties { reciprocal: false, energy: Energy::Conserving }
            }
            Self::Beckmann | Self::Ggx => {
                BsdfProperties { reciprocal: true, energy: Energy::Losing }
            }
        }
    }
}

impl ReflectionModel for Highlight {
    fn properties(self) -> BsdfProperties {
        match self {
            Self::Phong => BsdfProperties { reciprocal: false, energy: Energy::Unbounded },
            Self::CookTorrance => BsdfProperties { reciprocal: true, energy: Energy::Losing },
        }
    }
}

/// Returns the properties of a transparent surface in the Fresnel mode `fresnel`, for reflection
/// and transmission together.
pub fn transmission_properties(fresnel: Fresnel) -> BsdfProperties {
    match fresnel {
        Fresnel::Dielectric => BsdfProperties { reciprocal: true, energy: Energy::Conserving },
        // In all other modes k_r and k_t are independent, and surfaces do not reflect on their
        // inner sides.
        _ => BsdfProperties { reciprocal: false, energy: Energy::Unbounded },
    }
}
