//! Emission of objects, compiled: the light group of each emissive primitive, and the emitters from
//! which points of objects are sampled.
//!
//! Light is sampled from spheres, flat shapes, convex polyhedra, and meshes of up to
//! [`MAX_TRIANGLES`] triangles. The emission of other shapes is found only by rays that hit them.
//!
//! Points sampled on an emissive object are lifted off its surface. Where another object touches
//! the emissive one, a lifted point is behind the other object's surface: below the floor on which
//! an emissive box stands, or inside of a glass that stands on an emissive floor. Shadow rays that
//! start behind this surface would reach the point, although the other object covers the emissive
//! surface there. Compilation therefore lists the objects that touch an emissive one, if rays can
//! start behind their surfaces. Shadow rays are tested against these objects a second time, up to
//! the surface from which the point was lifted.

use crate::integrator::coincident_surfaces::touching_pairs;
use crate::light_groups::LightGroups;
use crate::world::LightSource;
use glam::DVec3;
use std::collections::{HashMap, HashSet};
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Float, Mask, SimdFloat, next_distinct};
use zerkalo_kernel::primitive::{
    Aggregate, CanonicalShape, ConvexPolyhedronForm, Form, MeshForm, ParallelogramForm, PrimitiveId,
};
use zerkalo_scene::Scene;
use zerkalo_scene::light::{ObjectEmitter, ObjectSurface};
use zerkalo_scene::material::Material;
use zerkalo_scene::value::{sort_by_number, total_order};

/// Largest number of triangles of a mesh from which light is sampled. A triangle takes 56 bytes in
/// single precision.
const MAX_TRIANGLES: usize = 1 << 16;

/// Largest distance behind the surface of a touching object (an object that touches an emissive
/// one) at which points of the emissive object count as covered by the touching object. The unit is
/// the height of the sampled points above the emissive surface.
pub(super) const CONTACT_LIFTS: f64 = 4.0;

/// Emission of an object, with its light group. The emitter is `None` if points of the object
/// cannot be sampled, so that only rays find the emission.
pub(super) type EmissiveSource<S> = LightSource<Option<ObjectEmitter<S>>, S>;

/// Emission of all objects of a scene, compiled. Empty if no object emits light.
#[derive(Default)]
pub(super) struct SurfaceEmission<S> {
    /// Emissive objects; those whose points are sampled come first.
    sources: Vec<EmissiveSource<S>>,
    /// Number of objects from whose surfaces points are sampled. They come first in `sources`.
    sampled: usize,
    /// For each primitive, the index of its emission in `sources`; `None` for primitives that emit
    /// nothing.
    source_of: Vec<Option<u32>>,
    /// For each sampled object, the objects that touch it. An entry has two values: the id of the
    /// touching object's first primitive, and a flag that is `true` if that object is flat.
    touching: Vec<Vec<(u32, bool)>>,
    /// Height of points that are sampled on an emissive object above its surface.
    lift: S,
}

impl<S: Float> SurfaceEmission<S> {
    /// Compiles the emission of objects. `forms` are the shapes of all objects. `lift` is the
    /// height of sampled points above the surfaces. `is_entered` returns `true` for an object that
    /// rays can be inside of.
    pub fn new(
        scene: &Scene,
        forms: &[Form],
        primitives: &[PrimitiveId],
        groups: &LightGroups,
        lift: f64,
        is_entered: impl Fn(usize) -> bool,
    ) -> Self {
        let emitting = groups.materials(scene);
        if emitting.is_empty() {
            return Self::default();
        }
        // Returns three values for a primitive whose material emits: the index of its object, the
        // index of its light group, and its emission.
        let entry_of = |id: &PrimitiveId| {
            let name = scene.objects[id.form].materials()[id.part];
            let (_, group, emission) = emitting.iter().find(|(known, ..)| *known == name)?;
            Some((id.form, *group, *emission))
        };
        let entries: Vec<_> = primitives.iter().map(entry_of).collect();
        let key = |&(form, group, emission): &(usize, usize, [f64; 3])| {
            (form, group, emission.map(f64::to_bits))
        };
        let mut known = HashSet::new();
        let distinct = entries.iter().flatten().filter(|entry| known.insert(key(entry)));
        let objects: Vec<_> = distinct.copied().collect();
        let compile = |&(form, group, emission): &(usize, usize, [f64; 3])| {
            let two_sided = material_of(scene, form).is_none_or(|material| material.two_sided);
            let surface = surface_of(&forms[form]);
            let light = surface.and_then(|surface| ObjectEmitter::new(&surface, two_sided, lift));
            let emission = (emission != [1.0; 3]).then(|| emission.map(S::from_f64));
            LightSource { light, group, emission, visible: true }
        };
        let compiled = objects.iter().map(|object| (*object, compile(object)));
        let (mut all, others): (Vec<_>, Vec<_>) =
            compiled.partition(|(_, source)| source.light.is_some());
        let sampled = all.len();
        all.extend(others);
        let (objects, sources): (Vec<_>, Vec<_>) = all.into_iter().unzip();
        let indices: HashMap<_, u32> = objects.iter().map(key).zip(0..).collect();
        let index_of = |entry: &Option<_>| indices.get(&key(entry.as_ref()?)).copied();
        let source_of = entries.iter().map(index_of).collect();
        let touching = touching_objects(&objects[..sampled], forms, primitives, lift, is_entered);
        Self { sources, sampled, source_of, touching, lift: S::from_f64(lift) }
    }

