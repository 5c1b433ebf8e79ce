//! Coordinate systems in which textures are mapped onto shapes.

use crate::shape::Shape;
use crate::shape::transform::compose;
use glam::{DAffine3, DMat3, DVec3};
use zerkalo_kernel::primitive::Projection;

/// Texture space of a simple shape, in scene units before the object's transform. x points to the
/// right, y points up or along the shape's axis, and z points to the shape's front or along its
/// normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureSpace {
    /// Map from texture space to the space of the shape, or of the whole compound.
    pub shape_from_texture: DAffine3,
    /// Corners of the shape's bounding box in texture space; for a plane, its `point`.
    pub corners: [DVec3; 2],
    /// Mapping that `mapping = "auto"` selects for the shape.
    pub default_mapping: Projection,
}

impl TextureSpace {
    /// Creates the texture space of a valid shape that is no compound.
    fn new(shape: &Shape) -> Self {
        let form = shape.form();
        let shape_from_texture = DAffine3::from_mat3(shape.texture_axes());
        let texture_from_shape = shape_from_texture.inverse();
        let default_mapping = form.default_mapping();
        let point = texture_from_shape.transform_point3(shape.position());
        let corners = form.transformed(&texture_from_shape).bounds().unwrap_or((point, point));
        Self { shape_from_texture, corners: corners.into(), default_mapping }
    }

    /// Returns `true` for shapes with (u, v) coordinates: bounded flat ones, and meshes with them.
    pub fn has_uv(&self) -> bool {
        let [low, high] = self.corners;
        match self.default_mapping {
            Projection::Uv => true,
            Projection::Planar => low != high,
            Projection::Spherical | Projection::Cylindrical | Projection::Box => false,
        }
    }
}

impl Shape {
    /// Returns the texture space of each part of the valid shape, in the order of its form.
    pub fn texture_spaces(&self) -> Vec<TextureSpace> {
        let Some(of) = self.parts() else { return vec![TextureSpace::new(self)] };
        let inner = |part: &crate::shape::CsgOperand| {
            let map = compose(&part.transform);
            let spaces = part.shape.texture_spaces().into_iter();
            spaces.map(move |space| TextureSpace {
                shape_from_texture: map * space.shape_from_texture,
                ..space
            })
        };
        of.iter().flat_map(inner).collect()
    }
}

/// Returns orthonormal axes with the unit vector `y`, and x as far to the right as possible.
pub(super) fn around_axis(y: DVec3) -> DMat3 {
    let across = y.cross(DVec3::Z);
    let x = if across.length() > 1e-3 { across.normalize() } else { DVec3::X };
    let x = (x - y * x.dot(y)).normalize();
    DMat3::from_cols(x, y, x.cross(y))
}

/// Returns orthonormal axes with the unit normal `z`, and y as far up as possible. On level planes,
/// y is along -z if they face up, along +z if they face down.
pub(super) fn on_plane(z: DVec3) -> DMat3 {
    let up = if z.y.abs() > 0.999 { DVec3::NEG_Z * z.y.signum() } else { DVec3::Y };
    let x = up.cross(z).normalize();
    DMat3::from_cols(x, z.cross(x), z)
}

/// Returns the texture axes of a shape that is rotated about the vertical.
pub(super) fn axes_rotated_y(degrees: f64) -> DMat3 {
    let (sin, cos) = crate::value::sin_cos_degrees(degrees);
    DMat3::from_cols(DVec3::new(cos, 0.0, -sin), DVec3::Y, DVec3::new(sin, 0.0, cos))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TomlText;
    use crate::shape::{EXAMPLES, KINDS};

    fn shape(text: &str) -> Shape {
        let table: toml::Table = text.parse().unwrap();
        Shape::from_text(&table["shape"].as_table().unwrap().to_string()).unwrap()
    }

    #[test]
    fn texture_axes_of_every_kind_are_right_handed() {
        for (kind, (key, text)) in KINDS.iter().zip(EXAMPLES) {
            for space in shape(text).texture_spaces() {
                let axes = space.shape_from_texture.matrix3;
                assert!((axes.determinant() - 1.0).abs() < 1e-12, "{key}");
                let gram = axes.transpose() * axes;
                assert!(gram.abs_diff_eq(DMat3::IDENTITY, 1e-12), "{key}");
                let [low, high] = space.corners;
                assert!(low.cmple(high).all() && (kind.name == "plane" || low != high), "{key}");
            }
        }
    }

    #[test]
    fn texture_axes_follow_shape() {
        let one = |text: &str| shape(text).texture_spaces()[0];
        let column = |space: &TextureSpace, i: usize| space.shape_from_texture.matrix3.col(i);
        let floor = one("shape.plane = { point = [1.0, 2.0, 3.0], normal = [0.0, 2.0, 0.0] }");
        assert_eq!([column(&floor, 0), column(&floor, 1)], [DVec3::X, DVec3::NEG_Z]);
        let point = floor.shape_from_texture.transform_point3(floor.corners[0]);
        assert!((point - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-12 && !floor.has_uv());
        let ceiling = one("shape.plane = { point = [0.0, 2.0, 0.0], normal = [0.0, -1.0, 0.0] }");
        assert_eq!([column(&ceiling, 0), column(&ceiling, 1)], [DVec3::X, DVec3::Z]);
        let wall = one(
            "shape.rectangle = { center = [0.0, 0.0, 0.0], size = [3.0, 2.0], normal = [0.0, 0.0, 1.0] }",
        );
        assert_eq!([column(&wall, 0), column(&wall, 1)], [DVec3::X, DVec3::Y]);
        assert!(wall.has_uv() && (wall.corners[1] - wall.corners[0]).length() > 3.0);
        let pole =
            one("shape.cylinder = { base = [0.0, 0.0, 0.0], top = [3.0, 0.0, 0.0], radius = 0.5 }");
        assert!((column(&pole, 1) - DVec3::X).length() < 1e-12);
        assert!((pole.corners[1].y - pole.corners[0].y - 3.0).abs() < 1e-12);
        let cube = one("shape.cube = { corner = [4.0, 0.0, 1.0], edge = 1.5, rotation = 33.0 }");
        let size = cube.corners[1] - cube.corners[0];
        assert!((size - DVec3::splat(1.5)).length() < 1e-12, "its own sides: {size}");
        assert_eq!(cube.default_mapping, Projection::Box);
    }

    #[test]
    fn texture_spaces_of_parts_keep_order_and_transforms() {
        let compound = shape(
            "shape.union.of = [
                { shape.sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 } },
                { shape.difference.of = [
                    { shape.cube = { corner = [0.0, 0.0, 0.0], edge = 1.0 }, transform = [{ scale = 2.0 }] },
                    { shape.cone = { base = [0.0, 0.0, 0.0], apex = [0.0, 1.0, 0.0], radius = 1.0 } },
                ], transform = [{ translate = [5.0, 0.0, 0.0] }] },
            ]",
        );
        let spaces = compound.texture_spaces();
        assert_eq!(spaces.len(), compound.part_materials("").len());
        let kinds: Vec<_> = spaces.iter().map(|s| s.default_mapping).collect();
        assert_eq!(kinds, [Projection::Spherical, Projection::Box, Projection::Cylindrical]);
        let corner = spaces[1].shape_from_texture.transform_point3(DVec3::ONE);
        assert!((corner - DVec3::new(7.0, 2.0, 2.0)).length() < 1e-12, "{corner}");
    }
}
