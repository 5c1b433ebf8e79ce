//! Textures and bump maps of the reference tracer. Texture coordinates follow from formulas, their
//! derivatives from finite differences.

use crate::harness::*;
use crate::reference::compounds::Leaf;
use crate::reference::meshes::Triangles;
use crate::reference::surfaces::Piece;
use crate::reference::tracer::{Mutation, Tracer};
use png::BitDepth;
use zerkalo_scene::material::{
    Axis, Bump, Mapping, Placement, Texture, TextureFilter as Filter, Wrap,
};

/// Step of finite differences for derivatives of texture coordinates, in scene units.
const ASIDE: f64 = 1e-6;

/// Limit of the cylindrical mapping: its coordinate v, as a share of the height, is clamped to this
/// distance from both ends. The ends of a cylinder thus show the texture next to their rims.
const RIM: f64 = 1.0 / 16384.0;

/// Image file of the folder `scenes/textures`. The lowest row is the first.
pub struct Pixels {
    /// Number of columns and of rows.
    pub size: DVec2,
    /// Encoded colour values of the pixels as in the file, from 0 to 1.
    levels: Vec<DVec3>,
}

impl Pixels {
    /// Opens an image by the name that a scene of `scenes/features` uses.
    pub fn open(file: &str) -> Result<Self, String> {
        let path = Path::new(env!("ZERKALO_ROOT")).join("scenes/features").join(file);
        let image = PngImage::open(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        assert_eq!(image.depth, BitDepth::Eight, "{}", path.display());
        let code = |level: u8| f64::from(f32::from(level) / 255.0);
        let color = |levels: &[u8]| match levels {
            [grey] => DVec3::splat(code(*grey)),
            _ => DVec3::from([0, 1, 2].map(|c| code(levels[c]))),
        };
        let samples = image.color.samples();
        let rows = image.levels.chunks(image.width as usize * samples).rev();
        let levels = rows.flat_map(|row| row.chunks(samples)).map(color).collect();
        let size = DVec2::new(f64::from(image.width), f64::from(image.height));
        Ok(Self { size, levels })
    }

    /// Returns the pixel at a column and a row, which may be beyond the edges of the image.
    fn pixel(&self, position: DVec2, wrap: Wrap) -> DVec3 {
        let inside = match wrap {
            Wrap::Repeat => position.rem_euclid(self.size),
            Wrap::Clamp => position.clamp(DVec2::ZERO, self.size - 1.0),
        };
        self.levels[(inside.y * self.size.x + inside.x) as usize]
    }

    /// Returns `value` of the four pixels around a point, interpolated bilinearly.
    fn bilinear(&self, uv: DVec2, wrap: Wrap, value: impl Fn(DVec3) -> DVec3) -> DVec3 {
        let position = uv * self.size - 0.5;
        let (first, part) = (position.floor(), position - position.floor());
        let pixel = |x: f64, y: f64| value(self.pixel(first + DVec2::new(x, y), wrap));
        let low = pixel(0.0, 0.0).lerp(pixel(1.0, 0.0), part.x);
        low.lerp(pixel(0.0, 1.0).lerp(pixel(1.0, 1.0), part.x), part.y)
    }

    /// Returns the linear colour at the texture coordinates `uv`, which count repeats of the image
    /// from its lower left corner.
    pub fn color(&self, uv: DVec2, wrap: Wrap, filter: Filter) -> DVec3 {
        let linear =
            |c: f64| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
        let light = |code: DVec3| DVec3::from(code.to_array().map(linear));
        match filter {
            Filter::Bilinear => self.bilinear(uv, wrap, light),
            Filter::Nearest => light(self.pixel((uv * self.size).floor(), wrap)),
        }
    }

    /// Returns the height of the bump map at a point: its grey value from 0 to 1.
    pub fn height(&self, uv: DVec2, wrap: Wrap) -> f64 {
        self.bilinear(uv, wrap, |code| code).element_sum() / 3.0
    }

    /// Returns the slopes of the bump map's height along u and v, by central differences of pixels.
    fn slope(&self, uv: DVec2, wrap: Wrap) -> DVec2 {
        let along = |way: DVec2| {
            let step = way / self.size;
            let rise = self.height(uv + step, wrap) - self.height(uv - step, wrap);
            rise / (2.0 * step.element_sum())
        };
        DVec2::new(along(DVec2::X), along(DVec2::Y))
    }
}

/// Texture frame of a simple shape, in the shape's own coordinates.
pub struct Canvas {
    /// Three columns: the directions right, up (or along the axis), and front (or along the
    /// normal).
    frame: DMat3,
    /// Texture mapping that the scene value `auto` selects for the shape.
    default_mapping: Mapping,
}

/// Returns the texture frame around an axis. Its right vector is perpendicular to z.
fn around(axis: DVec3) -> DMat3 {
    let up = axis.normalize();
    let right = up.cross(DVec3::Z).try_normalize().unwrap_or(DVec3::X);
    DMat3::from_cols(right, up, right.cross(up))
}

/// Returns the texture frame of a flat shape with the given normal. Its up vector is the projection
/// of the y axis onto the shape. For a horizontal shape it is -z if the normal points up, and +z if
/// the normal points down.
fn flat(normal: DVec3) -> DMat3 {
    let front = normal.normalize();
    let up = if front.y.abs() > 0.999 { DVec3::NEG_Z * front.y.signum() } else { DVec3::Y };
    let right = up.cross(front).normalize();
    DMat3::from_cols(right, front.cross(right), front)
}

impl Canvas {
    pub fn new(shape: &Shape, mesh: Option<&Triangles>) -> Self {
        let v = |a: [f64; 3]| DVec3::from(a);
        let rotated = |degrees: f64| DMat3::from_rotation_y(degrees.to_radians());
        let (frame, usual) = match shape {
            Shape::Sphere(_) => (DMat3::IDENTITY, Mapping::Spherical),
            Shape::Plane(p) => (flat(v(p.normal)), Mapping::Planar),
            Shape::HorizontalRectangle(_) => (flat(DVec3::Y), Mapping::Planar),
            Shape::Rectangle(r) => {
                let front = v(r.normal).normalize();
                let right = v(r.up).cross(front).normalize();
                (DMat3::from_cols(right, front.cross(right), front), Mapping::Planar)
            }
            Shape::Cylinder(c) => (around(v(c.top) - v(c.base)), Mapping::Cylindrical),
            Shape::TaperedCylinder(c) => (around(v(c.top) - v(c.base)), Mapping::Cylindrical),
            Shape::Cone(c) => (around(v(c.apex) - v(c.base)), Mapping::Cylindrical),
            Shape::Torus(t) => (around(v(t.axis)), Mapping::Uv),
            Shape::UnitFrustum(_) => (around(DVec3::Z), Mapping::Cylindrical),
            Shape::Cube(c) => (rotated(c.rotation), Mapping::Box),
            Shape::Prism(p) => (rotated(p.rotation), Mapping::Box),
            Shape::Pyramid(p) => (rotated(p.rotation), Mapping::Box),
            _ if mesh.is_some_and(Triangles::has_uv) => (DMat3::IDENTITY, Mapping::Uv),
            _ => (DMat3::IDENTITY, Mapping::Box),
        };
        Self { frame, default_mapping: usual }
    }