    /// Returns those of `lanes` in which another object covers the point that was sampled on
    /// emitter number `index`: the point is behind the surface of an object that touches the
    /// emitter. `ray` are the shadow rays to the points, and `distance` is the distance of the
    /// points along them.
    #[inline(always)]
    pub fn covered<L: SimdFloat<Scalar = S>>(
        &self,
        index: usize,
        geometry: &Aggregate<L>,
        (ray, distance): (&Ray<L>, L),
        lanes: L::Mask,
    ) -> L::Mask {
        match self.touching.get(index) {
            Some(touching) if !touching.is_empty() => {
                self.covered_by(touching, geometry, (ray, distance), lanes)
            }
            _ => L::mask(false),
        }
    }

    #[inline(never)]
    fn covered_by<L: SimdFloat<Scalar = S>>(
        &self,
        touching: &[(u32, bool)],
        geometry: &Aggregate<L>,
        (ray, distance): (&Ray<L>, L),
        lanes: L::Mask,
    ) -> L::Mask {
        let lift = L::splat(self.lift) * L::from_f64(CONTACT_LIFTS);
        let mut covered = L::mask(false);
        for (primitive, flat) in touching {
            let limit = L::select(lanes, L::from_f64(L::MAX), L::from_f64(-1.0));
            let hit = geometry.closest_to(*primitive, ray, limit);
            let mut found = lanes & hit.t.lt(limit);
            while let Some((part, part_lanes)) = next_distinct(hit.primitive, found) {
                found = found.and_not(part_lanes);
                let normal = geometry.surface(part, hit.triangle, ray.at(hit.t)).normal;
                // The cosine is positive where a ray leaves a solid, because normals point
                // outwards. A flat object covers points on either side.
                let cosine = normal.dot(ray.direction);
                let cosine = if *flat { cosine.abs() } else { cosine };
                let is_near = ((hit.t - distance) * cosine).le(lift);
                covered = covered | (part_lanes & cosine.gt(L::zero()) & is_near);
            }
        }
        covered
    }

    /// Returns `true` if no object emits light.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Returns the number of emissive objects from which light is sampled, and the number of other
    /// emissive objects.
    pub fn counts(&self) -> [usize; 2] {
        [self.sampled, self.sources.len() - self.sampled]
    }

    /// Returns the emission of `primitive`. Returns `None` if it emits nothing.
    #[inline(always)]
    pub fn of_primitive(&self, primitive: u32) -> Option<&EmissiveSource<S>> {
        let source = *self.source_of.get(primitive as usize)?;
        Some(&self.sources[source? as usize])
    }

    /// Returns two values for the emissive object number `index` from which light is sampled: the
    /// object as an emitter, and its light group and emission. Returns `None` if there is no such
    /// object.
    #[inline(always)]
    pub fn sampled(&self, index: usize) -> Option<(&ObjectEmitter<S>, &EmissiveSource<S>)> {
        let source = self.sources[..self.sampled].get(index)?;
        Some((source.light.as_ref()?, source))
    }

    /// Returns the emissive objects from which light is sampled.
    pub fn emitters(&self) -> impl Iterator<Item = &ObjectEmitter<S>> {
        self.sources.iter().filter_map(|source| source.light.as_ref())
    }
}

/// Returns one list for each of the emissive `objects`: the objects that touch the emissive one, if
/// rays can start behind their surfaces. An entry has two values: the id of the touching object's
/// first primitive, and `true` if that object is flat. `is_entered` returns `true` for an object
/// that rays can be inside of.
fn touching_objects(
    objects: &[(usize, usize, [f64; 3])],
    forms: &[Form],
    primitives: &[PrimitiveId],
    lift: f64,
    is_entered: impl Fn(usize) -> bool,
) -> Vec<Vec<(u32, bool)>> {
    let emits: HashSet<usize> = objects.iter().map(|(form, ..)| *form).collect();
    let mut touching: HashMap<usize, Vec<(u32, bool)>> = HashMap::new();
    let mut first = vec![0; forms.len()];
    for (primitive, source) in (0..).zip(primitives).filter(|(_, source)| source.part == 0) {
        first[source.form] = primitive;
    }
    let is_behind = |form: usize| forms[form].is_flat() || is_entered(form);
    let wanted = |a: usize, b: usize| {
        (emits.contains(&a) && is_behind(b)) || (emits.contains(&b) && is_behind(a))
    };
    // Excludes pairs whose bounds overlap although their surfaces are far apart, such as a lamp and
    // the room around it.
    let is_close = |a: &Form, b: &Form| {
        let ball = a.bounding_sphere();
        b.clearance(ball.center).is_none_or(|distance| distance <= ball.radius + lift)
    };
    for (a, b) in touching_pairs(forms, wanted, lift) {
        if !is_close(&forms[a], &forms[b]) || !is_close(&forms[b], &forms[a]) {
            continue;
        }
        for (form, other) in [(a, b), (b, a)] {
            // A flat emissive object lights both sides of a flat object that it lies on, as a flat
            // light does.
            let both_flat = forms[form].is_flat() && forms[other].is_flat();
            if emits.contains(&form) && is_behind(other) && !both_flat {
                touching.entry(form).or_default().push((first[other], forms[other].is_flat()));
            }
        }
    }
    objects.iter().map(|(form, ..)| touching.get(form).cloned().unwrap_or_default()).collect()
}

