//! What holds for the whole picture: raster, tracing, background, ambient light.

use crate::primitive::Acceleration;
use crate::value::{Choice, Color, Field, NumberRange, ValidationError, Validator, ValueType};
use serde::{Deserialize, Serialize};

/// The picture's raster.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FilmSettings {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// How samples spread over a pixel.
    pub filter: Filter,
    /// Largest number of samples per pixel spent on glossy pictures; 0 is no cap.
    pub rays_per_pixel: u32,
}

/// How samples spread over a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Filter {
    /// Evenly over the pixel's square.
    Box,
    /// All in its centre: no anti-aliasing.
    Point,
}

/// How far paths are followed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IntegratorSettings {
    /// Kinds of rays that are traced.
    pub ray_types: RayTypes,
    /// The most surfaces that a path meets after the first: 0 is no reflection and no transmission.
    pub max_depth: u32,
    /// A path ends when what it could still add is weighted by less than this.
    pub min_throughput: f64,
    /// What becomes of a reflected ray that would dip under the surface.
    pub below_horizon: BelowHorizon,
    /// How rays are kept from things that they cannot meet.
    pub acceleration: Acceleration,
}

/// What is traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RayTypes {
    /// Camera rays only: no shadows, no reflections.
    Primary,
    /// Camera rays and shadow rays.
    Shadows,
    /// Everything.
    Full,
}

/// What becomes of a reflected ray that would dip under the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BelowHorizon {
    /// It is mirrored at the surface: no light is lost.
    Fold,
    /// It is lost.
    Absorb,
}

/// What a ray sees that meets nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Background {
    /// Radiance.
    pub color: Color,
}

/// Light from everywhere, without shadows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ambient {
    /// i_a of k_a i_a.
    pub color: Color,
}

impl Default for FilmSettings {
    fn default() -> Self {
        Self { size: [640, 480], filter: Filter::Box, rays_per_pixel: 0 }
    }
}

impl Default for IntegratorSettings {
    fn default() -> Self {
        Self {
            ray_types: RayTypes::Full,
            max_depth: 16,
            min_throughput: 0.0,
            below_horizon: BelowHorizon::Fold,
            acceleration: Acceleration::Auto,
        }
    }
}

impl Default for Background {
    fn default() -> Self {
        Self { color: Color::BLACK }
    }
}

impl Default for Ambient {
    fn default() -> Self {
        Self { color: Color::BLACK }
    }
}

/// The most pixels of a picture: 8192 x 8192.
pub const MAX_PIXELS: u64 = 1 << 26;

/// The keys of `[film]`.
pub const FILM_FIELDS: &[Field] = &[
    Field::preset(
        "size",
        ValueType::Wholes(2, NumberRange::closed(1.0, 16384.0)),
        "pixels",
        "[640, 480]",
        "Width and height of the picture; together at most 67108864 pixels.",
    ),
    Field::preset(
        "filter",
        ValueType::Choice(&[
            Choice { name: "box", doc: "evenly over the pixel's square" },
            Choice { name: "point", doc: "all in its centre: no anti-aliasing" },
        ]),
        "",
        "\"box\"",
        "How samples spread over a pixel.",
    ),
    Field::preset(
        "rays_per_pixel",
        ValueType::Whole(NumberRange::closed(0.0, 1e9)),
        "samples",
        "0",
        "Largest number of samples per pixel spent on glossy pictures; 0 is no cap.",
    ),
];

/// The keys of `[trace]`.
pub const TRACE_FIELDS: &[Field] = &[
    Field::preset(
        "ray_types",
        ValueType::Choice(&[
            Choice { name: "primary", doc: "camera rays only: no shadows, no reflections" },
            Choice { name: "shadows", doc: "camera rays and shadow rays" },
            Choice { name: "full", doc: "everything" },
        ]),
        "",
        "\"full\"",
        "What is traced at all.",
    ),
    Field::preset(
        "max_depth",
        ValueType::Whole(NumberRange::closed(0.0, 10000.0)),
        "surfaces",
        "16",
        "The most surfaces that a path meets after the first; 0: no reflection, no transmission.",
    ),
    Field::preset(
        "min_throughput",
        ValueType::Number(NumberRange::SHARE),
        "",
        "0.0",
        "A path ends when what it could still add is weighted by less than this.",
    ),
    Field::preset(
        "below_horizon",
        ValueType::Choice(&[
            Choice { name: "fold", doc: "it is mirrored at the surface: no light is lost" },
            Choice { name: "absorb", doc: "it is lost" },
        ]),
        "",
        "\"fold\"",
        "What becomes of a reflected ray that would dip under the surface.",
    ),
    Field::preset(
        "acceleration",
        ValueType::Choice(Acceleration::CHOICES),
        "",
        "\"auto\"",
        "How rays are kept from things that they cannot meet. It changes the time, never the picture.",
    ),
];

/// The keys of `[background]`.
pub const BACKGROUND_FIELDS: &[Field] = &[Field::preset(
    "color",
    ValueType::Color(NumberRange::LIGHT),
    "radiance",
    "[0.0, 0.0, 0.0]",
    "What a ray sees that meets nothing.",
)];

/// The keys of `[ambient]`.
pub const AMBIENT_FIELDS: &[Field] = &[Field::preset(
    "color",
    ValueType::Color(NumberRange::LIGHT),
    "radiance",
    "[0.0, 0.0, 0.0]",
    "Light from everywhere, without shadows: i_a of k_a i_a.",
)];

impl FilmSettings {
    /// What is wrong with it.
    pub fn faults(&self) -> Vec<ValidationError> {
        let [width, height] = self.size;
        let checks =
            Validator::new(FILM_FIELDS).numbers("size", &[f64::from(width), f64::from(height)]);
        let pixels = u64::from(width) * u64::from(height);
        let too_many = (checks.clean() && pixels > MAX_PIXELS).then(|| {
            ValidationError::new(
                "size",
                format!("size is [{width}, {height}], {pixels} pixels"),
                format!("at most {MAX_PIXELS} pixels, such as [8192, 8192]"),
            )
        });
        checks.and(too_many).numbers("rays_per_pixel", &[f64::from(self.rays_per_pixel)]).validate()
    }
}

impl IntegratorSettings {
    /// What is wrong with it.
    pub fn faults(&self) -> Vec<ValidationError> {
        Validator::new(TRACE_FIELDS)
            .numbers("max_depth", &[f64::from(self.max_depth)])
            .numbers("min_throughput", &[self.min_throughput])
            .validate()
    }
}

impl Background {
    /// What is wrong with it.
    pub fn faults(&self) -> Vec<ValidationError> {
        Validator::new(BACKGROUND_FIELDS).numbers("color", &self.color.0).validate()
    }
}

impl Ambient {
    /// What is wrong with it.
    pub fn faults(&self) -> Vec<ValidationError> {
        Validator::new(AMBIENT_FIELDS).numbers("color", &self.color.0).validate()
    }
}