    /// Returns the mapping that a texture placement selects, and the right, up and front vectors of
    /// this mapping.
    fn view(&self, placement: &Placement) -> (Mapping, DMat3) {
        let mapping = match placement.mapping {
            Mapping::Auto => self.default_mapping,
            explicit => explicit,
        };
        let [x, y, z] = [self.frame.x_axis, self.frame.y_axis, self.frame.z_axis];
        let looks = matches!(mapping, Mapping::Planar | Mapping::Uv);
        let turns = matches!(mapping, Mapping::Spherical | Mapping::Cylindrical);
        let view = match placement.axis {
            Some(Axis::X) if looks => DMat3::from_cols(-z, y, x),
            Some(Axis::Y) if looks => DMat3::from_cols(x, -z, y),
            Some(Axis::X) if turns => DMat3::from_cols(z, x, y),
            Some(Axis::Z) if turns => DMat3::from_cols(y, z, x),
            _ => self.frame,
        };
        (mapping, view)
    }
}

/// Returns the smallest and the largest coordinate along the direction `along`, over all pieces and
/// mesh triangles of a simple shape.
fn ends(leaf: &Leaf, along: DVec3) -> (f64, f64) {
    let corners = leaf.mesh.iter().flat_map(Triangles::points).map(|p| (p.dot(along), 0.0));
    let pieces = leaf.pieces.iter().flat_map(|piece| match piece {
        Piece::Sphere(center, radius) => vec![(center.dot(along), *radius)],
        Piece::Polygon(corners, _) => corners.iter().map(|c| (c.dot(along), 0.0)).collect(),
        Piece::Plane(point, _) => vec![(point.dot(along), 0.0)],
        Piece::Disc(center, normal, radius) => {
            vec![(center.dot(along), radius * normal.cross(along).length())]
        }
        Piece::Torus(center, axis, [ring, tube]) => {
            vec![(center.dot(along), ring * axis.normalize().cross(along).length() + tube)]
        }
        // The discs at both ends of the cone's side are pieces, too. They contain its extreme
        // points.
        Piece::Side(..) => Vec::new(),
    });
    corners
        .chain(pieces)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (x, r)| (l.min(x - r), h.max(x + r)))
}

/// Point on a simple shape, in the shape's own coordinates.
pub struct Spot<'a> {
    pub leaf: &'a Leaf,
    pub facet: usize,
    pub point: DVec3,
    /// Outward normal at the point.
    pub normal: DVec3,
}

