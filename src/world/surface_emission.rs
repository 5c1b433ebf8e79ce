//! Emission of objects, compiled: the light group of each emissive primitive, and the emitters from
//! which points of objects are sampled.
//!
//! Light is sampled from spheres, flat shapes, convex polyhedra, and meshes of up to
//! [`MAX_TRIANGLES`] triangles. The emission of other shapes is found only by rays that hit them.

use crate::lanes::Float;
use crate::light::{ObjectEmitter, ObjectSurface};
use crate::material::Material;
use crate::primitive::{
    CanonicalShape, ConvexPolyhedronForm, Form, MeshForm, ParallelogramForm, PrimitiveId,
};
use crate::scene::Scene;
use crate::world::integrator::coincident_surfaces::pairs;
use crate::world::light_groups::LightGroups;
use crate::world::world::LightSource;
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// Largest number of triangles of a mesh from which light is sampled. A triangle takes 56 bytes in
/// single precision.
const MAX_TRIANGLES: usize = 1 << 16;

/// Smallest cosine between the normals of parallel faces.
const PARALLEL: f64 = 1.0 - 1e-6;

/// Emission of an object, with its light group. The emitter is `None` if points of the object
/// cannot be sampled.
pub(super) type EmissiveSource<S> = LightSource<Option<ObjectEmitter<S>>, S>;

/// Emission of all objects of a world. Empty if no object emits light.
pub(super) struct SurfaceEmission<S> {
    /// Emissive objects; those whose points are sampled come first.
    sources: Vec<EmissiveSource<S>>,
    /// Number of objects from whose surfaces points are sampled. They come first in `sources`.
    sampled: usize,
    /// Index into `sources`, for each primitive; `None` for primitives that emit nothing.
    source_of: Vec<Option<u32>>,
}

impl<S: Float> SurfaceEmission<S> {
    /// Compiles the emission of objects. `forms` are the shapes of all objects. `lift` is the
    /// height of sampled points above the surfaces.
    pub fn new(
        scene: &Scene,
        forms: &[Form],
        primitives: &[PrimitiveId],
        groups: &LightGroups,
        lift: f64,
    ) -> Self {
        let emitting = groups.materials(scene);
        if emitting.is_empty() {
            return Self { sources: Vec::new(), sampled: 0, source_of: Vec::new() };
        }
        // The group of each primitive, by object.
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
        let emits: HashSet<usize> = objects.iter().map(|(form, ..)| *form).collect();
        let is_solid = |form: usize| matches!(forms[form], Form::ConvexPolyhedron(_));
        let lights = |form: usize| emits.contains(&form) && is_solid(form);
        let mut neighbors: HashMap<usize, Vec<&Form>> = HashMap::new();
        for (a, b) in pairs(forms, |a, b| lights(a) || lights(b)) {
            for (form, other) in [(a, b), (b, a)] {
                if lights(form) && forms[other].is_convex() {
                    neighbors.entry(form).or_default().push(&forms[other]);
                }
            }
        }
        let compile = |&(form, group, emission): &(usize, usize, [f64; 3])| {
            let two_sided = material_of(scene, form).is_none_or(|material| material.two_sided);
            let surface = surface_of(&forms[form]);
            let light = surface.and_then(|surface| {
                let light = ObjectEmitter::new(&surface, two_sided, lift)?;
                let (ObjectSurface::ConvexTriangles(triangles), Some(others)) =
                    (&surface, neighbors.get(&form))
                else {
                    return Some(light);
                };
                let is_covered = |triangle: &[DVec3; 3]| {
                    others.iter().any(|other| covers(other, triangle, lift))
                };
                let covered: Vec<bool> = triangles.iter().map(is_covered).collect();
                Some(light.without_covered(&covered))
            });
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
        Self { sources, sampled, source_of: entries.iter().map(index_of).collect() }
    }

    /// Returns `true` if no object emits light.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Number of emissive objects from which light is sampled, and number of other emissive
    /// objects.
    pub fn counts(&self) -> [usize; 2] {
        [self.sampled, self.sources.len() - self.sampled]
    }

    /// Emission of primitive `item`. `None` if it emits nothing.
    #[inline(always)]
    pub fn of_item(&self, item: u32) -> Option<&EmissiveSource<S>> {
        let source = *self.source_of.get(item as usize)?;
        Some(&self.sources[source? as usize])
    }

    /// Returns emitter number `index` among those from which light is sampled, and its source
    /// (light group and emission).
    #[inline(always)]
    pub fn sampled(&self, index: usize) -> Option<(&ObjectEmitter<S>, &EmissiveSource<S>)> {
        let source = self.sources[..self.sampled].get(index)?;
        Some((source.light.as_ref()?, source))
    }

    /// Emitters from which light is sampled.
    pub fn emitters(&self) -> impl Iterator<Item = &ObjectEmitter<S>> {
        self.sources.iter().filter_map(|source| source.light.as_ref())
    }
}

/// Returns `true` if the convex form `other` covers the front of a triangle: all corners are within
/// `slack` of one of its faces, which is parallel to the triangle. A solid faces the triangle's
/// front; a flat form may face either side.
fn covers(other: &Form, triangle: &[DVec3; 3], slack: f64) -> bool {
    let [a, b, c] = *triangle;
    let Some(normal) = (b - a).cross(c - a).try_normalize() else { return false };
    let faces_front = |found: &DVec3| {
        let cosine = found.dot(normal);
        if other.is_flat() { cosine.abs() > PARALLEL } else { cosine < -PARALLEL }
    };
    let is_on_face =
        |corner: &DVec3| other.normals_at(*corner, slack).iter().flatten().any(faces_front);
    triangle.iter().all(is_on_face)
}

/// Returns the material of an object that is not a compound.
fn material_of(scene: &Scene, object: usize) -> Option<&Material> {
    scene.materials.get(&scene.objects[object].material)
}

/// Returns `true` if points of `form` can be sampled.
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

/// Returns the surface of `form`, or `None` if its points cannot be sampled.
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
        Form::Mesh(form) => Some(ObjectSurface::Triangles(triangles_of_mesh(form))),
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

/// Returns the triangles of all faces, counter-clockwise as seen from outside.
fn triangles_of_polyhedron(form: &ConvexPolyhedronForm) -> Vec<[DVec3; 3]> {
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
        corners.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        triangles.extend(corners[1..].windows(2).map(|pair| [corners[0], pair[0], pair[1]]));
    }
    triangles
}

/// Returns the triangles of the mesh in scene coordinates, counter-clockwise as seen from their
/// front.
fn triangles_of_mesh(form: &MeshForm) -> Vec<[DVec3; 3]> {
    let mesh = form.mesh.mesh();
    let mirrored = form.scene_from_mesh.matrix3.determinant() < 0.0;
    let corner = |i: u32| {
        let position = mesh.positions[i as usize].map(f64::from);
        form.scene_from_mesh.transform_point3(DVec3::from(position))
    };
    let triangle = |&[a, b, c]: &[u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] }.map(corner);
    mesh.triangles.iter().map(triangle).collect()
}
