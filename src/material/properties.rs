//! What each model of reflection promises, so that tests can hold it to that.

use crate::material::{Fresnel, Highlight, Lobe};

/// How much of the light that a model gets it gives back, at coefficient 1 and reflectance 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Energy {
    /// All of it, at every angle (with lobes folded at the horizon).
    Conserving,
    /// At most all of it: what would bounce between microfacets is lost.
    Losing,
    /// Perhaps more than it gets.
    Unbounded,
}

/// What a model of reflection promises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BsdfProperties {
    /// f(light, view) = f(view, light).
    pub reciprocal: bool,
    /// Whether light may be lost or won.
    pub energy: Energy,
}

impl BsdfProperties {
    /// The claims of the diffuse part, Lambert's law f = albedo / pi: the only model without a name
    /// in scene files.
    pub const LAMBERT: Self = Self { reciprocal: true, energy: Energy::Conserving };
}

impl Lobe {
    /// What the reflection by this lobe promises.
    ///
    /// Cone and square spread light evenly about the mirror direction: the density is symmetric, so
    /// that f = density / cos of the light is not.
    pub fn claims(self) -> BsdfProperties {
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

impl Highlight {
    /// What the formula promises.
    pub fn claims(self) -> BsdfProperties {
        match self {
            Self::Phong => BsdfProperties { reciprocal: false, energy: Energy::Unbounded },
            Self::CookTorrance => BsdfProperties { reciprocal: true, energy: Energy::Losing },
        }
    }
}

impl Fresnel {
    /// What a transparent surface with this law promises of what it reflects and transmits together.
    pub fn claims_of_transmission(self) -> BsdfProperties {
        match self {
            Self::Dielectric => BsdfProperties { reciprocal: true, energy: Energy::Conserving },
            // k_r and k_t are not weighted against each other; inner sides do not reflect.
            _ => BsdfProperties { reciprocal: false, energy: Energy::Unbounded },
        }
    }
}
