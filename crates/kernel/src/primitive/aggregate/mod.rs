//! Aggregate: all primitives of a scene, compiled for rays: an array for each kind of primitive,
//! and, if there are many, a BVH.

mod batch;
pub mod primitive_box;
mod scene_bvh;

pub use batch::PrimitiveId;

use crate::bvh::{Hit, Ray};
use crate::lanes::{Mask, SimdFloat, Vec3};
use crate::primitive::aggregate::batch::{LabelledBatch, PrimitiveBatch, compile};
use crate::primitive::aggregate::primitive_box::PrimitiveBox;
use crate::primitive::aggregate::scene_bvh::SceneBvh;
use crate::primitive::compiled::{SurfacePoint, TexCoord};
use crate::primitive::form::Form;
use crate::primitive::mesh::instance::MeshInstance;
use std::ops::Range;

/// Smallest number of primitives with finite bounds for which a BVH is built. For fewer primitives,
/// a short list for each tile of the picture is faster.
///
/// Measured with spheres that fill a ball (`benches/acceleration.rs`): whole pictures with up to 95
/// primitives render faster without a BVH. If rays are tested against all primitives instead of the
/// list of a tile, the BVH is faster from about 50 primitives on for coherent packets, and from
/// about 300 on for incoherent ones.
pub const BVH_MIN_PRIMITIVES: usize = 96;

/// Structure that an [`Aggregate`] uses to test rays against fewer primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AccelerationStructure {
    /// No structure: primitives are tested one by one. The string is the name of this method in the
    /// inventory of the scene.
    List(&'static str),
    /// Bounding box of each primitive.
    Boxes {
        /// `true`: the boxes are in the object space of their primitives. `false`: the boxes are
        /// axis-aligned in the scene.
        oriented: bool,
    },
    /// BVH over all primitives with finite bounds.
    Bvh,
}

impl AccelerationStructure {
    /// Returns the faster structure: a BVH from [`BVH_MIN_PRIMITIVES`] on, otherwise a list.
    pub fn fastest(forms: &[Form]) -> Self {
        let bounded = forms.iter().filter(|form| form.bounds().is_some()).count();
        if bounded >= BVH_MIN_PRIMITIVES { Self::Bvh } else { Self::List("list") }
    }
}

/// Batch of an aggregate. Its primitives have the numbers `base..end` in the aggregate.
struct BatchRange<L: SimdFloat> {
    batch: PrimitiveBatch<L>,
    base: u32,
    end: u32,
}

/// All primitives of a scene, numbered, compiled for one SIMD type.
pub struct Aggregate<L: SimdFloat> {
    batches: Vec<BatchRange<L>>,
    all: PrimitiveSet,
    bvh: Option<SceneBvh>,
    /// Primitives in the BVH, each as the index of its batch and its number in the batch.
    in_bvh: Vec<(usize, usize)>,
    /// Bounding box of each primitive; `None` for an infinite primitive. Empty if no boxes are
    /// used.
    boxes: Vec<Option<PrimitiveBox<L::Scalar>>>,
    /// Form, and its part, from which each primitive was compiled.
    pub sources: Vec<PrimitiveId>,
    /// Number and kinds of the primitives, and how rays find them, such as `2 spheres (list)`.
    pub description: String,
}

/// Subset of the primitives of an [`Aggregate`], to which ray queries are restricted.
#[derive(Clone, Debug, Default)]
pub struct PrimitiveSet {
    /// Primitives that are tested one by one: the index of a batch, and a range of primitive
    /// numbers in this batch.
    ranges: Vec<(usize, Range<usize>)>,
    /// `true` if the subset also includes all primitives of the BVH.
    bvh: bool,
}

impl PrimitiveSet {
    /// Returns `true` if the set contains no primitive.
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty() && !self.bvh
    }
}

