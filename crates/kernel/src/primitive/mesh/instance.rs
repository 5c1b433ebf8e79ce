//! Meshes as primitives. A ray is transformed into the space of the mesh and traverses the mesh's
//! BVH there. Coordinates of a mesh are in single precision for every SIMD type; computation has
//! the precision of the lanes.

use crate::bvh::{Hit, Ray};
use crate::lanes::{Float, MAX_WIDTH, Mask, SimdFloat, Vec3};
use crate::primitive::aggregate::primitive_box::PrimitiveBox;
use crate::primitive::canonical::{
    Bounds, CanonicalShape, Projection, Proxy, box_distance, frobenius_norm, normal_of_triangle,
    rows, triangle_distance,
};
use crate::primitive::compiled::{Primitive, SurfacePoint, TexCoord};
use crate::primitive::keep_visible;
use crate::primitive::mesh::{CornerNormals, Mesh, TriangleMesh, intersection};
use glam::{DAffine3, DVec3};
use std::sync::Arc;

/// Assumed ratio of a mesh's extent to the size of its smallest details, for the choice of single
/// or double precision.
pub(super) const EXTENT_PER_DETAIL: f64 = 64.0;

/// Largest ratio of a triangle's length to its height for which single precision suffices.
const MAX_SINGLE_ASPECT: f64 = 1e4;

/// Square of the sine of an angle between a triangle and a tangent plane that is a rounding error of
/// normals in single precision.
const FLATTEST: f64 = 1e-12;

/// Shading normals of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MeshNormals {
    /// Normal of each triangle.
    Flat,
    /// Normals of the vertices in the file, interpolated.
    OfVertices,
    /// Means of the adjacent triangles, divided by creases above this angle \[degrees\].
    Creased(f64),
}

/// Image of a triangle mesh under an invertible affine map.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshForm {
    /// Triangles in the space of the mesh.
    pub mesh: Arc<Mesh>,
    /// Map from the space of the mesh to the scene.
    pub scene_from_mesh: DAffine3,
    /// Normals for shading.
    pub normals: MeshNormals,
}

impl MeshForm {
    pub(in crate::primitive) fn transformed(self, map: &DAffine3) -> Self {
        Self { scene_from_mesh: *map * self.scene_from_mesh, ..self }
    }
}

impl CanonicalShape for MeshForm {
    fn bounds(&self) -> Option<Bounds> {
        let m = &self.scene_from_mesh;
        let rows = rows(&m.matrix3);
        let high = rows.map(|row| self.mesh.support(row));
        let low = rows.map(|row| -self.mesh.support(-row));
        Some((m.translation + DVec3::from(low), m.translation + DVec3::from(high)))
    }

    fn oriented_box(&self) -> Option<(DAffine3, Bounds)> {
        let [low, high] = self.mesh.mesh.bounds.map(|c| DVec3::from(c.map(f64::from)));
        Some((self.scene_from_mesh, (low, high)))
    }

    fn thickness(&self) -> f64 {
        let [low, high] = self.mesh.mesh.bounds.map(|corner| DVec3::from(corner.map(f64::from)));
        let m = self.scene_from_mesh.matrix3;
        let stretched = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::length);
        let size = ((high - low) * DVec3::from(stretched)).to_array();
        let longest = size.into_iter().fold(0.0, f64::max);
        // A needle or a thin sheet is as thick as the shortest side of its bounding box. Sides of
        // length 0 are left out, because a flat mesh encloses no volume.
        let thinnest = size.into_iter().filter(|s| *s > 0.0).fold(f64::INFINITY, f64::min);
        let aspect = Some(self.mesh.aspect).filter(|aspect| *aspect > MAX_SINGLE_ASPECT);
        thinnest.min(longest / aspect.unwrap_or(EXTENT_PER_DETAIL))
    }

    fn clearance(&self, point: DVec3) -> Option<f64> {
        let away = box_distance(self.bounds()?, point);
        let inside = || surface_distance(&self.mesh, &self.scene_from_mesh, point);
        Some(if away > 0.0 { away } else { inside() })
    }

    fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>> {
        let Some((low, high)) = self.bounds() else { return Vec::new() };
        if point.cmplt(low - slack).any() || point.cmpgt(high + slack).any() {
            return Vec::new();
        }
        let mesh = &self.mesh.mesh;
        let corner = |i: u32| {
            let position = mesh.positions[i as usize].map(f64::from);
            self.scene_from_mesh.transform_point3(DVec3::from(position))
        };
        let mut normals: Vec<DVec3> = Vec::new();
        for triangle in &mesh.triangles {
            let Some(normal) = normal_of_triangle(triangle.map(corner), point, slack) else {
                continue;
            };
            if normals.iter().all(|known| known.distance(normal) > 1e-3) {
                normals.push(normal);
            }
        }
        if normals.is_empty() { Vec::new() } else { vec![normals] }
    }

    fn default_mapping(&self) -> Projection {
        match self.mesh.mesh.uvs {
            Some(_) => Projection::Uv,
            None => Projection::Box,
        }
    }

    /// Returns none: a mesh has many faces, and its corners are in single precision.
    fn proxies(&self) -> Vec<Proxy> {
        Vec::new()
    }

    fn triangles(&self) -> usize {
        self.mesh.mesh.triangles.len()
    }

    fn max_lift(&self) -> f64 {
        let depth = match self.normals {
            MeshNormals::Flat => 0.0,
            MeshNormals::OfVertices => self.mesh.depth,
            MeshNormals::Creased(degrees) => self.mesh.creased_normals(degrees).depth,
        };
        depth * frobenius_norm(&self.scene_from_mesh.matrix3)
    }
}

