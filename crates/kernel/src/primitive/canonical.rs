//! Trait of all canonical forms, the stage between the description in the scene file and the
//! compiled primitive. Default methods are valid for every form; a form overrides those for which
//! it has a tighter result.

use crate::primitive::bounding::BoundingSphere;
use glam::{DAffine3, DMat3, DVec3};

/// Axis-parallel box: its lowest and its highest corner.
pub type Bounds = (DVec3, DVec3);

/// Box without finite bounds.
pub const UNBOUNDED: Bounds = (DVec3::NEG_INFINITY, DVec3::INFINITY);

/// Half-space: the points p with `normal . p <= offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Unit normal of the boundary plane, pointing out of the half-space.
    pub normal: DVec3,
    /// Signed distance of the boundary plane from the origin along `normal`.
    pub offset: f64,
}

impl HalfSpace {
    /// Creates the half-space behind the plane through `point` with the normal `normal`, of any
    /// length.
    pub fn through(point: DVec3, normal: DVec3) -> Self {
        let normal = normal.normalize();
        Self { normal, offset: normal.dot(point) }
    }

    /// Returns the signed distance of `point` from the boundary plane, positive outside.
    pub fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// Returns the image under the invertible affine map `map`.
    pub fn transformed(&self, map: &DAffine3) -> Self {
        let normals = map.matrix3.inverse().transpose();
        Self::through(map.transform_point3(self.normal * self.offset), normals * self.normal)
    }
}

/// Formula of texture coordinates (u, v) in texture space: x to the right, y up, z to the front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Projection {
    /// Planar projection: u = x, v = y.
    Planar,
    /// Spherical projection: u is the angle around y in turns, 1/2 at the front; v the angle from
    /// the lower pole in half turns.
    Spherical,
    /// Cylindrical projection: u is the angle around y in turns, 1/2 at the front; v the height
    /// above the shape's lower end divided by the shape's height.
    Cylindrical,
    /// Planar projection of each side of a box, seen from outside.
    Box,
    /// No projection: the shape's own texture coordinates.
    Uv,
}

/// Face of a [`Proxy`].
#[derive(Clone, Copy, Debug)]
pub enum ProxyFace {
    /// Flat part of the surface, given as the half-space behind it.
    Flat(HalfSpace),
    /// Sphere that stands for a round part of the surface.
    Round(BoundingSphere),
}

/// Simplified geometry of an object: some faces, and a bounding box. It is used to find narrow gaps
/// between objects, which decide whether single precision suffices.
#[derive(Clone, Debug)]
pub struct Proxy {
    /// Faces that may be close to the faces of other objects.
    pub faces: Vec<ProxyFace>,
    /// Lowest corner of the bounding box.
    pub low: DVec3,
    /// Highest corner of the bounding box.
    pub high: DVec3,
}

impl Proxy {
    /// Creates a proxy. `bounds` is `None` for an object without finite bounds.
    pub fn new(faces: Vec<ProxyFace>, bounds: Option<Bounds>) -> Self {
        let (low, high) = bounds.unwrap_or(UNBOUNDED);
        Self { faces, low, high }
    }

    /// Creates the proxy of a round object: the sides of its bounding box, which touch it.
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
    /// Returns the axis-parallel bounding box, the smallest one except for compounds; `None` if the
    /// geometry has no finite bounds.
    fn bounds(&self) -> Option<Bounds>;

    /// Returns the largest magnitude of a coordinate of the bounding box; infinity if the geometry
    /// has no finite bounds.
    fn max_coordinate(&self) -> f64 {
        self.bounds().map_or(f64::INFINITY, |(low, high)| low.abs().max(high.abs()).max_element())
    }

    /// Returns a bounding sphere; its radius is infinite if the geometry has no finite bounds.
    fn bounding_sphere(&self) -> BoundingSphere {
        match &self.corners()[..] {
            [] => BoundingSphere::around_box(self.bounds()),
            corners => BoundingSphere::around(corners),
        }
    }

    /// Returns the map from the object space of the geometry to the scene, and the bounding box in
    /// object space; `None` if there is no object space.
    fn oriented_box(&self) -> Option<(DAffine3, Bounds)> {
        None
    }

    /// Returns the plane that contains flat geometry, with its normal on the front; `None` for
    /// other geometry.
    fn plane(&self) -> Option<HalfSpace> {
        None
    }

    /// Returns the smallest thickness of a solid, or the shorter edge of flat geometry, in scene
    /// units. A compound has the thickness of its thinnest part; the search for narrow gaps finds
    /// thinner pieces, which cuts may leave.
    fn thickness(&self) -> f64;

    /// Returns a lower bound of the distance between `point` and the surface, 0 on the surface
    /// except for rounding errors; `None` if there is no surface. For a point outside the bounding
    /// box, the distance to the box may be the bound.
    fn clearance(&self, point: DVec3) -> Option<f64>;