/// Returns the material of the object with the number `object`, which must not be a compound.
/// Returns `None` if the scene does not define the material.
fn material_of(scene: &Scene, object: usize) -> Option<&Material> {
    scene.materials.get(&scene.objects[object].material)
}

/// Returns `true` if light can be sampled from points on an object of this shape.
pub(super) fn is_sampled(form: &Form) -> bool {
    match form {
        Form::Sphere(_) | Form::Parallelogram(_) | Form::ConvexPolyhedron(_) => true,
        Form::Mesh(form) => form.mesh.mesh().triangles.len() <= MAX_TRIANGLES,
        Form::Ellipsoid(_)
        | Form::ConicalFrustum(_)
        | Form::Csg(_)
        | Form::Plane(_)
        | Form::Torus(_) => false,
    }
}

/// Returns the surface of an object from which light is sampled, or `None` if its points cannot be
/// sampled.
fn surface_of(form: &Form) -> Option<ObjectSurface> {
    if !is_sampled(form) {
        return None;
    }
    match form {
        Form::Sphere(sphere) => {
            Some(ObjectSurface::Sphere { center: sphere.center, radius: sphere.radius })
        }
        Form::Parallelogram(form) => Some(surface_of_parallelogram(form)),
        Form::ConvexPolyhedron(form) => {
            Some(ObjectSurface::ConvexTriangles(triangles_of_polyhedron(form)))
        }
        Form::Mesh(form) => Some(ObjectSurface::Triangles(triangles_of_mesh(form, 1).collect())),
        _ => None,
    }
}

fn surface_of_parallelogram(form: &ParallelogramForm) -> ObjectSurface {
    let ParallelogramForm { corner, u, v } = *form;
    let size = [u.length(), v.length()];
    let far = corner + u + v;
    if u.dot(v).abs() > 1e-12 * size[0] * size[1] {
        return ObjectSurface::Triangles(vec![
            [corner, corner + u, far],
            [corner, far, corner + v],
        ]);
    }
    let (right, up) = (u / size[0], v / size[1]);
    ObjectSurface::Rectangle {
        center: 0.5 * (corner + far),
        axes: [right, up, right.cross(up)],
        size,
    }
}

/// Returns the faces of a polyhedron as triangles, counter-clockwise as seen from outside.
pub(super) fn triangles_of_polyhedron(form: &ConvexPolyhedronForm) -> Vec<[DVec3; 3]> {
    let slack = 1e-6 * form.thickness();
    let mut triangles = Vec::new();
    for face in &form.faces {
        let is_on_face = |corner: &&DVec3| (face.normal.dot(**corner) - face.offset).abs() <= slack;
        let mut corners: Vec<DVec3> = form.corners.iter().filter(is_on_face).copied().collect();
        if corners.len() < 3 {
            continue;
        }
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let (right, up) = face.normal.any_orthonormal_pair();
        let side = right.cross(up).dot(face.normal).signum();
        let angle = |corner: &DVec3| {
            let from_middle = *corner - middle;
            (side * from_middle.dot(up)).atan2(from_middle.dot(right))
        };
        sort_by_number(&mut corners, |corner| total_order(angle(corner)));
        triangles.extend(corners[1..].windows(2).map(|pair| [corners[0], pair[0], pair[1]]));
    }
    triangles
}

/// Returns triangles of the mesh in scene coordinates, counter-clockwise as seen from their front:
/// all if `step` is 1, otherwise each `step`-th.
pub(super) fn triangles_of_mesh(
    form: &MeshForm,
    step: usize,
) -> impl Iterator<Item = [DVec3; 3]> + '_ {
    let mesh = form.mesh.mesh();
    let mirrored = form.scene_from_mesh.matrix3.determinant() < 0.0;
    let corner = |i: u32| {
        let position = mesh.positions[i as usize].map(f64::from);
        form.scene_from_mesh.transform_point3(DVec3::from(position))
    };
    let in_order = move |&[a, b, c]: &[u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
    mesh.triangles.iter().step_by(step).map(move |triangle| in_order(triangle).map(corner))
}