/// Returns the distance between `point` and the closest triangle of the mesh, in scene units.
fn surface_distance(mesh: &Mesh, scene_from_mesh: &DAffine3, point: DVec3) -> f64 {
    let inverse = scene_from_mesh.inverse();
    let inside = inverse.transform_point3(point);
    // Lower bound of the ratio of a length in the scene to the same length in mesh space.
    let shrinks = frobenius_norm(&inverse.matrix3).recip();
    let to_scene = |corner: DVec3| scene_from_mesh.transform_point3(corner);
    mesh.least(
        |bounds| box_distance(bounds, inside) * shrinks,
        |corners| triangle_distance(corners.map(to_scene), point),
    )
}

/// Mesh placed in the scene, compiled for ray intersection.
pub struct MeshInstance<S> {
    mesh: Arc<Mesh>,
    /// Bounding box of the mesh in the scene. Rays that miss it are not transformed.
    extent: PrimitiveBox<S>,
    /// Columns of the linear map from scene space to mesh space.
    mesh_from_scene: [[S; 3]; 3],
    /// Centre of the mesh's bounding box in scene space. Points are transformed relative to it, so
    /// that the rounding error of the linear map is in proportion to their distance from the
    /// centre.
    center: [S; 3],
    /// Centre of the mesh's bounding box in mesh space.
    mesh_center: [S; 3],
    reach: S,
    /// `true` if shading normals are interpolated between vertices.
    pub smooth: bool,
    creased: Option<Arc<CornerNormals>>,
}

/// Corners of one mesh triangle per lane, in the space of the mesh.
struct Triangle<L> {
    corners: [Vec3<L>; 3],
}

impl<S: Float> MeshInstance<S> {
    /// Compiles a placed mesh; `None` for a mesh without finite bounds.
    pub fn of(form: &MeshForm) -> Option<Self> {
        let MeshForm { mesh, scene_from_mesh, normals } = form;
        let [low, high] = mesh.mesh.bounds.map(|c| DVec3::from(c.map(f64::from)));
        let middle = (0.5 * (low + high)).as_vec3().as_dvec3();
        let inverse = scene_from_mesh.matrix3.inverse();
        let columns = [inverse.x_axis, inverse.y_axis, inverse.z_axis];
        let linear = scene_from_mesh.matrix3;
        let scale = [linear.x_axis, linear.y_axis, linear.z_axis]
            .into_iter()
            .map(DVec3::length)
            .fold(0.0, f64::max);
        // Rounding errors in mesh space are at most the error of the largest coordinate of a
        // corner. This coordinate is converted to scene units.
        let inner = low.abs().max(high.abs()).max_element() * scale;
        let outer = form.max_coordinate();
        Some(Self {
            mesh: mesh.clone(),
            extent: PrimitiveBox::new(form, false)?,
            mesh_from_scene: columns.map(|c| c.to_array().map(S::from_f64)),
            center: scene_from_mesh.transform_point3(middle).to_array().map(S::from_f64),
            mesh_center: middle.to_array().map(S::from_f64),
            reach: S::from_f64(outer.max(inner)),
            smooth: *normals != MeshNormals::Flat,
            creased: match normals {
                MeshNormals::Creased(degrees) => Some(mesh.creased_normals(*degrees)),
                MeshNormals::Flat | MeshNormals::OfVertices => None,
            },
        })
    }

