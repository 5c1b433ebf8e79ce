//! Batches of compiled primitives: one array for each kind of primitive that the scene contains. A
//! kind that the scene does not contain costs nothing.

use crate::bvh::{Hit, Ray};
use crate::lanes::{Mask, SimdFloat, Vec3};
use crate::primitive::conical_frustum::ConicalFrustum;
use crate::primitive::convex_polyhedron::ConvexPolyhedron;
use crate::primitive::csg::Compounds;
use crate::primitive::ellipsoid::Ellipsoid;
use crate::primitive::form::Form;
use crate::primitive::mesh::instance::Meshes;
use crate::primitive::parallelogram::Parallelogram;
use crate::primitive::plane::Plane;
use crate::primitive::sphere::Sphere;
use crate::primitive::torus::Torus;
use std::ops::Range;

/// Point on the surface of a primitive where a ray hits it, one per lane.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<L> {
    /// Hit point, projected onto the surface as exactly as the precision of the lanes allows.
    pub point: Vec3<L>,
    /// Unit geometric normal. It points out of a solid, and to the front of a flat shape.
    pub normal: Vec3<L>,
    /// Largest magnitude of the coordinates from which the hit point was computed. The rounding
    /// error of the point is a few units in the last place of this value.
    pub max_coordinate: L,
}

/// Texture coordinates at one point of a primitive, with their gradients.
#[derive(Clone, Copy, Debug)]
pub struct UvGradients<L> {
    /// Texture coordinates: u to the right, v up.
    pub uv: [L; 2],
    /// Gradients of u and v along the surface, in the space of the shape: changes per unit of
    /// length.
    pub gradients: [Vec3<L>; 2],
}

impl<L: SimdFloat> SurfacePoint<L> {
    /// Returns the distance from the surface at which secondary rays start: a few rounding errors
    /// of [`SurfacePoint::max_coordinate`].
    #[inline(always)]
    pub fn ray_offset(&self) -> L {
        self.max_coordinate.max(self.point.max_abs()) * L::from_f64(8.0 * L::EPSILON)
    }
}

/// Primitive compiled for the kernels of one SIMD type.
pub trait Primitive<L: SimdFloat> {
    /// Returns two values: the smallest distance at which each ray hits the primitive, and the
    /// lanes that hit it. Only distances greater than 0 are hits. Returns `None` if no lane hits.
    fn intersect(&self, ray: &Ray<L>) -> Option<(L, L::Mask)>;

    /// Returns the projection of `point` onto the surface, with the normal there. `point` is the
    /// computed hit point of a ray, with rounding errors.
    fn surface(&self, point: Vec3<L>) -> SurfacePoint<L>;

    /// Returns the texture coordinates, with gradients, that the primitive's own parametrisation
    /// has at a point. Returns `None` for primitives that have no parametrisation.
    fn uv(&self, _point: Vec3<L>) -> Option<UvGradients<L>> {
        None
    }
}