impl Spot<'_> {
    /// Returns the texture coordinates of `point`, in repeats of the image. `point` must be on the
    /// same side of the same shape as the spot `self`.
    fn uv(&self, placement: &Placement, point: DVec3) -> DVec2 {
        let (scale, offset) = (DVec2::from(placement.scale), DVec2::from(placement.offset));
        let (mapping, view) = self.leaf.canvas.view(placement);
        let own = self.leaf.mesh.as_ref().and_then(|mesh| mesh.uv(self.facet, point));
        if let (Mapping::Uv, Some(own)) = (mapping, own) {
            return own * scale + offset;
        }
        let all = [view.x_axis, view.y_axis, view.z_axis].map(|axis| ends(self.leaf, axis));
        let low = DVec3::from(all.map(|(low, _)| low));
        let high = DVec3::from(all.map(|(_, high)| high));
        let (size, seen) = (high - low, view.transpose() * point);
        let (from_low, from_middle) = (seen - low, seen - 0.5 * (low + high));
        let turns = 0.5 + from_middle.x.atan2(from_middle.z) / TAU;
        let uv = match mapping {
            Mapping::Spherical => {
                let across = from_middle.x.hypot(from_middle.z);
                DVec2::new(turns, 0.5 + from_middle.y.atan2(across) / PI)
            }
            Mapping::Cylindrical => DVec2::new(turns, (from_low.y / size.y).clamp(RIM, 1.0 - RIM)),
            Mapping::Box => {
                let n = view.transpose() * self.normal;
                // Coordinates start at the lower left corner of a face of the box, as seen from
                // outside. The face is that of the largest component of the normal. If two
                // components are equal, the later one in the order x, y, z is used.
                let (back, p) = (high - seen, from_low);
                match n.abs() {
                    a if a.z >= a.x.max(a.y) => {
                        DVec2::new(if n.z > 0.0 { p.x } else { back.x }, p.y)
                    }
                    a if a.y >= a.x => DVec2::new(p.x, if n.y > 0.0 { back.z } else { p.z }),
                    _ => DVec2::new(if n.x > 0.0 { back.z } else { p.z }, p.y),
                }
            }
            // The image covers one turn around the ring (u) and one turn around the tube (v).
            Mapping::Uv if matches!(self.leaf.pieces[..], [Piece::Torus(..)]) => {
                let Piece::Torus(_, _, [ring, _]) = self.leaf.pieces[0] else { unreachable!() };
                let beyond = from_middle.x.hypot(from_middle.z) - ring;
                DVec2::new(turns, 0.5 + from_middle.y.atan2(beyond) / TAU)
            }
            // The image extends from edge to edge of a flat shape.
            Mapping::Uv => from_low.truncate() / size.truncate(),
            Mapping::Planar | Mapping::Auto => from_low.truncate(),
        };
        uv * scale + offset
    }
}

impl Tracer<'_> {
    pub fn open_images(&mut self, material: &Material) -> Result<(), String> {
        for (_, file, _) in material.image_files() {
            if !self.images.contains_key(file) {
                self.images.insert(file.to_string(), Pixels::open(file)?);
            }
        }
        Ok(())
    }

    /// Returns the factor by which the material's texture multiplies the albedo at a point.
    pub fn painted(&self, material: &Material, spot: &Spot) -> DVec3 {
        let Some(texture) = &material.texture else { return DVec3::ONE };
        let mut uv = spot.uv(texture.placement(), spot.point);
        if self.mutation == Mutation::SidewaysTexture {
            uv = DVec2::new(uv.y, uv.x);
        }
        match texture {
            Texture::Checker(checker) => {
                let squares = (uv * 2.0).floor().element_sum();
                let color = if squares.rem_euclid(2.0) == 0.0 { checker.even } else { checker.odd };
                DVec3::from(color.0)
            }
            Texture::Image(texture) => self
                .images
                .get(&texture.file)
                .map_or(DVec3::ONE, |pixels| pixels.color(uv, texture.wrap, texture.filter)),
        }
    }

    /// Returns the outward normal `normal`, perturbed by the material's bump map at a point.
    pub fn raised(&self, material: &Material, spot: &Spot, normal: DVec3) -> DVec3 {
        let Some(Bump::Image(image)) = &material.bump else { return normal };
        let Some(pixels) = self.images.get(&image.file) else { return normal };
        let placement = image.placement;
        let slope = pixels.slope(spot.uv(&placement, spot.point), image.wrap);
        let height =
            if self.mutation == Mutation::SunkenBumps { -image.height } else { image.height };
        let rise = |along: DVec3| {
            let forward_uv = spot.uv(&placement, spot.point + along * ASIDE);
            let mut step = forward_uv - spot.uv(&placement, spot.point - along * ASIDE);
            // At the seam of a mapping around an axis, u jumps by one repeat. The jump is
            // subtracted.
            let turn = placement.scale[0];
            if step.x.abs() > 0.5 * turn {
                step.x -= turn * step.x.signum();
            }
            along * (height * slope.dot(step) / (2.0 * ASIDE))
        };
        let (a, b) = normal.any_orthonormal_pair();
        (normal - rise(a) - rise(b)).normalize()
    }
}
