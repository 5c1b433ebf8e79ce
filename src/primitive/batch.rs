//! Batches of compiled primitives: one list for each kind of primitive that the scene contains. A
//! kind that the scene does not contain costs nothing.

use crate::bvh::{Hit, Ray};
use crate::lanes::{Mask, SimdFloat, Vec3};
use crate::primitive::conical_frustum::ConicalFrustum;
use crate::primitive::convex_polyhedron::ConvexPolyhedron;
use crate::primitive::csg::Compounds;
use crate::primitive::ellipsoid::Ellipsoid;
use crate::primitive::form::Form;
use crate::primitive::mesh_instance::Meshes;
use crate::primitive::parallelogram::Parallelogram;
use crate::primitive::plane::Plane;
use crate::primitive::sphere::Sphere;
use crate::primitive::torus::Torus;
use std::ops::Range;

/// Surface of a primitive at a hit point.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<L> {
    /// Hit point, projected onto the surface as exactly as the precision allows.
    pub point: Vec3<L>,
    /// Unit geometric normal: outward for solids, on the front for flat shapes.
    pub normal: Vec3<L>,
    /// Largest magnitude of the coordinates from which the point was computed. The rounding error
    /// of the point is a few units in the last place of this value.
    pub max_coordinate: L,
}

/// Texture coordinates of a primitive at one point.
#[derive(Clone, Copy, Debug)]
pub struct UvGradients<L> {
    /// Texture coordinates: u to the right, v up.
    pub uv: [L; 2],
    /// Gradients of u and v along the surface, in the space of the shape.
    pub gradients: [Vec3<L>; 2],
}

impl<L: SimdFloat> SurfacePoint<L> {
    /// Returns the offset from the surface at which secondary rays start: a few rounding errors of
    /// [`SurfacePoint::max_coordinate`].
    #[inline(always)]
    pub fn ray_offset(&self) -> L {
        self.max_coordinate.max(self.point.max_abs()) * L::from_f64(8.0 * L::EPSILON)
    }
}

/// A primitive compiled for one lane type.
pub trait Primitive<L: SimdFloat> {
    /// Returns the smallest distance at which each ray hits the primitive, and the lanes that hit
    /// it. Only distances greater than 0 are hits. Returns `None` if no lane hits.
    fn intersect(&self, ray: &Ray<L>) -> Option<(L, L::Mask)>;

    /// Returns the surface at `point`, a hit point with rounding errors.
    fn surface(&self, point: Vec3<L>) -> SurfacePoint<L>;

    /// Returns the primitive's own texture coordinates at `point`. Forms whose default mapping is
    /// [`DefaultMapping::Uv`](crate::primitive::DefaultMapping::Uv) have them.
    fn uv(&self, _point: Vec3<L>) -> Option<UvGradients<L>> {
        None
    }
}

