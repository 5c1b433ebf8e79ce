//! What holds for the whole picture: raster, tracing, background, ambient light.

use crate::primitive::Acceleration;
use crate::value::{Color, Description, Field, FieldValue, ValidationError, ValueType};
use crate::value::{choices, description};

description! {
    /// The picture's raster.
    pub struct FilmSettings: Default {
        /// Width and height of the picture; together at most 67108864 pixels.
        size: [u32; 2] = [640, 480], in closed(1.0, 16384.0) "pixels";
        /// How samples spread over a pixel.
        filter: Filter = "box";
        /// Largest number of samples per pixel spent on glossy pictures; 0 is no cap.
        rays_per_pixel: u32 = 0, in closed(0.0, 1e9) "samples";
    }
}

choices! {
    /// Distribution of samples over a pixel.
    pub enum Filter {
        /// evenly over the pixel's square
        Box = "box",
        /// all in its centre: no anti-aliasing
        Point = "point",
    }
}

description! {
    /// How far paths are followed.
    pub struct IntegratorSettings: Default {
        /// What is traced at all.
        ray_types: RayTypes = "full";
        /// The most surfaces that a path meets after the first; 0: no reflection, no transmission.
        max_depth: u32 = 16, in closed(0.0, 10000.0) "surfaces";
        /// A path ends when what it could still add is weighted by less than this.
        min_throughput: f64 = 0.0, in SHARE;
        /// What becomes of a reflected ray that would dip under the surface.
        below_horizon: BelowHorizon = "fold";
        /// How rays are kept from things that they cannot meet. It changes the time, never the picture.
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
        /// everything
        Full = "full",
    }
}

choices! {
    /// Treatment of a reflected ray that would dip under the surface.
    pub enum BelowHorizon {
        /// it is mirrored at the surface: no light is lost
        Fold = "fold",
        /// it is lost
        Absorb = "absorb",
    }
}

description! {
    /// What a ray sees that meets nothing.
    pub struct Background: Default {
        /// What a ray sees that meets nothing.
        color: Color = [0.0, 0.0, 0.0], in LIGHT "radiance";
    }
}

description! {
    /// Light from everywhere, without shadows.
    pub struct Ambient: Default {
        /// Light from everywhere, without shadows: i_a of k_a i_a.
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

/// The most pixels of a picture: 8192 x 8192.
pub const MAX_PIXELS: u64 = 1 << 26;

/// The keys of `[film]`.
pub const FILM_FIELDS: &[Field] = FilmSettings::FIELDS;
/// The keys of `[trace]`.
pub const TRACE_FIELDS: &[Field] = IntegratorSettings::FIELDS;
/// The keys of `[background]`.
pub const BACKGROUND_FIELDS: &[Field] = Background::FIELDS;
/// The keys of `[ambient]`.
pub const AMBIENT_FIELDS: &[Field] = Ambient::FIELDS;

impl FilmSettings {
    /// What is wrong with it.
    pub fn faults(&self) -> Vec<ValidationError> {
        let [width, height] = self.size;
        let errors = self.validator().errors();
        let pixels = u64::from(width) * u64::from(height);
        let too_many = (errors.iter().all(|error| error.key != "size") && pixels > MAX_PIXELS)
            .then(|| {
                ValidationError::new(
                    "size",
                    format!("size is [{width}, {height}], {pixels} pixels"),
                    format!("at most {MAX_PIXELS} pixels, such as [8192, 8192]"),
                )
            });
        errors.into_iter().chain(too_many).collect()
    }
}

impl IntegratorSettings {
    /// What is wrong with it.
    pub fn faults(&self) -> Vec<ValidationError> {
        self.validator().errors()
    }
}

impl Background {
    /// What is wrong with it.
    pub fn faults(&self) -> Vec<ValidationError> {
        self.validator().errors()
    }
}

impl Ambient {
    /// What is wrong with it.
    pub fn faults(&self) -> Vec<ValidationError> {
        self.validator().errors()
    }
}
