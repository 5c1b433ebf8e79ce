//! Settings of the whole picture: film, integrator, background, ambient light.

use crate::primitive::Acceleration;
use crate::value::{Color, Description, Field, FieldValue, ValidationError, ValueType};
use crate::value::{choices, description};

description! {
    /// Film settings: size, pixel filter, sample limit of glossy pixels.
    pub struct FilmSettings: Default {
        /// Width and height of the picture.
        size: [u32; 2] = [640, 480], in closed(1.0, 16384.0) "pixels";
        /// Distribution of samples over a pixel.
        filter: Filter = "box";
        /// Largest number of samples per pixel spent on glossy pictures; 0 is no cap.
        rays_per_pixel: u32 = 0, in closed(0.0, 1e9) "samples";
    }
}

choices! {
    /// Distribution of samples over a pixel.
    pub enum Filter {
        /// uniform over the pixel's square
        Box = "box",
        /// all at the pixel's centre: no anti-aliasing
        Point = "point",
    }
}

description! {
    /// Integrator settings, the table `[trace]`.
    pub struct IntegratorSettings: Default {
        /// Kinds of rays that are traced.
        ray_types: RayTypes = "full";
        /// Largest number of surfaces that a path hits after the first, or after a diffuse bounce;
        /// 0: no reflection, no transmission.
        max_depth: u32 = 16, in closed(0.0, 10000.0) "surfaces";
        /// Largest number of diffuse bounces of a path; 0: no indirect diffuse light. Ambient light
        /// stands for further bounces.
        max_diffuse_depth: u32 = 0, in closed(0.0, 100.0) "bounces";
        /// Mirrors reflect and glass transmits after a diffuse bounce, too; false leaves this light
        /// out.
        caustics: bool = true;
        /// Paths whose throughput is smaller end.
        min_throughput: f64 = 0.0, in SHARE;
        /// Treatment of sampled reflections below the surface's horizon.
        below_horizon: BelowHorizon = "fold";
        /// Acceleration structure. Every choice renders the same image; only speed differs.
        acceleration: Acceleration = "auto";
    }
}

choices! {
    /// Kinds of rays that are traced.
    #[derive(PartialOrd, Ord)]
    pub enum RayTypes {
        /// camera rays only: no shadows, no reflections
        Primary = "primary",
        /// camera rays and shadow rays
        Shadows = "shadows",
        /// camera, shadow, reflected and transmitted rays
        Full = "full",
    }
}

choices! {
    /// Treatment of sampled reflections below the surface's horizon.
    pub enum BelowHorizon {
        /// mirrored at the surface: no light is lost
        Fold = "fold",
        /// dropped: its light is lost
        Absorb = "absorb",
    }
}

description! {
    /// Radiance of rays that hit no surface.
    pub struct Background: Default {
        /// Radiance of rays that hit no surface.
        color: Color = [0.0, 0.0, 0.0], in LIGHT "radiance";
    }
}

description! {
    /// Ambient light: uniform, without shadows.
    pub struct Ambient: Default {
        /// Ambient light from all directions, without shadows: i_a of k_a i_a.
        color: Color = [0.0, 0.0, 0.0], in LIGHT "radiance";
    }
}

impl FieldValue for Acceleration {
    type Written = &'static str;
    const TYPE: ValueType = ValueType::Choice(Self::CHOICES);

    fn from_written(written: &'static str) -> Self {
        let named = |choice: &Self| choice.name() == written;
        Self::ALL.into_iter().find(named).unwrap_or_default()
    }

    fn errors(&self, _: &Field) -> Vec<ValidationError> {
        Vec::new()
    }
}

/// Keys of `[film]`.
pub const FILM_FIELDS: &[Field] = FilmSettings::FIELDS;
/// Keys of `[trace]`.
pub const TRACE_FIELDS: &[Field] = IntegratorSettings::FIELDS;
/// Keys of `[background]`.
pub const BACKGROUND_FIELDS: &[Field] = Background::FIELDS;
/// Keys of `[ambient]`.
pub const AMBIENT_FIELDS: &[Field] = Ambient::FIELDS;

impl FilmSettings {
    /// Returns the validation errors of the film settings.
    pub fn faults(&self) -> Vec<ValidationError> {
        self.validator().errors()
    }
}

impl IntegratorSettings {
    /// Returns the validation errors of the integrator settings.
    pub fn faults(&self) -> Vec<ValidationError> {
        self.validator().errors()
    }
}

impl Background {
    /// Returns the validation errors of the background settings.
    pub fn faults(&self) -> Vec<ValidationError> {
        self.validator().errors()
    }
}

impl Ambient {
    /// Returns the validation errors of the ambient light settings.
    pub fn faults(&self) -> Vec<ValidationError> {
        self.validator().errors()
    }
}
