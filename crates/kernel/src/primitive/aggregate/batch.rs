//! Batches of compiled primitives: one array for each kind of primitive that the scene contains.

use crate::bvh::{Hit, Ray};
use crate::lanes::{Mask, SimdFloat, Vec3};
use crate::primitive::compiled::{Primitive, SurfacePoint, UvGradients};
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

macro_rules! batches {
    ($($kind:ident),+ $(,)?) => {
        /// Batch: all primitives of one kind, compiled for one SIMD type.
        pub enum PrimitiveBatch<L: SimdFloat> {
            $($kind(Vec<$kind<L::Scalar>>),)+
            /// Each part of a compound counts as a primitive.
            Csg(Compounds<L::Scalar>),
            Mesh(Meshes<L::Scalar>),
        }

        /// Evaluates one of three expressions: for an array of primitives, compounds or meshes.
        macro_rules! each {
            ($batch:expr, $primitives:ident => $value:expr, $compounds:ident => $other:expr,
                $meshes:ident => $third:expr) => {
                match $batch {
                    $(PrimitiveBatch::$kind($primitives) => $value,)+
                    PrimitiveBatch::Csg($compounds) => $other,
                    PrimitiveBatch::Mesh($meshes) => $third,
                }
            };
        }

        /// Compiles `forms` into one batch for each kind of primitive that occurs.
        pub fn compile<L: SimdFloat>(forms: &[Form]) -> Vec<LabelledBatch<L>> {
            let mut out = Vec::new();
            $(
                let all = forms.iter().enumerate().filter_map(|(form, f)| {
                    let Form::$kind(f) = f else { return None };
                    Some((PrimitiveId { form, part: 0 }, $kind::new(f)))
                });
                let (sources, primitives): (Vec<_>, Vec<_>) = all.unzip();
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
            let compounds = PrimitiveBatch::Csg(Compounds::new(forms));
            out.extend(LabelledBatch::new(compounds, sources, forms));
            let sources = sources_of(|f| matches!(f, Form::Mesh(_)));
            let meshes = PrimitiveBatch::Mesh(Meshes::new(forms));
            out.extend(LabelledBatch::new(meshes, sources, forms));
            out
        }
    };
}

// Kinds of compiled primitives other than compounds and meshes, in the order in which primitives
// are numbered. A new kind needs a word here.
batches!(Parallelogram, Plane, Sphere, Ellipsoid, ConvexPolyhedron, ConicalFrustum, Torus);

impl<L: SimdFloat> PrimitiveBatch<L> {
    /// Replaces `hit` in the lanes whose ray hits a primitive with a number in `range` nearer than
    /// `hit`. The id of a primitive is `base` plus its number in the batch.
    #[inline(always)]
    pub fn closest(&self, range: Range<usize>, base: u32, ray: &Ray<L>, hit: &mut Hit<L>) {
        each!(self,
            primitives => closest(&primitives[range.clone()], base + range.start as u32, ray, hit),
            compounds => compounds.closest(range, base, ray, hit),
            meshes => meshes.closest(range, base, ray, hit));
    }

    /// Returns the lanes whose ray hits a primitive with a number in `range` at a distance between
    /// 0 and `limit`. The search may stop once all lanes of `wanted` are occluded.
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

    /// See [`Aggregate::surface`](super::Aggregate::surface).
    #[inline(always)]
    pub fn surface(&self, primitive: usize, triangle_tag: L, point: Vec3<L>) -> SurfacePoint<L> {
        each!(self,
            primitives => primitives[primitive].surface(point),
            compounds => compounds.surface(primitive, point),
            meshes => meshes.surface(primitive, triangle_tag, point))
    }

    /// See [`Aggregate::uv`](super::Aggregate::uv).
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

/// Origin of a compiled primitive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrimitiveId {
    /// Index of the canonical form in the list given to the aggregate.
    pub form: usize,
    /// Number of the part if the form is a compound; otherwise 0. Part 0 stands for the whole
    /// compound; the other parts are not intersected on their own.
    pub part: usize,
}

/// Batch with the origins of its primitives.
pub struct LabelledBatch<L: SimdFloat> {
    pub batch: PrimitiveBatch<L>,
    pub sources: Vec<PrimitiveId>,
    /// Number and kind of the primitives for the scene's inventory, such as `2 spheres`.
    pub label: String,
    /// `true` if the primitives have no finite bounds, so that a BVH cannot hold them.
    pub infinite: bool,
}

impl<L: SimdFloat> LabelledBatch<L> {
    /// Returns `None` if `sources` is empty.
    fn new(batch: PrimitiveBatch<L>, sources: Vec<PrimitiveId>, forms: &[Form]) -> Option<Self> {
        let (one, several) = forms[sources.first()?.form].noun();
        let count = sources.iter().filter(|s| s.part == 0).count();
        let noun = if count == 1 { one } else { several };
        let triangles: usize = sources.iter().map(|s| forms[s.form].triangles()).sum();
        let detail = match triangles {
            0 => String::new(),
            n => format!(" of {} triangles", with_thousands_separators(n)),
        };
        let infinite = sources.iter().any(|s| forms[s.form].bounds().is_none());
        Some(Self { batch, sources, label: format!("{count} {noun}{detail}"), infinite })
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
