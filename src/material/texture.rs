//! Textures: what varies over a surface. A texture's colour multiplies the material's; a bump turns the
//! normal that light is computed with.
//!
//! ```toml
//! texture.image = { file = "wood.png", mapping = "box", scale = [2.0, 2.0] }
//! texture.checker = { even = "#ffffff", odd = "#202020" }
//! bump.image = { file = "bricks.png", height = 0.02 }
//! ```

use crate::asset::{AssetError, Image};
use crate::material::texture_fields::{BUMP_FIELDS, CHECKER_FIELDS, IMAGE_FIELDS};
use crate::value::{Color, Field, ValidationError, Validator};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::sync::Arc;

/// What multiplies a material's colour: one kind with its parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Texture {
    /// `texture.image`
    Image(ImageTexture),
    /// `texture.checker`
    Checker(Checker),
}

/// What turns the normals of a surface: one kind with its parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Bump {
    /// `bump.image`
    Image(HeightImage),
}

/// An image, wrapped on the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImageTexture {
    /// Name of the file, as the scene's author wrote it; empty: white.
    pub file: String,
    /// Where coordinates come from.
    pub mapping: Mapping,
    /// The axis of the mapping; without it the shape's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<Axis>,
    /// Repeats per unit of u and v.
    pub scale: [f64; 2],
    /// Added to the scaled coordinates, in repeats.
    pub offset: [f64; 2],
    /// What lies beyond the edges.
    pub wrap: Wrap,
    /// What lies between the pixels.
    pub filter: TextureFilter,
    #[serde(skip)]
    content: Loaded,
}

/// Two colours in squares, two by two a repeat.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Checker {
    /// Colour of the square at u = v = 0.
    pub even: Color,
    /// Colour of its neighbours.
    pub odd: Color,
    /// Where coordinates come from.
    pub mapping: Mapping,
    /// The axis of the mapping; without it the shape's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<Axis>,
    /// Repeats per unit of u and v.
    pub scale: [f64; 2],
    /// Added to the scaled coordinates, in repeats.
    pub offset: [f64; 2],
}

/// Heights from an image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HeightImage {
    /// Name of the file, as the scene's author wrote it; empty: flat.
    pub file: String,
    /// Height of white above black, in lengths of the shape's own space.
    pub height: f64,
    /// Where coordinates come from.
    pub mapping: Mapping,
    /// The axis of the mapping; without it the shape's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<Axis>,
    /// Repeats per unit of u and v.
    pub scale: [f64; 2],
    /// Added to the scaled coordinates, in repeats.
    pub offset: [f64; 2],
    /// What lies beyond the edges.
    pub wrap: Wrap,
    #[serde(skip)]
    content: Loaded,
}

/// Where the coordinates u and v of a texture come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mapping {
    /// As it suits the shape.
    #[default]
    Auto,
    /// Seen along an axis, in lengths.
    Planar,
    /// Around an axis and from pole to pole, each once.
    Spherical,
    /// Around an axis and along it, each once.
    Cylindrical,
    /// Each side as it is seen from outside, in lengths from its lower left corner.
    Box,
    /// Those of a mesh, or from edge to edge of a flat shape.
    Uv,
}

/// An axis of the space that textures lie in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// To the right.
    X,
    /// Up.
    Y,
    /// To the front.
    Z,
}

/// What lies beyond the edges of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// Its outermost pixels.
    Clamp,
}

/// What lies between the middles of an image's pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TextureFilter {
    /// Even transitions.
    #[default]
    Bilinear,
    /// The nearest pixel.
    Nearest,
}

/// How a texture lies on shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Where coordinates come from.
    pub mapping: Mapping,
    /// The axis of the mapping; `None`: the shape's own.
    pub axis: Option<Axis>,
    /// Repeats per unit of u and v.
    pub scale: [f64; 2],
    /// Added to the scaled coordinates, in repeats.
    pub offset: [f64; 2],
}

/// What is in a file, once it was looked for.
#[derive(Clone, Default)]
struct Loaded(Option<Result<Arc<Image>, AssetError>>);

/// Pixels are compared only where they do not lie in the same place.
impl PartialEq for Loaded {
    fn eq(&self, other: &Self) -> bool {
        match (&self.0, &other.0) {
            (Some(Ok(a)), Some(Ok(b))) => Arc::ptr_eq(a, b) || a == b,
            (a, b) => a == b,
        }
    }
}

/// Without the pixels.
impl fmt::Debug for Loaded {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match &self.0 {
            None => f.write_str("not looked for"),
            Some(Ok(image)) => write!(f, "{} x {} pixels", image.size()[0], image.size()[1]),
            Some(Err(error)) => write!(f, "{error}"),
        }
    }
}

impl Loaded {
    fn image(&self) -> Option<&Arc<Image>> {
        self.0.as_ref()?.as_ref().ok()
    }

    fn fault(&self) -> Option<ValidationError> {
        let error = self.0.as_ref()?.as_ref().err()?;
        Some(ValidationError::new("file", error.what(), error.expected.clone()))
    }
}

impl Default for ImageTexture {
    fn default() -> Self {
        Self {
            file: String::new(),
            mapping: Mapping::Auto,
            axis: None,
            scale: [1.0; 2],
            offset: [0.0; 2],
            wrap: Wrap::Repeat,
            filter: TextureFilter::Bilinear,
            content: Loaded(None),
        }
    }
}

impl Default for Checker {
    fn default() -> Self {
        Self {
            even: Color::WHITE,
            odd: Color([0.1; 3]),
            mapping: Mapping::Auto,
            axis: None,
            scale: [1.0; 2],
            offset: [0.0; 2],
        }
    }
}

