//! Properties that every canonical form (kind of primitive) has. Each primitive implements all of
//! them in its own file. None has a default, so that a new primitive must decide each of them.

use crate::primitive::bounding::BoundingSphere;
use crate::primitive::form::Form;
use glam::{DAffine3, DMat3, DVec3};

/// Lowest and highest corner of an axis-parallel box.
pub type Bounds = (DVec3, DVec3);

/// One side of a plane: the points p with `normal . p <= offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Outward normal of unit length.
    pub normal: DVec3,
    /// Signed distance of the plane from the origin along `normal`.
    pub offset: f64,
}

/// Default mapping of textures to a form, used if a material does not choose one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DefaultMapping {
    /// Planar, for flat forms.
    Planar,
    /// Spherical, for forms that are round on all sides.
    Spherical,
    /// Cylindrical, for forms that are round about an axis.
    Cylindrical,
    /// Box, for forms with flat sides and for forms of any other kind.
    Box,
    /// The form's own texture coordinates.
    Uv,
}

/// Face of a [`Proxy`]: a plane or a sphere in place of a part of the surface.
#[derive(Clone, Copy, Debug)]
pub enum ProxyFace {
    /// A plane.
    Flat(HalfSpace),
    /// A sphere.
    Round(BoundingSphere),
}

/// Simplified form in the search for narrow gaps between objects: some faces, and a bounding box.
#[derive(Clone, Debug)]
pub struct Proxy {
    /// Faces that may be close to the faces of other forms.
    pub faces: Vec<ProxyFace>,
    /// Lowest corner of the box.
    pub low: DVec3,
    /// Highest corner of the box.
    pub high: DVec3,
}

impl Proxy {
    /// Creates the proxy of a form with the given bounds; `None` for a form without finite bounds.
    pub fn new(faces: Vec<ProxyFace>, bounds: Option<Bounds>) -> Self {
        let (low, high) = bounds.unwrap_or((DVec3::NEG_INFINITY, DVec3::INFINITY));
        Self { faces, low, high }
    }

    /// Creates the proxy of a round form. Its faces are those of the form's bounding box, each of
    /// which touches the form.
    pub fn around((low, high): Bounds) -> Self {
        let faces = DVec3::AXES
            .into_iter()
            .flat_map(|axis| [(axis, axis.dot(high)), (-axis, -axis.dot(low))])
            .map(|(normal, offset)| ProxyFace::Flat(HalfSpace { normal, offset }))
            .collect();
        Self { faces, low, high }
    }
}

/// Geometry of one kind of primitive, in double precision and scene coordinates.
pub trait CanonicalShape {
    /// Noun for such primitives in the scene's inventory, singular and plural.
    const NOUN: (&'static str, &'static str);

    /// Returns the image of the form under the invertible affine map `map`.
    fn transformed(self, map: &DAffine3) -> Form;

    /// Number of parts that can have a material of their own.
    fn parts(&self) -> usize;

    /// Axis-parallel bounding box; `None` if the form has no finite bounds. It is the smallest one,
    /// except for compounds.
    fn bounds(&self) -> Option<Bounds>;

    /// Bounding sphere; its radius is infinite if the form has no finite bounds.
    fn bounding_sphere(&self) -> BoundingSphere;

    /// Bounding box in the form's own space, with the map from this space to the scene; `None` if
    /// the form has no space of its own.
    fn oriented_box(&self) -> Option<(DAffine3, Bounds)>;

    /// Plane that contains the form, with its normal on the front; `None` if the form is not flat.
    fn plane(&self) -> Option<HalfSpace>;

    /// Returns `true` if no ray that leaves the form's outside hits the form again.
    fn is_convex(&self) -> bool;

    /// Smallest thickness of a solid, or shorter edge of a flat form. For a compound it is that of
    /// its thinnest part; thin remains of cuts are found by the search for gaps.
    fn thickness(&self) -> f64;

    /// Lower bound of the distance between `point` and the surface; `None` if there is no surface.
    /// It is exact for points close to the surface. For points outside of a box around the form it
    /// may be the distance to the box.
    fn clearance(&self, point: DVec3) -> Option<f64>;

    /// Unit normals of the surfaces within the distance `slack` of `point`, one list for each solid
    /// that the form consists of. Empty if there are none.
    fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>>;