    #[inline(always)]
    fn vector<L: SimdFloat<Scalar = S>>(&self, v: Vec3<L>) -> Vec3<L> {
        let [x, y, z] = self.mesh_from_scene.map(Vec3::splat);
        x * v.x + y * v.y + z * v.z
    }

    /// Transforms the normal `n` to the scene. The result is not normalised.
    #[inline(always)]
    fn normal<L: SimdFloat<Scalar = S>>(&self, n: Vec3<L>) -> Vec3<L> {
        let [x, y, z] = self.mesh_from_scene.map(Vec3::splat);
        Vec3::new(x.dot(n), y.dot(n), z.dot(n))
    }

    #[inline(always)]
    fn point<L: SimdFloat<Scalar = S>>(&self, p: Vec3<L>) -> Vec3<L> {
        self.vector(p - Vec3::splat(self.center)) + Vec3::splat(self.mesh_center)
    }

    /// Returns each ray in mesh space, and the length there of a step that has length 1 in the
    /// scene.
    #[inline(always)]
    fn ray<L: SimdFloat<Scalar = S>>(&self, ray: &Ray<L>) -> (Ray<L>, L) {
        let direction = self.vector(ray.direction);
        let length = direction.length_squared().sqrt();
        let direction = direction * (L::one() / length);
        (Ray { origin: self.point(ray.origin), direction }, length)
    }

    /// Returns an attribute of `N` numbers at the three corners of the triangle `triangle_tag`.
    /// `corners` has the indices in `of_vertices` of each triangle.
    #[inline(always)]
    fn attribute<const N: usize, L: SimdFloat<Scalar = S>>(
        &self,
        triangle_tag: L,
        corners: &[[u32; 3]],
        of_vertices: &[[f32; N]],
    ) -> [[L; N]; 3] {
        // Indices: vertex, component, lane. Each triangle and each vertex is read once.
        let mut values = [[[S::default(); MAX_WIDTH]; N]; 3];
        for lane in 0..L::WIDTH {
            // A lane that hits another primitive may hold any triangle id.
            let triangle = (triangle_tag.id_lane(lane) as usize).min(corners.len() - 1);
            for (vertex, values) in corners[triangle].into_iter().zip(&mut values) {
                for (x, values) in of_vertices[vertex as usize].into_iter().zip(values) {
                    values[lane] = S::from_f64(f64::from(x));
                }
            }
        }
        let vector = |values: &[S; MAX_WIDTH]| L::from_fn(|i| values[i]);
        let [a, b, c] = &values;
        [a, b, c].map(|components| components.each_ref().map(vector))
    }

    #[inline(always)]
    fn triangle<L: SimdFloat<Scalar = S>>(&self, triangle_tag: L) -> Triangle<L> {
        let TriangleMesh { triangles, positions, .. } = &self.mesh.mesh;
        let corners = self.attribute(triangle_tag, triangles, positions);
        Triangle { corners: corners.map(|[x, y, z]| Vec3::new(x, y, z)) }
    }
}

impl<L: SimdFloat> Triangle<L> {
    /// Returns the normal on the triangle's front, with twice the triangle's area as its length.
    #[inline(always)]
    fn normal(&self) -> Vec3<L> {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a)
    }

    /// Returns [`Self::normal`], more exactly.
    #[inline(always)]
    fn exact_normal(&self) -> Vec3<L> {
        let [a, b, c] = self.corners;
        (b - a).exact_cross(c - a)
    }

    /// Returns the gradients of the barycentric weights of the second and of the third corner.
    #[inline(always)]
    fn gradients(&self) -> [Vec3<L>; 2] {
        let [a, b, c] = self.corners;
        let (to_b, to_c) = (b - a, c - a);
        let normal = to_b.cross(to_c);
        let inverse = L::one() / normal.length_squared();
        [to_c.cross(normal) * inverse, normal.cross(to_b) * inverse]
    }

    /// Returns approximate barycentric weights, at least 0, of the triangle's point closest to `p`.
    #[inline(always)]
    fn weights(&self, p: Vec3<L>) -> [L; 3] {
        let normal = self.normal();
        let [a, b, c] = self.corners.map(|c| c - p);
        let part = |a: Vec3<L>, b| normal.dot(a.cross(b)).max(L::zero());
        let parts = [part(b, c), part(c, a), part(a, b)];
        let inverse = L::one() / (parts[0] + parts[1] + parts[2]);
        parts.map(|part| part * inverse)
    }
}

