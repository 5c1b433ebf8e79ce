//! Batches of compiled primitives: one array for each kind of primitive that the scene contains.

use crate::bvh::{Hit, Ray};
use crate::lanes::{Mask, SimdFloat, Vec3};
use crate::primitive::compiled::{AnalyticPrimitive, Primitive, SurfacePoint, TexCoord};
use crate::primitive::conical_frustum::ConicalFrustum;
use crate::primitive::convex_polyhedron::ConvexPolyhedron;
use crate::primitive::csg::CompoundPart;
use crate::primitive::ellipsoid::Ellipsoid;
use crate::primitive::form::Form;
use crate::primitive::mesh::instance::MeshInstance;
use crate::primitive::parallelogram::Parallelogram;
use crate::primitive::plane::Plane;
use crate::primitive::sphere::Sphere;
use crate::primitive::torus::Torus;
use std::ops::Range;

macro_rules! batches {
    ($($kind:ident),+; parts: $($whole:ident($part:ident)),+) => {
        /// Batch: all primitives of one kind, compiled for one SIMD type.
        pub enum PrimitiveBatch<L: SimdFloat> {
            $($kind(Vec<$kind<L::Scalar>>),)+
            $($whole(Vec<$part<L::Scalar>>),)+
        }

        $(
            impl<L: SimdFloat> Primitive<L> for $kind<L::Scalar> {
                #[inline(always)]
                fn closest(&self, id: u32, ray: &Ray<L>, hit: &mut Hit<L>) {
                    if let Some((t, meets)) = self.intersect(ray) {
                        hit.keep_closer(meets, t, id);
                    }
                }

                #[inline(always)]
                fn occluded(&self, ray: &Ray<L>, limit: L, _wanted: L::Mask) -> Option<L::Mask> {
                    let (t, meets) = self.intersect(ray)?;
                    Some(meets & t.gt(L::zero()) & t.lt(limit))
                }

                #[inline(always)]
                fn surface(&self, _triangle: L, point: Vec3<L>) -> SurfacePoint<L> {
                    AnalyticPrimitive::surface(self, point)
                }

                fn uv(&self, _triangle: L, point: Vec3<L>) -> Option<TexCoord<L>> {
                    AnalyticPrimitive::uv(self, point)
                }
            }
        )+

        /// Evaluates an expression for the array of primitives in a batch.
        macro_rules! each {
            ($batch:expr, $primitives:ident => $value:expr) => {
                match $batch {
                    $(PrimitiveBatch::$kind($primitives) => $value,)+
                    $(PrimitiveBatch::$whole($primitives) => $value,)+
                }
            };
        }

        /// Compiles `forms` into one batch for each kind of primitive that occurs.
        pub fn compile<L: SimdFloat>(forms: &[Form]) -> Vec<LabelledBatch<L>> {
            let mut out = Vec::new();
            $(
                let compile = |form: &Form| {
                    let Form::$kind(form) = form else { return None };
                    Some([$kind::new(form)])
                };
                out.extend(LabelledBatch::new(forms, compile, PrimitiveBatch::$kind));
            )+
            $(
                let compile = |form: &Form| {
                    let Form::$whole(form) = form else { return None };
                    Some($part::of(form))
                };
                out.extend(LabelledBatch::new(forms, compile, PrimitiveBatch::$whole));
            )+
            out
        }
    };
}

// Kinds of compiled primitives, in the order in which primitives are numbered. A form of the kinds
// after `parts` becomes several primitives, or none. A new kind is added here.
batches! {
    Parallelogram, Plane, Sphere, Ellipsoid, ConvexPolyhedron, ConicalFrustum, Torus;
    parts: Csg(CompoundPart), Mesh(MeshInstance)
}

impl<L: SimdFloat> PrimitiveBatch<L> {
    /// Replaces `hit` in the lanes whose ray hits a primitive with a number in `range` nearer than
    /// `hit`. The id of a primitive is `base` plus its number in the batch.
    #[inline(always)]
    pub fn closest(&self, range: Range<usize>, base: u32, ray: &Ray<L>, hit: &mut Hit<L>) {
        let first = base + range.start as u32;
        each!(self, primitives => {
            for (id, primitive) in (first..).zip(&primitives[range]) {
                primitive.closest(id, ray, hit);
            }
        });
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
        let mut occluded = L::mask(false);
        each!(self, primitives => {
            for primitive in &primitives[range] {
                if let Some(hits) = primitive.occluded(ray, limit, wanted.and_not(occluded)) {
                    occluded = occluded | hits;
                    if wanted.and_not(occluded).none() {
                        break;
                    }
                }
            }
        });
        occluded
    }

    /// Projects `point` onto the surface of primitive `primitive` of the batch.
    #[inline(always)]
    pub fn surface(&self, primitive: usize, triangle: L, point: Vec3<L>) -> SurfacePoint<L> {
        each!(self, primitives => Primitive::surface(&primitives[primitive], triangle, point))
    }

    /// Returns the texture coordinates that primitive `primitive` of the batch defines, if any.
    pub fn uv(&self, primitive: usize, triangle: L, point: Vec3<L>) -> Option<TexCoord<L>> {
        each!(self, primitives => Primitive::uv(&primitives[primitive], triangle, point))
    }
}

/// Origin of a compiled primitive in the list of canonical forms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrimitiveId {
    /// Index of the canonical form in the list given to the aggregate.
    pub form: usize,
    /// Number of the part of a CSG compound; otherwise 0. Rays are intersected with part 0 only,
    /// which stands for the whole compound.
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
    /// Compiles the `forms` for which `compile` returns primitives into one batch; `None` if there
    /// are none.
    fn new<P, I: IntoIterator<Item = P>>(
        forms: &[Form],
        compile: impl Fn(&Form) -> Option<I>,
        batch: impl Fn(Vec<P>) -> PrimitiveBatch<L>,
    ) -> Option<Self> {
        let parts_of = |(form, f): (usize, &Form)| {
            let id = move |(part, primitive)| (PrimitiveId { form, part }, primitive);
            compile(f).into_iter().flatten().enumerate().map(id)
        };
        let (sources, primitives): (Vec<PrimitiveId>, Vec<P>) =
            forms.iter().enumerate().flat_map(parts_of).unzip();
        let (one, several) = forms[sources.first()?.form].noun();
        let count = sources.iter().filter(|s| s.part == 0).count();
        let noun = if count == 1 { one } else { several };
        let triangles: usize = sources.iter().map(|s| forms[s.form].triangles()).sum();
        let detail = match triangles {
            0 => String::new(),
            n => format!(" of {} triangles", with_thousands_separators(n)),
        };
        let infinite = sources.iter().any(|s| forms[s.form].bounds().is_none());
        let label = format!("{count} {noun}{detail}");
        Some(Self { batch: batch(primitives), sources, label, infinite })
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
