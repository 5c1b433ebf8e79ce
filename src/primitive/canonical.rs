//! Properties that every canonical form has. Each primitive implements all of them in its own file,
//! so that a new one cannot inherit an answer by default.

use crate::primitive::bounding::BoundingSphere;
use crate::primitive::form::Form;
use glam::{DAffine3, DMat3, DVec3};

/// Lowest and highest corner of an axis-parallel box.
pub type Bounds = (DVec3, DVec3);

/// One side of a plane: the points p with `normal . p <= offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Outward unit normal.
    pub normal: DVec3,
    /// Signed distance of the plane from the origin along `normal`.
    pub offset: f64,
}

/// Mapping of a texture to a form that a material leaves open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DefaultMapping {
    /// Planar: the form is flat.
    Planar,
    /// Spherical: the form is round on all sides.
    Spherical,
    /// Cylindrical: the form is round about an axis.
    Cylindrical,
    /// Box: the form has flat sides, or sides of any kind.
    Box,
    /// Texture coordinates that the form has of its own.
    Uv,
}

/// Surface that another one may come close to, within a box.
#[derive(Clone, Copy, Debug)]
pub enum ProxyFace {
    /// A plane.
    Flat(HalfSpace),
    /// A sphere.
    Round(BoundingSphere),
}

/// Stand-in for a form in the search for narrow gaps: its faces and its box.
#[derive(Clone, Debug)]
pub struct Proxy {
    /// Faces that may come close to those of other forms.
    pub faces: Vec<ProxyFace>,
    /// Lowest corner of the box.
    pub low: DVec3,
    /// Highest corner of the box.
    pub high: DVec3,
}

impl Proxy {
    /// Creates the proxy of a form with these bounds; `None` is a form without an end.
    pub fn new(faces: Vec<ProxyFace>, bounds: Option<Bounds>) -> Self {
        let (low, high) = bounds.unwrap_or((DVec3::NEG_INFINITY, DVec3::INFINITY));
        Self { faces, low, high }
    }

    /// Proxy of a round form: the faces of its box, each of which touches it.
    pub fn around((low, high): Bounds) -> Self {
        let faces = DVec3::AXES
            .into_iter()
            .flat_map(|axis| [(axis, axis.dot(high)), (-axis, -axis.dot(low))])
            .map(|(normal, offset)| ProxyFace::Flat(HalfSpace { normal, offset }))
            .collect();
        Self { faces, low, high }
    }
}

/// Geometry in double precision, in the space of the scene.
pub trait CanonicalShape {
    /// Singular and plural by which the inventory counts primitives of this form.
    const NOUN: (&'static str, &'static str);

    /// Image under the invertible affine map `map`.
    fn transformed(self, map: &DAffine3) -> Form;

    /// Number of parts that can have a material of their own.
    fn parts(&self) -> usize;

    /// Axis-parallel box around the form, the smallest but for compounds; `None` if it has no end.
    fn bounds(&self) -> Option<Bounds>;

    /// Sphere around the form; its radius is infinite if the form has no end.
    fn bounding_sphere(&self) -> BoundingSphere;

    /// The map from the space in which the form was described, and its box there; `None` if the
    /// form has no space of its own.
    fn oriented_box(&self) -> Option<(DAffine3, Bounds)>;

    /// Plane that a flat form lies in, its front on the side of the normal; `None` if the form is
    /// not flat.
    fn plane(&self) -> Option<HalfSpace>;

    /// Returns `true` if the outside of the form cannot see itself.
    fn is_convex(&self) -> bool;

    /// Smallest thickness of a solid, or the smaller edge of a flat form. Of a compound that of its
    /// thinnest part: what is left between cuts is found as a gap.
    fn thickness(&self) -> f64;

    /// Lower bound of the distance of `point` from the surface, exact close to it; outside of a box
    /// the box may stand for the form. `None` if there is no surface.
    fn clearance(&self, point: DVec3) -> Option<f64>;

    /// Unit normals of the surfaces that pass `point` within `slack`, a list for each solid that
    /// the form is made of; empty if none does.
    fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>>;