macro_rules! batches {
    ($($(#[$doc:meta])+ $kind:ident($primitive:ident)),+ $(,)?) => {
        /// Batch: all primitives of one kind, compiled for one SIMD type.
        pub enum PrimitiveBatch<L: SimdFloat> {
            $($(#[$doc])+ $kind(Vec<$primitive<L::Scalar>>),)+
            /// Batch of compound solids (CSG). Each part of a compound counts as a primitive.
            Compounds(Compounds<L::Scalar>),
            /// Batch of triangle meshes; each mesh is one primitive.
            Meshes(Meshes<L::Scalar>),
        }

        /// Evaluates one of three expressions for a [`PrimitiveBatch`]: the first for an array of
        /// primitives, the second for compounds, the third for meshes.
        macro_rules! each {
            ($batch:expr, $primitives:ident => $value:expr, $compounds:ident => $other:expr,
                $meshes:ident => $third:expr) => {
                match $batch {
                    $(PrimitiveBatch::$kind($primitives) => $value,)+
                    PrimitiveBatch::Compounds($compounds) => $other,
                    PrimitiveBatch::Meshes($meshes) => $third,
                }
            };
        }

        /// Compiles the canonical forms `forms` into one batch for each kind of primitive that
        /// occurs.
        pub fn compile<L: SimdFloat>(forms: &[Form]) -> Vec<LabelledBatch<L>> {
            let mut out = Vec::new();
            $(
                let primitives = forms.iter().enumerate().filter_map(|(form, f)| {
                    Some((PrimitiveId { form, part: 0 }, $primitive::new(f)?))
                });
                let (sources, primitives): (Vec<_>, Vec<_>) = primitives.unzip();
                out.extend(LabelledBatch::new(PrimitiveBatch::$kind(primitives), sources, forms));
            )+
            let sources_of = |wanted: fn(&Form) -> bool| -> Vec<_> {
                let matching = forms.iter().enumerate().filter(|(_, f)| wanted(f));
                let parts = |(form, f): (usize, &Form)| {
                    (0..f.parts()).map(move |part| PrimitiveId { form, part })
                };
                matching.flat_map(parts).collect()
            };
            let sources = sources_of(|f| matches!(f, Form::Csg(_)));
            let compounds = PrimitiveBatch::Compounds(Compounds::new(forms));
            out.extend(LabelledBatch::new(compounds, sources, forms));
            let sources = sources_of(|f| matches!(f, Form::Mesh(_)));
            let meshes = PrimitiveBatch::Meshes(Meshes::new(forms));
            out.extend(LabelledBatch::new(meshes, sources, forms));
            out
        }
    };
}

// Kinds of compiled primitives, in the order in which primitives are numbered. A new kind needs a
// line here.
batches! {
    /// Batch of parallelograms, such as rectangles.
    Parallelograms(Parallelogram),
    /// Batch of infinite planes.
    Planes(Plane),
    /// Batch of spheres.
    Spheres(Sphere),
    /// Batch of ellipsoids.
    Ellipsoids(Ellipsoid),
    /// Batch of convex polyhedra, such as boxes.
    ConvexPolyhedra(ConvexPolyhedron),
    /// Batch of conical frusta: cylinders, cones and tapered cylinders.
    ConicalFrusta(ConicalFrustum),
    /// Batch of tori (rings).
    Tori(Torus),
}

impl<L: SimdFloat> PrimitiveBatch<L> {
    /// Replaces `hit` in the lanes whose ray hits a primitive of the batch nearer than `hit`. Only
    /// primitives with a number in `range` are tested. The id of a primitive is `base` plus its
    /// number in the batch.
    #[inline(always)]
    pub fn closest(&self, range: Range<usize>, base: u32, ray: &Ray<L>, hit: &mut Hit<L>) {
        each!(self,
            primitives => closest(&primitives[range.clone()], base + range.start as u32, ray, hit),
            compounds => compounds.closest(range, base, ray, hit),
            meshes => meshes.closest(range, base, ray, hit));
    }

    /// Returns the lanes whose ray hits a primitive of the batch, with a number in `range`, at a
    /// distance between 0 and `limit`. The search may stop once all lanes of `wanted` are occluded.
    #[inline(always)]
    pub fn occluded(
        &self,
        range: Range<usize>,
        ray: &Ray<L>,
        limit: L,
        wanted: L::Mask,
    ) -> L::Mask {
        each!(self,
            primitives => occluded(&primitives[range], ray, limit, wanted),
            compounds => compounds.occluded(range, ray, limit, wanted),
            meshes => meshes.occluded(range, ray, limit, wanted))
    }

    /// Returns the projection of `point` onto the surface of `primitive`, with the normal
    /// there. `point` is the computed hit point of a ray, with rounding errors. `triangle_tag` is
    /// the id of the hit triangle if the primitive is a mesh.
    #[inline(always)]
    pub fn surface(&self, primitive: usize, triangle_tag: L, point: Vec3<L>) -> SurfacePoint<L> {
        each!(self,
            primitives => primitives[primitive].surface(point),
            compounds => compounds.surface(primitive, point),
            meshes => meshes.surface(primitive, triangle_tag, point))
    }

    /// Returns the texture coordinates that the geometry of `primitive` defines at `point`;
    /// `None` if it defines none. `triangle_tag` is the id of the triangle at `point` if the
    /// primitive is a mesh.
    pub fn uv(&self, primitive: usize, triangle_tag: L, point: Vec3<L>) -> Option<UvGradients<L>> {
        each!(self,
            primitives => primitives[primitive].uv(point),
            compounds => compounds.uv(primitive, point),
            meshes => meshes.uv(primitive, triangle_tag, point))
    }
}

#[inline(always)]
fn closest<L: SimdFloat>(
    primitives: &[impl Primitive<L>],
    first: u32,
    ray: &Ray<L>,
    hit: &mut Hit<L>,
) {
    for (tag, primitive) in (first..).zip(primitives) {
        if let Some((t, meets)) = primitive.intersect(ray) {
            hit.keep_closer(meets, t, tag);
        }
    }
}

#[inline(always)]
fn occluded<L: SimdFloat>(
    primitives: &[impl Primitive<L>],
    ray: &Ray<L>,
    limit: L,
    wanted: L::Mask,
) -> L::Mask {
    let mut occluded = L::mask(false);
    for primitive in primitives {
        if let Some((t, meets)) = primitive.intersect(ray) {
            occluded = occluded | (meets & t.gt(L::zero()) & t.lt(limit));
            if wanted.and_not(occluded).none() {
                break;
            }
        }
    }
    occluded
}

/// Origin of a compiled primitive: the index of its canonical form, and the number of its part if
/// the form is a compound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrimitiveId {
    /// Index of the canonical form in the list given to `compile`.
    pub form: usize,
    /// Number of the part if the form is a compound, counted from 0; otherwise 0. In lists of
    /// primitives the first part stands for the whole compound; the other parts are not intersected
    /// on their own.
    pub part: usize,
}

/// All primitives of one kind (a batch), with their origins and the name of the kind.
pub struct LabelledBatch<L: SimdFloat> {
    /// Compiled primitives of the batch, all of one kind.
    pub batch: PrimitiveBatch<L>,
    /// Origin of each primitive of the batch: its canonical form and compound part.
    pub sources: Vec<PrimitiveId>,
    /// Noun for primitives of this kind in the scene's inventory: singular and plural.
    pub noun: (&'static str, &'static str),
    /// Addition to the noun in the scene's inventory, such as a number of triangles.
    pub detail: String,
    /// `true` if the primitives have no finite bounds, so that a BVH cannot hold them.
    pub infinite: bool,
}

impl<L: SimdFloat> LabelledBatch<L> {
    /// Creates the batch of the primitives with the origins `sources`, and its noun and detail for
    /// the scene's inventory. Returns `None` if `sources` is empty.
    fn new(batch: PrimitiveBatch<L>, sources: Vec<PrimitiveId>, forms: &[Form]) -> Option<Self> {
        let noun = forms[sources.first()?.form].noun();
        let triangles: usize = sources.iter().map(|s| forms[s.form].triangles()).sum();
        let detail = match triangles {
            0 => String::new(),
            n => format!(" of {} triangles", with_thousands_separators(n)),
        };
        let infinite = sources.iter().any(|s| forms[s.form].bounds().is_none());
        Some(Self { batch, sources, noun, detail, infinite })
    }
}

/// Formats `n` with thousands separators, such as `69,451`.
fn with_thousands_separators(n: usize) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}
