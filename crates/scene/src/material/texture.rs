//! Textures and bump maps. A texture's colour multiplies that of the material; a bump perturbs the
//! shading normal.
//!
//! ```toml
//! texture.image = { file = "wood.png", mapping = "box", scale = [2.0, 2.0] }
//! texture.checker = { even = "#ffffff", odd = "#202020" }
//! bump.image = { file = "bricks.png", height = 0.02 }
//! ```

use crate::asset::{Image, Loaded, Reading};
use crate::value::{Color, Description, choices, description, one_of};
use std::sync::Arc;

one_of! {
    /// Texture that multiplies a material's colour.
    pub enum Texture {
        /// A PNG or JPEG image.
        Image(ImageTexture) = "image";
        /// Checkerboard of two colours; a repetition has two by two squares.
        Checker(Checker) = "checker";
    }
}

one_of! {
    /// Bump map that perturbs shading normals.
    pub enum Bump {
        /// Heights from a PNG or JPEG image: black is low, white is high.
        Image(HeightImage) = "image";
    }
}

description! {
    /// A PNG or JPEG image.
    pub struct ImageTexture {
        /// Name of the file, relative to the folder of the scene file. An empty name means white.
        file: String = "";
        /// Continuation of the image beyond its edges.
        wrap: Wrap = "repeat";
        /// Interpolation between the centres of the pixels.
        filter: TextureFilter = "bilinear";
        flatten placement: Placement, after 1;
        loads content: Loaded<Image>;
    }
}

description! {
    /// Checkerboard of two colours; a repetition has two by two squares.
    pub struct Checker {
        /// Colour of the square that begins at u = v = 0.
        even: Color = [1.0, 1.0, 1.0], in COEFFICIENT;
        /// Colour of the squares between those of the colour `even`.
        odd: Color = [0.1, 0.1, 0.1], in COEFFICIENT;
        flatten placement: Placement, after 2;
    }
}

description! {
    /// Heights from a PNG or JPEG image: black is low, white is high.
    pub struct HeightImage {
        /// Name of the file, relative to the folder of the scene file. An empty name means a flat
        /// surface.
        file: String = "";
        /// Height of white above black, before the object's transform; negative: depth below black.
        // The height of useful bumps is at most a hundredth of the size of the surface.
        height: f64 = 0.02, in closed(-1e3, 1e3) "scene units", step Units(0.005);
        /// Continuation of the image beyond its edges.
        wrap: Wrap = "repeat";
        flatten placement: Placement, after 2;
        loads content: Loaded<Image>;
    }
}

description! {
    /// Placement of a texture on a shape: the keys that determine its texture coordinates.
    pub struct Placement: Copy {
        /// Source of the coordinates u (to the right) and v (up).
        mapping: Mapping = "auto";
        /// Axis around or along which the mapping projects.
        axis: Option<Axis>, or "y for `spherical` and `cylindrical`, z for `planar`";
        /// Repetitions per unit of u and of v: larger numbers make the picture smaller.
        scale: [f64; 2] = [1.0, 1.0], in above(0.0, 1e6);
        /// Offset that is added to the scaled u and v; 1 is one repetition of the image. Positive
        /// values move the image left and down.
        offset: [f64; 2] = [0.0, 0.0], in closed(-1e6, 1e6), step Units(0.05);
    }
}

choices! {
    /// Source of the coordinates u and v of a texture.
    pub enum Mapping {
        /// chosen by the shape: `spherical` on spheres, `cylindrical` on shapes that are round
        /// about an axis, `box` on solids with flat faces, `planar` on flat shapes, `uv` on meshes
        /// whose file has texture coordinates, `box` on other meshes
        Auto = "auto",
        /// projection along the axis; one repetition per scene unit, from the lower left corner of
        /// the box around the shape (of a plane, from its `point`)
        Planar = "planar",
        /// u once around the axis, v once from pole to pole, about the middle of the box around the
        /// shape; the middle of the image faces the front
        Spherical = "spherical",
        /// u once around the axis, v once along the shape; the ends show the colours of their rims
        Cylindrical = "cylindrical",
        /// planar projection of each side, seen from outside; one repetition per scene unit, from
        /// the side's lower left corner
        Box = "box",
        /// texture coordinates of the mesh file; on rectangles and platforms, from 0 to 1 between
        /// opposite edges
        Uv = "uv",
    }
}

choices! {
    /// Axis of texture space.
    pub enum Axis {
        /// axis that points to the right
        X = "x",
        /// axis that points up, or along the axis of a cylinder or cone
        Y = "y",
        /// axis that points to the front, or along the normal of a flat shape
        Z = "z",
    }
}

choices! {
    /// Continuation of an image beyond its edges.
    pub enum Wrap {
        /// repetition of the image
        Repeat = "repeat",
        /// repetition of the outermost pixels
        Clamp = "clamp",
    }
}

choices! {
    /// Interpolation between the centres of an image's pixels.
    pub enum TextureFilter {
        /// bilinear interpolation, with smooth transitions
        Bilinear = "bilinear",
        /// no interpolation: every pixel is a square
        Nearest = "nearest",
    }
}

impl Texture {
    /// Returns the placement of the texture on shapes.
    pub fn placement(&self) -> &Placement {
        match self {
            Self::Image(image) => &image.placement,
            Self::Checker(checker) => &checker.placement,
        }
    }

    /// Returns the placement of the texture on shapes, for changes.
    pub fn placement_mut(&mut self) -> &mut Placement {
        match self {
            Self::Image(image) => &mut image.placement,
            Self::Checker(checker) => &mut checker.placement,
        }
    }

    /// Returns `false` for an image that is not loaded, otherwise `true`.
    pub fn has_effect(&self) -> bool {
        match self {
            Self::Image(image) => image.content.content().is_some(),
            Self::Checker(_) => true,
        }
    }
}

impl Bump {
    /// Returns the placement of the bump map on shapes.
    pub fn placement(&self) -> &Placement {
        let Self::Image(image) = self;
        &image.placement
    }

    /// Returns `true` if the bump map perturbs normals.
    pub fn has_effect(&self) -> bool {
        let Self::Image(image) = self;
        image.height != 0.0 && image.content.content().is_some()
    }
}

impl crate::material::Material {
    /// Returns the key, the file name and the loaded image of the texture and the bump map, if they name
    /// a file.
    pub fn image_files(&self) -> impl Iterator<Item = (&'static str, &str, Option<&Arc<Image>>)> {
        let texture = match &self.texture {
            Some(Texture::Image(image)) => {
                Some(("texture", image.file.as_str(), image.content.content()))
            }
            Some(Texture::Checker(_)) | None => None,
        };
        let bump = self.bump.as_ref();
        let bump =
            bump.map(|Bump::Image(image)| ("bump", image.file.as_str(), image.content.content()));
        let both = [texture, bump];
        both.into_iter().flatten().filter(|(_, file, _)| !file.is_empty())
    }

    /// Returns the loaded images of the texture and the bump map.
    pub fn images(&self) -> impl Iterator<Item = &Arc<Image>> {
        self.image_files().filter_map(|(.., image)| image)
    }

    /// Reads the files of texture and bump map with `load`, unless they are loaded already.
    pub fn resolve(&mut self, load: impl Fn(&str) -> Reading<Image>) {
        if let Some(Texture::Image(image)) = &mut self.texture {
            image.content.resolve(&image.file, &load);
        }
        if let Some(Bump::Image(image)) = &mut self.bump {
            image.content.resolve(&image.file, &load);
        }
    }
}