impl<L: SimdFloat> Primitive<L> for MeshInstance<L::Scalar> {
    #[inline(never)]
    fn closest(&self, id: u32, ray: &Ray<L>, hit: &mut Hit<L>) {
        let near = self.extent.meets(ray, hit.t);
        if near.none() {
            return;
        }
        let (inner, length) = self.ray(ray);
        // The distance limit in mesh space is enlarged by the rounding error of the transform.
        // Whether a hit is closer than earlier hits is decided below by distances in the scene, so
        // that the result does not depend on the order of the primitives.
        let limit = hit.t * length * L::from_f64(1.0 + 4.0 * L::EPSILON);
        let limit = L::select(near, limit, L::from_f64(-1.0));
        let found = intersection::closest(&self.mesh, &inner, limit);
        let hit_mask = found.t.lt(limit);
        let before = hit.t;
        hit.keep_closer(hit_mask, found.t / length, id);
        hit.triangle = L::select(hit.t.lt(before), found.triangle, hit.triangle);
    }

    #[inline(never)]
    fn occluded(&self, ray: &Ray<L>, limit: L, wanted: L::Mask) -> Option<L::Mask> {
        if wanted.none() {
            return None;
        }
        let open = wanted & self.extent.meets(ray, limit);
        if open.none() {
            return None;
        }
        let (inner, length) = self.ray(ray);
        let limit = L::select(open, limit * length, L::from_f64(-1.0));
        Some(intersection::occluded(&self.mesh, &inner, limit))
    }

    /// Returns the projection of `point` onto the plane of `triangle`.
    #[inline(never)]
    fn surface(&self, triangle: L, point: Vec3<L>) -> SurfacePoint<L> {
        let triangle = self.triangle(triangle);
        // The normal is scaled so that its squared length neither overflows nor vanishes.
        let flat = if self.mesh.thin { triangle.exact_normal() } else { triangle.normal() };
        let largest = flat.max_abs();
        let sound = largest.gt(L::zero());
        let flat = Vec3::select(sound, flat * (L::one() / largest), Vec3::of([0.0, 0.0, 1.0]));
        let height = flat.dot(self.point(point) - triangle.corners[0]);
        let normal = self.normal(flat);
        let inverse = L::one() / normal.length_squared().sqrt();
        let normal = normal * inverse;
        let point = normal.mul_add(-height * inverse, point);
        SurfacePoint { point, normal, max_coordinate: L::splat(self.reach) }
    }

    #[inline(never)]
    fn uv(&self, triangle: L, point: Vec3<L>) -> Option<TexCoord<L>> {
        let mesh = &self.mesh.mesh;
        let corners = self.attribute(triangle, &mesh.triangles, mesh.uvs.as_deref()?);
        let triangle = self.triangle(triangle);
        let weights = triangle.weights(self.point(point));
        let gradient = triangle.gradients();
        let along = |k: usize| {
            let [a, b, c] = corners.map(|pair| pair[k]);
            let value = a * weights[0] + b * weights[1] + c * weights[2];
            (value, gradient[0] * (b - a) + gradient[1] * (c - a))
        };
        let ((u, grad_u), (v, grad_v)) = (along(0), along(1));
        Some(TexCoord { u, v, grad_u, grad_v })
    }
}

impl<S: Float> MeshInstance<S> {
    /// Returns the shading normal and the lift at `at`; see
    /// [`shading_normal`](crate::primitive::Aggregate::shading_normal).
    #[inline(never)]
    pub fn shading_normal<L: SimdFloat<Scalar = S>>(
        &self,
        triangle: L,
        at: &SurfacePoint<L>,
        direction: Vec3<L>,
    ) -> (Vec3<L>, Option<Vec3<L>>) {
        let flat = (at.normal, None);
        if !self.smooth {
            return flat;
        }
        let point = self.point(at.point);
        let plane = self.triangle(triangle);
        let weights = plane.weights(point);
        let (corners, normals) = match (&self.creased, &self.mesh.mesh.normals) {
            (Some(creased), _) => (&creased.corners, &creased.normals),
            (None, Some(normals)) => (&self.mesh.mesh.triangles, normals),
            (None, None) => return flat,
        };
        let normals = self.attribute(triangle, corners, normals);
        let normals = normals.map(|[x, y, z]| Vec3::new(x, y, z));
        let [a, b, c] = normals;
        let smooth = self.normal(a * weights[0] + b * weights[1] + c * weights[2]);
        let smooth = smooth * (L::one() / smooth.length_squared().sqrt());
        // `smooth` is NaN if the vertex normals cancel or the triangle has no area. `keep_visible`
        // replaces it by the geometric normal.
        let normal = keep_visible(smooth, at.normal, direction);
        let outward = L::select(smooth.dot(at.normal).lt(L::zero()), -L::one(), L::one());
        let mut lift = Vec3::zero();
        for k in 0..3 {
            let to_corner = plane.corners[k] - point;
            let depth = normals[k].dot(to_corner) * outward;
            let is_deep = depth.gt(L::zero())
                & (depth * depth).gt(to_corner.length_squared() * L::from_f64(FLATTEST));
            let up = self.normal(normals[k]);
            let scale = weights[k] * depth * outward / up.length_squared();
            lift += (up * scale).masked(is_deep);
        }
        let is_up = lift.dot(at.normal).gt(L::zero()) & lift.max_abs().lt(L::from_f64(L::MAX));
        (normal, Some(lift.masked(is_up)))
    }