macro_rules! batches {
    ($($(#[$doc:meta])+ $kind:ident($item:ident)),+ $(,)?) => {
        /// All primitives of one kind (a batch), compiled for one lane type.
        pub enum PrimitiveBatch<L: SimdFloat> {
            $($(#[$doc])+ $kind(Vec<$item<L::Scalar>>),)+
            /// Compounds. Each part of a compound is an item.
            Compounds(Compounds<L::Scalar>),
            /// Meshes.
            Meshes(Meshes<L::Scalar>),
        }

        /// Evaluates an expression for a batch of any kind. Compounds and meshes have an expression
        /// of their own.
        macro_rules! each {
            ($batch:expr, $items:ident => $value:expr, $compounds:ident => $other:expr,
                $meshes:ident => $third:expr) => {
                match $batch {
                    $(PrimitiveBatch::$kind($items) => $value,)+
                    PrimitiveBatch::Compounds($compounds) => $other,
                    PrimitiveBatch::Meshes($meshes) => $third,
                }
            };
        }

        /// Compiles `forms` into one batch for each kind of primitive that occurs.
        pub fn compile<L: SimdFloat>(forms: &[Form]) -> Vec<LabelledBatch<L>> {
            let mut out = Vec::new();
            $(
                let items = forms.iter().enumerate().filter_map(|(form, f)| {
                    Some((PrimitiveId { form, part: 0 }, $item::new(f)?))
                });
                let (sources, items): (Vec<_>, Vec<_>) = items.unzip();
                out.extend(LabelledBatch::new(PrimitiveBatch::$kind(items), sources, forms));
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

// The list of compiled primitives, in the order in which items are numbered: a new one is a line
// here.
batches! {
    /// Parallelograms.
    Parallelograms(Parallelogram),
    /// Infinite planes.
    Planes(Plane),
    /// Spheres.
    Spheres(Sphere),
    /// Ellipsoids.
    Ellipsoids(Ellipsoid),
    /// Convex polyhedra.
    ConvexPolyhedra(ConvexPolyhedron),
    /// Conical frusta.
    ConicalFrusta(ConicalFrustum),
    /// Tori.
    Tori(Torus),
}

impl<L: SimdFloat> PrimitiveBatch<L> {
    /// Replaces `hit` in the lanes in which an item of `range` is nearer. The id of an item is
    /// `base` plus its number.
    #[inline(always)]
    pub fn closest(&self, range: Range<usize>, base: u32, ray: &Ray<L>, hit: &mut Hit<L>) {
        each!(self,
            items => closest(&items[range.clone()], base + range.start as u32, ray, hit),
            compounds => compounds.closest(range, base, ray, hit),
            meshes => meshes.closest(range, base, ray, hit));
    }

    /// Returns the lanes that hit an item of `range` at a distance between 0 and `limit`. The
    /// search may stop once all lanes of `wanted` are occluded.
    #[inline(always)]
    pub fn occluded(
        &self,
        range: Range<usize>,
        ray: &Ray<L>,
        limit: L,
        wanted: L::Mask,
    ) -> L::Mask {
        each!(self,
            items => occluded(&items[range], ray, limit, wanted),
            compounds => compounds.occluded(range, ray, limit, wanted),
            meshes => meshes.occluded(range, ray, limit, wanted))
    }

    /// Returns the surface of `item` at `point`, a hit point with rounding errors. `triangle_tag`
    /// is the id of the hit triangle if the item is a mesh.
    #[inline(always)]
    pub fn surface(&self, item: usize, triangle_tag: L, point: Vec3<L>) -> SurfacePoint<L> {
        each!(self,
            items => items[item].surface(point),
            compounds => compounds.surface(item, point),
            meshes => meshes.surface(item, triangle_tag, point))
    }

    /// Returns the texture coordinates of `item` at `point`; `None` if the item has none.
    pub fn uv(&self, item: usize, triangle_tag: L, point: Vec3<L>) -> Option<UvGradients<L>> {
        each!(self,
            items => items[item].uv(point),
            compounds => compounds.uv(item, point),
            meshes => meshes.uv(item, triangle_tag, point))
    }
}

#[inline(always)]
fn closest<L: SimdFloat>(items: &[impl Primitive<L>], first: u32, ray: &Ray<L>, hit: &mut Hit<L>) {
    for (tag, item) in (first..).zip(items) {
        if let Some((t, meets)) = item.intersect(ray) {
            hit.keep_closer(meets, t, tag);
        }
    }
}

#[inline(always)]
fn occluded<L: SimdFloat>(
    items: &[impl Primitive<L>],
    ray: &Ray<L>,
    limit: L,
    wanted: L::Mask,
) -> L::Mask {
    let mut occluded = L::mask(false);
    for item in items {
        if let Some((t, meets)) = item.intersect(ray) {
            occluded = occluded | (meets & t.gt(L::zero()) & t.lt(limit));
            if wanted.and_not(occluded).none() {
                break;
            }
        }
    }
    occluded
}

/// Origin of an item: index of its form, and part of the form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrimitiveId {
    /// Index of the form in the list given to `compile`.
    pub form: usize,
    /// Number of the part of a compound; 0 for other forms. In lists of items the first part means
    /// the whole compound; further parts are never intersected on their own.
    pub part: usize,
}

/// One compiled batch, with the origins of its items and its name.
pub struct LabelledBatch<L: SimdFloat> {
    /// Compiled batch.
    pub batch: PrimitiveBatch<L>,
    /// Form and part of each item.
    pub sources: Vec<PrimitiveId>,
    /// Noun for the items in the scene's inventory, singular and plural.
    pub noun: (&'static str, &'static str),
    /// Addition to the noun in the inventory.
    pub detail: String,
    /// `true` if the items have no finite bounds, so that a BVH cannot hold them.
    pub infinite: bool,
}

impl<L: SimdFloat> LabelledBatch<L> {
    /// Creates the batch of the primitives in `sources`. Returns `None` if there are none.
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

/// Returns the largest magnitude of a coordinate of a form with finite bounds.
pub(crate) fn max_coordinate(form: &Form) -> f64 {
    form.bounds().map_or(0.0, |(low, high)| low.abs().max(high.abs()).max_element())
}