    /// Smallest t > 0 at which `origin + t direction` lies on the surface; `None` if there is none.
    /// The unit of t is the length of `direction`.
    fn cast(&self, origin: DVec3, direction: DVec3) -> Option<f64>;

    /// Mapping of textures that leave it open.
    fn default_mapping(&self) -> DefaultMapping;

    /// Proxies for the search for narrow gaps; none for a form whose details are too many.
    fn proxies(&self) -> Vec<Proxy>;

    /// Least and largest value of `axis . p` over the form, or bounds of them; `None` if it has no
    /// end in that direction. `axis` is a unit vector.
    fn extent_along(&self, axis: DVec3) -> Option<(f64, f64)>;

    /// Corners on which the form can stand.
    fn corners(&self) -> Vec<DVec3>;

    /// Number of triangles.
    fn triangles(&self) -> usize;
}

/// Box around points; `None` if there are none.
pub fn bounds_of_points(points: &[DVec3]) -> Option<Bounds> {
    let low = points.iter().copied().reduce(DVec3::min)?;
    let high = points.iter().copied().reduce(DVec3::max)?;
    Some((low, high))
}

/// Sphere through the corners of a box.
pub fn sphere_around_box(bounds: Option<Bounds>) -> BoundingSphere {
    match bounds {
        Some((low, high)) => {
            BoundingSphere { center: 0.5 * (low + high), radius: 0.5 * low.distance(high) }
        }
        None => BoundingSphere { center: DVec3::ZERO, radius: f64::INFINITY },
    }
}

/// Least and largest value of `axis . p` over points.
pub fn extent_of_points(points: &[DVec3], axis: DVec3) -> Option<(f64, f64)> {
    let heights = points.iter().map(|p| axis.dot(*p));
    let low = heights.clone().fold(f64::INFINITY, f64::min);
    Some((low, heights.fold(f64::NEG_INFINITY, f64::max)))
}

/// Least and largest value of `axis . p` over a box.
pub fn extent_of_box(bounds: Option<Bounds>, axis: DVec3) -> Option<(f64, f64)> {
    let (low, high) = bounds?;
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let (center, reach) = (axis.dot(middle), axis.abs().dot(half));
    Some((center - reach, center + reach))
}

/// Normals of those sides of one convex solid, given by height and normal, whose surfaces pass a
/// point within `slack`: near the solid the height over the farthest side is the distance.
pub fn normals_of_solid(sides: Vec<(f64, DVec3)>, slack: f64) -> Vec<Vec<DVec3>> {
    let near = sides.iter().all(|(height, _)| *height <= slack);
    let on = sides.into_iter().filter(|(height, _)| near && *height >= -slack);
    let normals: Vec<DVec3> = on.map(|(_, normal)| normal).collect();
    if normals.is_empty() { Vec::new() } else { vec![normals] }
}

/// Distance of `point` from a box; 0 inside it.
pub fn box_distance((low, high): Bounds, point: DVec3) -> f64 {
    (low - point).max(point - high).max(DVec3::ZERO).length()
}

/// Distance of `point` from the segment between `a` and `b`.
pub fn segment_distance([a, b]: [DVec3; 2], point: DVec3) -> f64 {
    let along = b - a;
    let length2 = along.length_squared();
    let t = if length2 > 0.0 { ((point - a).dot(along) / length2).clamp(0.0, 1.0) } else { 0.0 };
    point.distance(a + along * t)
}

/// Plane through `point` with a normal along `normal`.
pub fn half_space(point: DVec3, normal: DVec3) -> HalfSpace {
    let normal = normal.normalize();
    HalfSpace { normal, offset: normal.dot(point) }
}

/// Factor by which a linear map scales every length; `None` if it depends on the direction by more
/// than rounding.
pub fn similarity(linear: &DMat3) -> Option<f64> {
    let gram = linear.transpose() * *linear;
    let square = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    let rest = gram - DMat3::from_diagonal(DVec3::splat(square));
    let largest = rest.to_cols_array().iter().fold(0.0f64, |m, x| m.max(x.abs()));
    (largest <= 1e-13 * square).then(|| square.sqrt())
}