    /// Returns the unit normals of the surfaces whose distance from `point` is at most `slack`. A
    /// compound has one list for each solid with such a surface, other geometry at most one list.
    fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>>;

    /// Returns the projection for materials that choose none: `Box`, unless the form overrides it.
    fn default_mapping(&self) -> Projection {
        Projection::Box
    }

    /// Returns proxies for the search for gaps. Geometry with too many details has none.
    fn proxies(&self) -> Vec<Proxy> {
        self.bounds().map(Proxy::around).into_iter().collect()
    }

    /// Returns a lower and an upper bound of `axis . p` over all points p of the geometry; `None`
    /// if it is unbounded along the unit vector `axis`. The default is the extent of the corners or
    /// of the bounding box.
    fn extent_along(&self, axis: DVec3) -> Option<(f64, f64)> {
        let heights = self.corners().into_iter().map(|corner| axis.dot(corner));
        if let Some(low) = heights.clone().reduce(f64::min) {
            return Some((low, heights.fold(low, f64::max)));
        }
        let (low, high) = self.bounds()?;
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let (center, reach) = (axis.dot(middle), axis.abs().dot(half));
        Some((center - reach, center + reach))
    }

    /// Returns the corners of the convex hull of geometry with flat faces; none for other geometry.
    /// The object can stand on these corners when it is snapped to the ground.
    fn corners(&self) -> Vec<DVec3> {
        Vec::new()
    }

    /// Returns the number of triangles; 0 except for meshes.
    fn triangles(&self) -> usize {
        0
    }

    /// Returns an upper bound of the lengths of all lifts, see
    /// [`shading_normal`](crate::primitive::Aggregate::shading_normal).
    fn max_lift(&self) -> f64 {
        0.0
    }
}

/// Returns the axis-parallel bounding box of `points`; `None` if there are none.
pub fn bounds_of_points(points: &[DVec3]) -> Option<Bounds> {
    let low = points.iter().copied().reduce(DVec3::min)?;
    let high = points.iter().copied().reduce(DVec3::max)?;
    Some((low, high))
}

/// Implements [`CanonicalShape::normals_at`] for a convex solid. `sides` has, for each side, the
/// height of the point above it and its outward normal. The largest height counts as the distance
/// between the point and the solid.
pub fn normals_of_solid(sides: Vec<(f64, DVec3)>, slack: f64) -> Vec<Vec<DVec3>> {
    let near = sides.iter().all(|(height, _)| *height <= slack);
    let on = sides.into_iter().filter(|(height, _)| near && *height >= -slack);
    let normals: Vec<DVec3> = on.map(|(_, normal)| normal).collect();
    if normals.is_empty() { Vec::new() } else { vec![normals] }
}

/// Returns the distance between `point` and a box; 0 inside the box.
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

/// Returns the unit normal of the triangle `[a, b, c]` if the triangle is within the distance
/// `slack` of `point`; otherwise `None`.
pub fn normal_of_triangle([a, b, c]: [DVec3; 3], point: DVec3, slack: f64) -> Option<DVec3> {
    let normal = (b - a).cross(c - a).try_normalize()?;
    if normal.dot(point - a).abs() > slack {
        return None;
    }
    // The point is inside, or beyond an edge by at most the slack.
    let inside = [(a, b), (b, c), (c, a)].into_iter().all(|(from, to)| {
        let inward = normal.cross(to - from);
        inward.dot(point - from) >= -slack * inward.length()
    });
    inside.then_some(normal)
}

/// Returns the distance between `point` and the triangle `[a, b, c]`.
pub fn triangle_distance([a, b, c]: [DVec3; 3], point: DVec3) -> f64 {
    let (u, v, to) = (b - a, c - a, point - a);
    let normal = u.cross(v);
    let size2 = normal.length_squared();
    let (s, t) = (to.cross(v).dot(normal) / size2, u.cross(to).dot(normal) / size2);
    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        return normal.dot(to).abs() / size2.sqrt();
    }
    [[a, b], [b, c], [c, a]]
        .map(|edge| segment_distance(edge, point))
        .into_iter()
        .fold(f64::INFINITY, f64::min)
}

/// Returns the rows of a matrix.
pub fn rows(m: &DMat3) -> [DVec3; 3] {
    m.transpose().to_cols_array_2d().map(DVec3::from)
}

/// Returns the Frobenius norm of a matrix, an upper bound of the factor by which it scales lengths.
pub fn frobenius_norm(m: &DMat3) -> f64 {
    m.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Returns the factor by which a linear map scales lengths; `None` if the factor depends on the
/// direction by more than rounding errors.
pub fn similarity(linear: &DMat3) -> Option<f64> {
    let gram = linear.transpose() * *linear;
    let square = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    let rest = gram - DMat3::from_diagonal(DVec3::splat(square));
    let largest = rest.to_cols_array().iter().fold(0.0f64, |m, x| m.max(x.abs()));
    (largest <= 1e-13 * square).then(|| square.sqrt())
}