    /// Returns the colour of `triangle` in the mesh file; `None` if the file has no colours.
    #[inline(never)]
    pub fn color<L: SimdFloat<Scalar = S>>(&self, triangle: L) -> Option<Vec3<L>> {
        let mesh = &self.mesh.mesh;
        mesh.color(0)?;
        let number = |lane| (triangle.id_lane(lane) as usize).min(mesh.triangles.len() - 1);
        let white = [1.0; 3];
        Some(Vec3::from_fn(|lane| {
            mesh.color(number(lane)).unwrap_or(white).map(|x| S::from_f64(f64::from(x)))
        }))
    }

    /// Returns `true` if the mesh has vertex or face colours.
    pub fn is_colored(&self) -> bool {
        self.mesh.mesh.color(0).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the lift over a triangle with its corners on the unit sphere: at its centre, at the
    /// distance d from the centre of the sphere, the projections onto the three tangent planes have
    /// the mean distance d (2 - d^2). From inside, the sphere is concave.
    #[test]
    fn lift_of_a_triangle_in_a_sphere() {
        let positions = vec![[0.8, 0.6, 0.0], [0.0, 0.8, 0.6], [0.6, 0.0, 0.8]];
        let [low, high] = [[0.0; 3], [0.8; 3]];
        let mesh = TriangleMesh {
            normals: Some(positions.clone()),
            positions,
            center: [0.0; 3],
            triangles: vec![[0, 1, 2]],
            is_flat: false,
            uvs: None,
            colors: Vec::new(),
            color_of: Vec::new(),
            bounds: [low, high],
            notes: Vec::new(),
        };
        let mesh = Arc::new(Mesh::new(mesh));
        let middle = DVec3::splat(1.4 / 3.0);
        let expected = middle * (1.0 - middle.length_squared());
        let lift = |normals, scale: f64, side: f64| {
            let scene_from_mesh = DAffine3::from_scale(DVec3::splat(scale));
            let form = MeshForm { mesh: mesh.clone(), scene_from_mesh, normals };
            let vector = |v: DVec3| Vec3::<f64>::of(v.to_array());
            let normal = vector(DVec3::ONE.normalize() * side);
            let at = SurfacePoint { point: vector(middle * scale), normal, max_coordinate: scale };
            let instance = MeshInstance::<f64>::of(&form).unwrap();
            let (_, lift) = instance.shading_normal(0.0, &at, -normal);
            let lift = lift.map_or(DVec3::ZERO, |lift| DVec3::new(lift.x, lift.y, lift.z));
            assert!(lift.length() <= form.max_lift(), "{lift}");
            lift / scale
        };
        for scale in [1e-6, 1.0, 300.0] {
            let outside = lift(MeshNormals::OfVertices, scale, 1.0);
            assert!(outside.distance(expected) < 1e-6, "{outside}, not {expected}");
            assert_eq!(lift(MeshNormals::OfVertices, scale, -1.0), DVec3::ZERO);
            assert_eq!(lift(MeshNormals::Creased(180.0), scale, 1.0), DVec3::ZERO);
            assert_eq!(lift(MeshNormals::Flat, scale, 1.0), DVec3::ZERO);
        }
    }

    #[test]
    fn triangle_distance_to_face_edge_and_corner() {
        let point = DVec3::new(0.3, 0.2, 0.1);
        let [a, b, c] = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert!((triangle_distance([a, b, c], point) - 0.1).abs() < 1e-15);
        assert!(
            (triangle_distance([a, b, c], DVec3::new(1.0, 1.0, 0.0)) - 0.5f64.sqrt()).abs() < 1e-15
        );
        assert!((triangle_distance([a, b, c], DVec3::new(-1.0, 0.0, 0.0)) - 1.0).abs() < 1e-15);
        assert!((triangle_distance([a, b, c], DVec3::new(0.5, -2.0, 0.0)) - 2.0).abs() < 1e-15);
    }
}