    /// Smallest t > 0 at which `origin + t direction` is on the surface; `None` if there is none.
    /// The unit of t is the length of `direction`.
    fn cast(&self, origin: DVec3, direction: DVec3) -> Option<f64>;

    /// Default mapping of textures to the form, used if a material does not choose one.
    fn default_mapping(&self) -> DefaultMapping;

    /// Proxies in the search for narrow gaps; empty for a form with too many details.
    fn proxies(&self) -> Vec<Proxy>;

    /// Smallest and largest value of `axis . p` over the points p of the form, or bounds of both;
    /// `None` if the form is unbounded along the axis. `axis` is a unit vector.
    fn extent_along(&self, axis: DVec3) -> Option<(f64, f64)>;

    /// Corners on which the form can stand when it is snapped to the ground.
    fn corners(&self) -> Vec<DVec3>;

    /// Number of triangles; 0 except for meshes.
    fn triangles(&self) -> usize;
}

/// Returns the bounding box of points; `None` if there are none.
pub fn bounds_of_points(points: &[DVec3]) -> Option<Bounds> {
    let low = points.iter().copied().reduce(DVec3::min)?;
    let high = points.iter().copied().reduce(DVec3::max)?;
    Some((low, high))
}

/// Returns the sphere through the corners of a box.
pub fn sphere_around_box(bounds: Option<Bounds>) -> BoundingSphere {
    match bounds {
        Some((low, high)) => {
            BoundingSphere { center: 0.5 * (low + high), radius: 0.5 * low.distance(high) }
        }
        None => BoundingSphere { center: DVec3::ZERO, radius: f64::INFINITY },
    }
}

/// Returns the smallest and the largest value of `axis . p` over the points p.
pub fn extent_of_points(points: &[DVec3], axis: DVec3) -> Option<(f64, f64)> {
    let heights = points.iter().map(|p| axis.dot(*p));
    let low = heights.clone().fold(f64::INFINITY, f64::min);
    Some((low, heights.fold(f64::NEG_INFINITY, f64::max)))
}

/// Returns the smallest and the largest value of `axis . p` over the points p of a box.
pub fn extent_of_box(bounds: Option<Bounds>, axis: DVec3) -> Option<(f64, f64)> {
    let (low, high) = bounds?;
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let (center, reach) = (axis.dot(middle), axis.abs().dot(half));
    Some((center - reach, center + reach))
}

/// Returns the normals of the sides of a convex solid that are within `slack` of a point. `sides`
/// has, for each side, the height of the point above the side, and the normal. The largest height
/// is the distance between the point and the solid.
pub fn normals_of_solid(sides: Vec<(f64, DVec3)>, slack: f64) -> Vec<Vec<DVec3>> {
    let near = sides.iter().all(|(height, _)| *height <= slack);
    let on = sides.into_iter().filter(|(height, _)| near && *height >= -slack);
    let normals: Vec<DVec3> = on.map(|(_, normal)| normal).collect();
    if normals.is_empty() { Vec::new() } else { vec![normals] }
}

/// Returns the distance between `point` and a box; 0 inside of the box.
pub fn box_distance((low, high): Bounds, point: DVec3) -> f64 {
    (low - point).max(point - high).max(DVec3::ZERO).length()
}

/// Returns the distance between `point` and the segment from `a` to `b`.
pub fn segment_distance([a, b]: [DVec3; 2], point: DVec3) -> f64 {
    let along = b - a;
    let length2 = along.length_squared();
    let t = if length2 > 0.0 { ((point - a).dot(along) / length2).clamp(0.0, 1.0) } else { 0.0 };
    point.distance(a + along * t)
}

/// Returns the half-space behind the plane through `point` with the normal `normal`, of any length.
pub fn half_space(point: DVec3, normal: DVec3) -> HalfSpace {
    let normal = normal.normalize();
    HalfSpace { normal, offset: normal.dot(point) }
}

/// Returns the factor by which a linear map scales lengths. Returns `None` if, beyond rounding
/// errors, it depends on the direction.
pub fn similarity(linear: &DMat3) -> Option<f64> {
    let gram = linear.transpose() * *linear;
    let square = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    let rest = gram - DMat3::from_diagonal(DVec3::splat(square));
    let largest = rest.to_cols_array().iter().fold(0.0f64, |m, x| m.max(x.abs()));
    (largest <= 1e-13 * square).then(|| square.sqrt())
}
