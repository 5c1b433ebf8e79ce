//! Settings of the whole picture: film, integrator, background, ambient light.

use crate::primitive::Acceleration;
use crate::value::{Choice, Color, Field, NumberRange, ValidationError, Validator, ValueType};
use serde::{Deserialize, Serialize};

/// Film settings: size, pixel filter, sample limit of glossy pixels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FilmSettings {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Pixel filter.
    pub filter: Filter,
    /// Largest number of samples per pixel spent on glossy pictures; 0 is no cap.
    pub rays_per_pixel: u32,
}

/// Pixel filter: distribution of samples over a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Filter {
    /// Uniform over the pixel's square.
    Box,
    /// All samples at the pixel's centre, without anti-aliasing.
    Point,
}

/// Integrator settings, the table `[trace]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IntegratorSettings {
    /// Kinds of rays that are traced.
    pub ray_types: RayTypes,
    /// Largest number of surfaces that a path hits after the first; 0 disables reflection and
    /// transmission.
    pub max_depth: u32,
    /// Paths with a smaller throughput end.
    pub min_throughput: f64,
    /// Treatment of sampled reflections below the surface's horizon.
    pub below_horizon: BelowHorizon,
    /// Acceleration structure. Every choice renders the same image; only speed differs.
    pub acceleration: Acceleration,
}

/// Kinds of rays that are traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RayTypes {
    /// Camera rays only, without shadows and reflections.
    Primary,
    /// Camera rays and shadow rays.
    Shadows,
    /// Camera, shadow, reflected and transmitted rays.
    Full,
}

/// Treatment of sampled reflections below the surface's horizon.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BelowHorizon {
    /// Mirrored at the surface, which conserves energy.
    Fold,
    /// Dropped, which loses energy.
    Absorb,
}

/// Radiance of rays that hit no surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Background {
    /// Radiance.
    pub color: Color,
}

/// Ambient light: uniform, without shadows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ambient {
    /// Intensity i_a in k_a i_a.
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

/// Largest number of pixels: 8192 x 8192.
pub const MAX_PIXELS: u64 = 1 << 26;

/// Keys of `[film]`.
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
            Choice { name: "box", doc: "uniform over the pixel's square" },
            Choice { name: "point", doc: "all at the pixel's centre: no anti-aliasing" },
        ]),
        "",
        "\"box\"",
        "Distribution of samples over a pixel.",
    ),
    Field::preset(
        "rays_per_pixel",
        ValueType::Whole(NumberRange::closed(0.0, 1e9)),
        "samples",
        "0",
        "Largest number of samples per pixel spent on glossy pictures; 0 is no cap.",
    ),
];

/// Keys of `[trace]`.
pub const TRACE_FIELDS: &[Field] = &[
    Field::preset(
        "ray_types",
        ValueType::Choice(&[
            Choice { name: "primary", doc: "camera rays only: no shadows, no reflections" },
            Choice { name: "shadows", doc: "camera rays and shadow rays" },
            Choice { name: "full", doc: "camera, shadow, reflected and transmitted rays" },
        ]),
        "",
        "\"full\"",
        "Kinds of rays that are traced.",
    ),
    Field::preset(
        "max_depth",
        ValueType::Whole(NumberRange::closed(0.0, 10000.0)),
        "surfaces",
        "16",
        "Largest number of surfaces that a path hits after the first; 0: no reflection, no transmission.",
    ),
    Field::preset(
        "min_throughput",
        ValueType::Number(NumberRange::SHARE),
        "",
        "0.0",
        "Paths whose throughput is smaller end.",
    ),
    Field::preset(
        "below_horizon",
        ValueType::Choice(&[
            Choice { name: "fold", doc: "mirrored at the surface: no light is lost" },
            Choice { name: "absorb", doc: "dropped: its light is lost" },
        ]),
        "",
        "\"fold\"",
        "Treatment of sampled reflections below the surface's horizon.",
    ),
    Field::preset(
        "acceleration",
        ValueType::Choice(Acceleration::CHOICES),
        "",
        "\"auto\"",
        "Acceleration structure. Every choice renders the same image; only speed differs.",
    ),
];

/// Keys of `[background]`.
pub const BACKGROUND_FIELDS: &[Field] = &[Field::preset(
    "color",
    ValueType::Color(NumberRange::LIGHT),
    "radiance",
    "[0.0, 0.0, 0.0]",
    "Radiance of rays that hit no surface.",
)];

/// Keys of `[ambient]`.
pub const AMBIENT_FIELDS: &[Field] = &[Field::preset(
    "color",
    ValueType::Color(NumberRange::LIGHT),
    "radiance",
    "[0.0, 0.0, 0.0]",
    "Light from everywhere, without shadows: i_a of k_a i_a.",
)];

impl FilmSettings {
    /// Returns the errors in the film settings.
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
    /// Returns the errors in the integrator settings.
    pub fn faults(&self) -> Vec<ValidationError> {
        Validator::new(TRACE_FIELDS)
            .numbers("max_depth", &[f64::from(self.max_depth)])
            .numbers("min_throughput", &[self.min_throughput])
            .validate()
    }
}

impl Background {
    /// Returns the errors in the background.
    pub fn faults(&self) -> Vec<ValidationError> {
        Validator::new(BACKGROUND_FIELDS).numbers("color", &self.color.0).validate()
    }
}

impl Ambient {
    /// Returns the errors in the ambient light.
    pub fn faults(&self) -> Vec<ValidationError> {
        Validator::new(AMBIENT_FIELDS).numbers("color", &self.color.0).validate()
    }
}