impl<L: SimdFloat> Aggregate<L> {
    /// Compiles the canonical forms `forms`, with the fastest structure.
    pub fn new(forms: &[Form]) -> Self {
        Self::with_structure(forms, AccelerationStructure::fastest(forms))
    }

    /// Compiles the canonical forms `forms`, with or without a BVH.
    pub fn with_bvh(forms: &[Form], has_bvh: bool) -> Self {
        let list = AccelerationStructure::List("list");
        let structure = if has_bvh { AccelerationStructure::Bvh } else { list };
        Self::with_structure(forms, structure)
    }

    /// Compiles the canonical forms `forms`.
    pub fn with_structure(forms: &[Form], structure: AccelerationStructure) -> Self {
        let (has_bvh, how_listed) = match structure {
            AccelerationStructure::Bvh => (true, "list"),
            AccelerationStructure::List(name) => (false, name),
            AccelerationStructure::Boxes { oriented: true } => (false, "boxes of their own"),
            AccelerationStructure::Boxes { oriented: false } => (false, "boxes"),
        };
        let (mut batches, mut sources) = (Vec::new(), Vec::new());
        let (mut all, mut counts) = (PrimitiveSet::default(), Vec::new());
        let (mut in_bvh, mut bounds) = (Vec::new(), Vec::new());
        for LabelledBatch { batch, sources: origins, label, infinite } in compile(forms) {
            let index = batches.len();
            if has_bvh && !infinite {
                counts.push(format!("{label} (tree)"));
                for (i, source) in origins.iter().enumerate().filter(|(_, id)| id.part == 0) {
                    bounds.extend(forms[source.form].bounds());
                    in_bvh.push((index, i));
                }
            } else {
                let how = if infinite { "list" } else { how_listed };
                counts.push(format!("{label} ({how})"));
                all.ranges.push((index, 0..origins.len()));
            }
            let base = sources.len() as u32;
            sources.extend(origins);
            batches.push(BatchRange { batch, base, end: sources.len() as u32 });
        }
        let bvh = (!bounds.is_empty()).then(|| SceneBvh::new(&bounds));
        all.bvh = bvh.is_some();
        let mut boxes = Vec::new();
        if let AccelerationStructure::Boxes { oriented } = structure {
            let box_of = |source: &PrimitiveId| PrimitiveBox::new(&*forms[source.form], oriented);
            boxes.extend(sources.iter().map(box_of));
        }
        let description =
            if counts.is_empty() { "no objects".to_string() } else { counts.join(", ") };
        Self { batches, all, bvh, in_bvh, boxes, sources, description }
    }

    /// Returns the set of the BVH's primitives, and of the others whose number `wanted` accepts.
    pub fn select(&self, wanted: impl Fn(u32) -> bool) -> PrimitiveSet {
        let mut ranges: Vec<(usize, Range<usize>)> = Vec::new();
        for (index, range) in &self.all.ranges {
            let base = self.batches[*index].base;
            for i in range.clone().filter(|i| wanted(base + *i as u32)) {
                match ranges.last_mut() {
                    Some((last, run)) if last == index && run.end == i => run.end += 1,
                    _ => ranges.push((*index, i..i + 1)),
                }
            }
        }
        PrimitiveSet { ranges, bvh: self.all.bvh }
    }

    /// Returns the set of all primitives outside the BVH and of `primitives`, which must be in the
    /// BVH. Queries of this set do not traverse the BVH.
    pub fn select_indices(&self, primitives: &[u32]) -> PrimitiveSet {
        let mut ranges = self.all.ranges.clone();
        for primitive in primitives {
            let index = self.batch_index(*primitive);
            let i = (primitive - self.batches[index].base) as usize;
            ranges.push((index, i..i + 1));
        }
        ranges.sort_unstable_by_key(|(index, range)| (*index, range.start));
        PrimitiveSet { ranges, bvh: false }
    }