impl Default for HeightImage {
    fn default() -> Self {
        Self {
            file: String::new(),
            height: 0.02,
            mapping: Mapping::Auto,
            axis: None,
            scale: [1.0; 2],
            offset: [0.0; 2],
            wrap: Wrap::Repeat,
            content: Loaded(None),
        }
    }
}

/// The image of a description with a file; how it lies.
macro_rules! laid {
    ($($kind:ident),+) => {$(
        impl $kind {
            /// How it lies on shapes.
            pub fn placement(&self) -> Placement {
                let Self { mapping, axis, scale, offset, .. } = *self;
                Placement { mapping, axis, scale, offset }
            }

            fn checks(&self, fields: &'static [Field]) -> Validator {
                Validator::new(fields).numbers("scale", &self.scale).numbers("offset", &self.offset)
            }
        }
    )+};
}

laid!(ImageTexture, Checker, HeightImage);

impl ImageTexture {
    /// The pixels; `None`: no file is named.
    pub fn image(&self) -> Option<&Arc<Image>> {
        self.content.image()
    }
}

impl HeightImage {
    /// The pixels; `None`: no file is named.
    pub fn image(&self) -> Option<&Arc<Image>> {
        self.content.image()
    }
}

impl Texture {
    /// The kind with this key, with the defaults; `None`: no kind has it.
    pub fn new(key: &str) -> Option<Self> {
        match key {
            "image" => Some(Self::Image(ImageTexture::default())),
            "checker" => Some(Self::Checker(Checker::default())),
            _ => None,
        }
    }

    /// The key of its kind.
    pub fn key(&self) -> &'static str {
        match self {
            Self::Image(_) => "image",
            Self::Checker(_) => "checker",
        }
    }

    /// How it lies on shapes.
    pub fn placement(&self) -> Placement {
        match self {
            Self::Image(image) => image.placement(),
            Self::Checker(checker) => checker.placement(),
        }
    }

    /// Another kind that lies on shapes in the same way.
    pub fn changed(&self, key: &str) -> Option<Self> {
        let Placement { mapping, axis, scale, offset } = self.placement();
        Some(match Self::new(key)? {
            Self::Image(image) => {
                Self::Image(ImageTexture { mapping, axis, scale, offset, ..image })
            }
            Self::Checker(it) => Self::Checker(Checker { mapping, axis, scale, offset, ..it }),
        })
    }

    /// Whether it shows anything: an image without a file does not.
    pub fn has_effect(&self) -> bool {
        match self {
            Self::Image(image) => image.image().is_some(),
            Self::Checker(_) => true,
        }
    }

    pub(super) fn faults(&self) -> Vec<ValidationError> {
        let faults = match self {
            Self::Image(image) => image.checks(IMAGE_FIELDS).and(image.content.fault()).validate(),
            Self::Checker(checker) => checker
                .checks(CHECKER_FIELDS)
                .numbers("even", &checker.even.0)
                .numbers("odd", &checker.odd.0)
                .validate(),
        };
        faults.into_iter().map(|f| f.prefixed(self.key())).collect()
    }
}

impl Bump {
    /// The kind with this key, with the defaults; `None`: no kind has it.
    pub fn new(key: &str) -> Option<Self> {
        (key == "image").then(|| Self::Image(HeightImage::default()))
    }

    /// How it lies on shapes.
    pub fn placement(&self) -> Placement {
        let Self::Image(image) = self;
        image.placement()
    }

    /// Whether it turns any normal: without a file, or with the height 0, it does not.
    pub fn has_effect(&self) -> bool {
        let Self::Image(image) = self;
        image.height != 0.0 && image.image().is_some()
    }

    pub(super) fn faults(&self) -> Vec<ValidationError> {
        let Self::Image(image) = self;
        let checks = image.checks(BUMP_FIELDS).numbers("height", &[image.height]);
        let faults = checks.and(image.content.fault()).validate();
        faults.into_iter().map(|f| f.prefixed("image")).collect()
    }
}

impl crate::material::Material {
    /// The named files of its texture and its bump, with what was found in them.
    fn files_mut(&mut self) -> impl Iterator<Item = (&String, &mut Loaded)> {
        let texture = match &mut self.texture {
            Some(Texture::Image(image)) => Some((&image.file, &mut image.content)),
            _ => None,
        };
        let bump = self.bump.as_mut().map(|Bump::Image(image)| (&image.file, &mut image.content));
        [texture, bump].into_iter().flatten().filter(|(file, _)| !file.is_empty())
    }

    /// The files that it names.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        let texture = match &self.texture {
            Some(Texture::Image(image)) => Some(image.file.as_str()),
            _ => None,
        };
        let bump = self.bump.as_ref().map(|Bump::Image(image)| image.file.as_str());
        [texture, bump].into_iter().flatten().filter(|file| !file.is_empty())
    }

    /// Takes what `load` finds in the files that it names, those that have not been looked for yet.
    pub fn resolve(&mut self, load: impl Fn(&str) -> Result<Arc<Image>, AssetError>) {
        for (file, content) in self.files_mut() {
            content.0.get_or_insert_with(|| load(file));
        }
    }

    /// Takes over what `other` found in the files that both name.
    pub fn resolve_as(&mut self, other: &Self) {
        let mut known = other.clone();
        let known: Vec<_> = known.files_mut().collect();
        for (file, content) in self.files_mut() {
            if let Some((_, found)) = known.iter().find(|(name, _)| *name == file) {
                content.clone_from(found);
            }
        }
    }
}