    /// Returns the numbers of the primitives in the BVH, in ascending order.
    pub fn in_bvh(&self) -> Vec<u32> {
        let number = |(index, i): &(usize, usize)| self.batches[*index].base + *i as u32;
        self.in_bvh.iter().map(number).collect()
    }

    /// Returns `true` if the aggregate has a BVH.
    pub fn has_bvh(&self) -> bool {
        self.bvh.is_some()
    }

    /// Returns `true` if there are neither a BVH nor bounding boxes of primitives.
    pub fn is_plain_list(&self) -> bool {
        self.bvh.is_none() && self.boxes.is_empty()
    }

    /// Returns the set of all primitives.
    pub fn all(&self) -> &PrimitiveSet {
        &self.all
    }

    /// Returns `true` if there are no primitives.
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    #[inline(always)]
    fn batch_index(&self, primitive: u32) -> usize {
        self.batches.iter().take_while(|batch| batch.end <= primitive).count()
    }

    /// Returns the closest hit of each ray with the primitives of `set`. Among hits at equal
    /// distances, the primitive with the lowest number counts, whatever the order of the BVH.
    #[inline(always)]
    pub fn closest(&self, ray: &Ray<L>, set: &PrimitiveSet) -> Hit<L> {
        self.closest_masked(ray, set, L::mask(true))
    }

    /// Returns the result of [`Aggregate::closest`] in the lanes of `wanted`. Other lanes are
    /// undefined.
    #[inline(always)]
    pub fn closest_masked(&self, ray: &Ray<L>, set: &PrimitiveSet, wanted: L::Mask) -> Hit<L> {
        if !self.boxes.is_empty() {
            return self.closest_boxed(ray, set, no_hit(wanted));
        }
        let hit = self.closest_linear(ray, set, wanted);
        match &self.bvh {
            Some(bvh) if set.bvh => self.closest_bvh(bvh, ray, hit),
            _ => hit,
        }
    }

    /// Returns the result of [`Aggregate::closest_masked`] for the primitives of `set` that are
    /// tested one by one, without BVH and bounding boxes.
    #[inline(always)]
    pub fn closest_linear(&self, ray: &Ray<L>, set: &PrimitiveSet, wanted: L::Mask) -> Hit<L> {
        let mut hit = no_hit(wanted);
        for (index, range) in &set.ranges {
            let batch = &self.batches[*index];
            batch.batch.closest(range.clone(), batch.base, ray, &mut hit);
        }
        hit
    }

    #[inline(never)]
    fn closest_bvh(&self, bvh: &SceneBvh, ray: &Ray<L>, mut hit: Hit<L>) -> Hit<L> {
        bvh.traverse(ray, hit.t, |primitive, limit| {
            let (index, i) = self.in_bvh[primitive];
            let batch = &self.batches[index];
            // The limit is widened by rounding errors, so that `merge` sees hits at the distance of
            // the current hit, too, and keeps the primitive with the lower number.
            let mut new = Hit::with_t_max(limit * L::from_f64(1.0 + 2.0 * L::EPSILON));
            batch.batch.closest(i..i + 1, batch.base, ray, &mut new);
            // Inactive lanes have a negative limit; here they become misses.
            new.t = L::select(new.t.gt(L::zero()), new.t, L::from_f64(L::MAX));
            hit.merge(&new);
            hit.t
        });
        hit
    }

    /// Iterates over the primitives of `set` that are tested one by one: batch, number in the
    /// batch, and bounding box, which is `None` for an infinite primitive.
    #[inline(always)]
    fn boxed<'a>(
        &'a self,
        set: &'a PrimitiveSet,
    ) -> impl Iterator<Item = (&'a BatchRange<L>, usize, Option<&'a PrimitiveBox<L::Scalar>>)> {
        set.ranges.iter().flat_map(move |(index, range)| {
            let batch = &self.batches[*index];
            range.clone().map(move |i| (batch, i, self.boxes[batch.base as usize + i].as_ref()))
        })
    }

    #[inline(never)]
    fn closest_boxed(&self, ray: &Ray<L>, set: &PrimitiveSet, mut hit: Hit<L>) -> Hit<L> {
        for (batch, i, bounds) in self.boxed(set) {
            if bounds.is_none_or(|bounds| bounds.meets(ray, hit.t).any()) {
                batch.batch.closest(i..i + 1, batch.base, ray, &mut hit);
            }
        }
        hit
    }

    #[inline(never)]
    fn occluded_boxed(
        &self,
        ray: &Ray<L>,
        limit: L,
        wanted: L::Mask,
        set: &PrimitiveSet,
    ) -> L::Mask {
        let mut occluded = L::mask(false);
        for (batch, i, bounds) in self.boxed(set) {
            let open = wanted.and_not(occluded);
            let open = bounds.map_or(open, |bounds| open & bounds.meets(ray, limit));
            if open.any() {
                let new = batch.batch.occluded(i..i + 1, ray, limit, open);
                occluded = occluded | (new & open);
                if wanted.and_not(occluded).none() {
                    break;
                }
            }
        }
        occluded
    }

    /// Returns the lanes of `wanted` whose ray hits any primitive of `set` at a distance between 0
    /// and `limit`.
    #[inline(always)]
    pub fn occluded(&self, ray: &Ray<L>, limit: L, wanted: L::Mask, set: &PrimitiveSet) -> L::Mask {
        if !self.boxes.is_empty() {
            return self.occluded_boxed(ray, limit, wanted, set);
        }
        let occluded = self.occluded_linear(ray, limit, wanted, set);
        match &self.bvh {
            Some(bvh) if set.bvh && wanted.and_not(occluded).any() => {
                self.occluded_bvh(bvh, ray, limit, wanted, occluded)
            }
            _ => occluded,
        }
    }

    /// Returns the result of [`Aggregate::occluded`] for the primitives of `set` that are tested
    /// one by one, without BVH and bounding boxes.
    #[inline(always)]
    pub fn occluded_linear(
        &self,
        ray: &Ray<L>,
        limit: L,
        wanted: L::Mask,
        set: &PrimitiveSet,
    ) -> L::Mask {
        let mut occluded = L::mask(false);
        for (index, range) in &set.ranges {
            let open = wanted.and_not(occluded);
            let batch = &self.batches[*index].batch;
            occluded = occluded | batch.occluded(range.clone(), ray, limit, open);
            if wanted.and_not(occluded).none() {
                break;
            }
        }
        occluded
    }

    /// Returns the lanes of `wanted` whose ray hits one given primitive of the BVH at a distance
    /// between 0 and `limit`. `number` is the index of this primitive in [`Aggregate::in_bvh`].
    #[inline(always)]
    pub fn occluded_by(&self, number: u32, ray: &Ray<L>, limit: L, wanted: L::Mask) -> L::Mask {
        let (index, i) = self.in_bvh[number as usize];
        self.batches[index].batch.occluded(i..i + 1, ray, limit, wanted)
    }

    #[inline(never)]
    fn occluded_bvh(
        &self,
        bvh: &SceneBvh,
        ray: &Ray<L>,
        limit: L,
        wanted: L::Mask,
        mut occluded: L::Mask,
    ) -> L::Mask {
        let limit_of = |occluded| L::select(wanted.and_not(occluded), limit, L::from_f64(-1.0));
        bvh.traverse(ray, limit_of(occluded), |primitive, left| {
            let open = left.gt(L::zero());
            let new = self.occluded_by(primitive as u32, ray, left, open);
            occluded = occluded | (new & open);
            limit_of(occluded)
        });
        occluded
    }

    /// Returns the hits of the rays with `primitive` that are nearer than `limit`. If `primitive`
    /// is the first part of a compound, these are the hits with the whole compound.
    pub fn closest_to(&self, primitive: u32, ray: &Ray<L>, limit: L) -> Hit<L> {
        let batch = &self.batches[self.batch_index(primitive)];
        let (i, mut hit) = ((primitive - batch.base) as usize, Hit::with_t_max(limit));
        batch.batch.closest(i..i + 1, batch.base, ray, &mut hit);
        hit
    }

    /// Returns the projection of `point` onto the surface of `primitive`, with the normal there.
    /// `point` is the computed hit point of a ray, with rounding errors. `triangle` is
    /// [`Hit::triangle`].
    #[inline(always)]
    pub fn surface(&self, primitive: u32, triangle: L, point: Vec3<L>) -> SurfacePoint<L> {
        let batch = &self.batches[self.batch_index(primitive)];
        batch.batch.surface((primitive - batch.base) as usize, triangle, point)
    }

    /// Returns the meshes. Their numbers are the highest ones of the aggregate.
    fn meshes(&self) -> &[MeshInstance<L::Scalar>] {
        match self.batches.last() {
            Some(BatchRange { batch: PrimitiveBatch::Mesh(meshes), .. }) => meshes,
            Some(_) | None => &[],
        }
    }

    /// Returns the mesh with the number `primitive`; `None` if the primitive is not a mesh.
    fn mesh(&self, primitive: u32) -> Option<&MeshInstance<L::Scalar>> {
        let meshes = self.meshes();
        let first = self.sources.len() - meshes.len();
        meshes.get((primitive as usize).checked_sub(first)?)
    }

    /// Returns `true` if some primitive interpolates the normals of its vertices.
    pub fn is_smooth(&self) -> bool {
        self.meshes().iter().any(|mesh| mesh.smooth)
    }

    /// Returns `true` if some primitive has colours of vertices or faces.
    pub fn is_colored(&self) -> bool {
        self.meshes().iter().any(MeshInstance::is_colored)
    }

    /// Returns the shading normal of `primitive` at the surface point `at`, whose normal is on the
    /// viewer's side. `direction` is the direction of the rays. The normal is less than 90 degrees
    /// away from the geometric normal and from the direction to the viewer.
    ///
    /// Also returns the lift: the vector from a point of a convex smooth mesh to the mean of its
    /// projections onto the tangent planes of the vertices, by barycentric weights (Hanika 2021,
    /// *Hacking the Shadow Terminator*). Shadow rays start there, so that the triangles around the
    /// point do not occlude lights above the horizon of the shading normal. The lift is zero where
    /// the mesh is concave or flat, and `None` for other primitives and meshes without smooth normals.
    pub fn shading_normal(
        &self,
        primitive: u32,
        triangle: L,
        at: &SurfacePoint<L>,
        direction: Vec3<L>,
    ) -> (Vec3<L>, Option<Vec3<L>>) {
        let flat = (at.normal, None);
        self.mesh(primitive).map_or(flat, |mesh| mesh.shading_normal(triangle, at, direction))
    }

    /// Returns the colour that the mesh file of `primitive` gives to `triangle`. Returns `None` if
    /// the primitive is not a mesh, or if the file has no colours.
    pub fn color(&self, primitive: u32, triangle: L) -> Option<Vec3<L>> {
        self.mesh(primitive)?.color(triangle)
    }

    /// Returns the texture coordinates that the geometry of `primitive` defines at `point`, if any.
    pub fn uv(&self, primitive: u32, triangle: L, point: Vec3<L>) -> Option<TexCoord<L>> {
        let batch = &self.batches[self.batch_index(primitive)];
        batch.batch.uv((primitive - batch.base) as usize, triangle, point)
    }
}

/// Returns a miss in every lane. Lanes outside `wanted` have a negative distance limit, so that
/// they accept no hit.
#[inline(always)]
fn no_hit<L: SimdFloat>(wanted: L::Mask) -> Hit<L> {
    Hit::with_t_max(L::select(wanted, L::from_f64(L::MAX), L::from_f64(-1.0)))
}
