//! Aggregate: all primitives of a scene, compiled for rays. It holds an array for each kind of
//! primitive. If there are many primitives, it also holds a BVH over all bounded ones.

use crate::bvh::{Hit, Ray};
use crate::lanes::{Mask, SimdFloat, Vec3};
use crate::primitive::batch::{
    LabelledBatch, PrimitiveBatch, PrimitiveId, SurfacePoint, UvGradients, compile,
};
use crate::primitive::form::Form;
use crate::primitive::mesh::instance::Meshes;
use crate::primitive::primitive_box::PrimitiveBox;
use crate::primitive::scene_bvh::SceneBvh;
use std::fmt;
use std::ops::Range;

/// Smallest number of primitives with finite bounds for which a BVH is built. Fewer primitives are
/// tested one by one. For them this is faster than a BVH, because each tile of the picture has a
/// short list of the primitives that its rays may hit.
///
/// Measured with spheres that fill a ball (`benches/acceleration.rs`): whole pictures with up to 95
/// primitives render faster without a BVH. If rays are tested against all primitives instead of the
/// list of a tile, the BVH is faster from about 50 primitives on for coherent packets, and from
/// about 300 on for incoherent ones.
pub const BVH_MIN_PRIMITIVES: usize = 96;

/// Structure that an [`Aggregate`] uses to test rays against fewer primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AccelerationStructure {
    /// No structure: primitives are tested one by one. The string is the name of such a list in the
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
    /// Returns the faster structure by measurement: a BVH if at least [`BVH_MIN_PRIMITIVES`] of the
    /// primitives have finite bounds, otherwise a list.
    pub fn fastest(forms: &[Form]) -> Self {
        let bounded = forms.iter().filter(|form| form.bounds().is_some()).count();
        if bounded >= BVH_MIN_PRIMITIVES { Self::Bvh } else { Self::List("list") }
    }
}

impl PrimitiveSet {
    /// Returns `true` if the set contains no primitive.
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty() && !self.tree
    }
}

/// Batch of an aggregate (all primitives of one kind). The numbers of its primitives in the
/// aggregate are from `base` up to, but not including, `end`.
struct BatchRange<L: SimdFloat> {
    batch: PrimitiveBatch<L>,
    base: u32,
    end: u32,
}

/// All primitives of a scene, numbered, compiled for one SIMD type.
pub struct Aggregate<L: SimdFloat> {
    parts: Vec<BatchRange<L>>,
    all: PrimitiveSet,
    tree: Option<SceneBvh>,
    /// Primitives in the BVH, each as the index of its batch (the array of its kind) and its number
    /// in the batch.
    tree_primitives: Vec<(u32, u32)>,
    /// Bounding box of each primitive, which rays are tested against before the primitive itself;
    /// `None` for an infinite primitive. The list is empty if no boxes are used.
    extents: Vec<Option<PrimitiveBox<L::Scalar>>>,
    /// Origin of each primitive: the index of its canonical form in the list given to
    /// [`Aggregate::new`], and the number of the part if the form is a compound.
    source: Vec<PrimitiveId>,
    counts: Vec<String>,
}

/// Subset of the primitives of an [`Aggregate`] (all primitives of a scene), to which ray queries
/// are restricted.
#[derive(Clone, Debug, Default)]
pub struct PrimitiveSet {
    /// Primitives that are tested one by one. Each entry has the index of a batch (the array of one
    /// kind of primitive) and a range of primitive numbers in this batch.
    ranges: Vec<(u32, Range<u32>)>,
    /// `true` if the subset also includes all primitives of the BVH.
    tree: bool,
}

impl<L: SimdFloat> Aggregate<L> {
    /// Compiles the canonical forms `forms` to primitives, with the fastest structure.
    pub fn new(forms: &[Form]) -> Self {
        Self::with_structure(forms, AccelerationStructure::fastest(forms))
    }

    /// Compiles the canonical forms `forms` to primitives, with or without a BVH.
    pub fn with_tree(forms: &[Form], tree: bool) -> Self {
        let list = AccelerationStructure::List("list");
        Self::with_structure(forms, if tree { AccelerationStructure::Bvh } else { list })
    }

    /// Compiles the canonical forms `forms` to primitives with the given structure.
    pub fn with_structure(forms: &[Form], structure: AccelerationStructure) -> Self {
        let (tree, how_listed) = match structure {
            AccelerationStructure::Bvh => (true, "list"),
            AccelerationStructure::List(name) => (false, name),
            AccelerationStructure::Boxes { oriented: true } => (false, "boxes of their own"),
            AccelerationStructure::Boxes { oriented: false } => (false, "boxes"),
        };
        let mut out = Self {
            parts: Vec::new(),
            all: PrimitiveSet::default(),
            tree: None,
            tree_primitives: Vec::new(),
            extents: Vec::new(),
            source: Vec::new(),
            counts: Vec::new(),
        };
        let mut bounds = Vec::new();
        for LabelledBatch { batch, sources, noun, detail, infinite } in compile(forms) {
            let base = out.source.len() as u32;
            let in_tree = tree && !infinite;
            let how = match (in_tree, infinite) {
                (true, _) => "tree",
                (_, true) => "list",
                _ => how_listed,
            };
            let count = sources.iter().filter(|s| s.part == 0).count();
            let name = if count == 1 { noun.0 } else { noun.1 };
            out.counts.push(format!("{count} {name}{detail} ({how})"));
            let part = out.parts.len() as u32;
            if in_tree {
                for (i, source) in sources.iter().enumerate().filter(|(_, s)| s.part == 0) {
                    bounds.extend(forms[source.form].bounds());
                    out.tree_primitives.push((part, i as u32));
                }
            } else {
                out.all.ranges.push((part, 0..sources.len() as u32));
            }
            out.source.extend(&sources);
            out.parts.push(BatchRange { batch, base, end: out.source.len() as u32 });
        }
        out.tree = (!bounds.is_empty()).then(|| SceneBvh::new(&bounds));
        out.all.tree = out.tree.is_some();
        if let AccelerationStructure::Boxes { oriented } = structure {
            let box_of = |source: &PrimitiveId| PrimitiveBox::new(&forms[source.form], oriented);
            out.extents = out.source.iter().map(box_of).collect();
        }
        out
    }

    /// Returns a subset of the primitives: all primitives in the BVH, and each primitive outside of
    /// the BVH for whose number `wanted` returns `true`. Primitives in the BVH need no selection,
    /// because traversal skips those that a ray misses.
    pub fn select(&self, wanted: impl Fn(u32) -> bool) -> PrimitiveSet {
        let mut ranges: Vec<(u32, Range<u32>)> = Vec::new();
        for (part, range) in &self.all.ranges {
            let base = self.parts[*part as usize].base;
            for i in range.clone().filter(|i| wanted(base + i)) {
                match ranges.last_mut() {
                    Some((last, run)) if last == part && run.end == i => run.end += 1,
                    _ => ranges.push((*part, i..i + 1)),
                }
            }
        }
        PrimitiveSet { ranges, tree: self.all.tree }
    }

    /// Returns a set of two groups of primitives: those with the numbers `primitives`, which must be in
    /// the BVH, and all primitives outside of the BVH. Rays are tested against each primitive of
    /// the set, without traversal of the BVH.
    pub fn select_indices(&self, primitives: &[u32]) -> PrimitiveSet {
        let mut ranges = self.all.ranges.clone();
        for primitive in primitives {
            let part = self.parts.partition_point(|part| part.end <= *primitive);
            let i = primitive - self.parts[part].base;
            ranges.push((part as u32, i..i + 1));
        }
        ranges.sort_unstable_by_key(|(part, range)| (*part, range.start));
        PrimitiveSet { ranges, tree: false }
    }

    /// Returns the numbers of the primitives in the BVH, in ascending order.
    pub fn in_tree(&self) -> Vec<u32> {
        let primitive = |(part, i): &(u32, u32)| self.parts[*part as usize].base + i;
        self.tree_primitives.iter().map(primitive).collect()
    }

    /// Returns `true` if the aggregate has a BVH.
    pub fn has_tree(&self) -> bool {
        self.tree.is_some()
    }

    /// Returns `true` if there is neither a BVH nor a list of bounding boxes of primitives.
    pub fn has_no_tree(&self) -> bool {
        self.tree.is_none() && self.extents.is_empty()
    }

    /// Returns the set of all primitives of the aggregate.
    pub fn all(&self) -> &PrimitiveSet {
        &self.all
    }

    /// Returns `true` if there are no primitives.
    pub fn is_empty(&self) -> bool {
        self.source.is_empty()
    }

    /// Returns the origin of each primitive: the index of its canonical form, and the number of its
    /// part if the form is a compound.
    pub fn sources(&self) -> &[PrimitiveId] {
        &self.source
    }

    /// Returns the closest hit of each ray with the primitives of `set`. At equal distances the
    /// primitive with the lowest number is hit, so that the result is independent of the order of
    /// the BVH and of the other rays of the packet.
    #[inline(always)]
    pub fn closest(&self, ray: &Ray<L>, set: &PrimitiveSet) -> Hit<L> {
        self.closest_masked(ray, set, L::mask(true))
    }

    /// Returns the result of [`Aggregate::closest`] in the lanes of `wanted`; other lanes are
    /// undefined.
    #[inline(always)]
    pub fn closest_masked(&self, ray: &Ray<L>, set: &PrimitiveSet, wanted: L::Mask) -> Hit<L> {
        if !self.extents.is_empty() {
            return self.closest_boxed(ray, set, nearest_wanted(wanted));
        }
        let hit = self.closest_linear(ray, set, wanted);
        match &self.tree {
            Some(tree) if set.tree => self.closest_bvh(tree, ray, hit),
            _ => hit,
        }
    }

    /// Returns the result of [`Aggregate::closest_masked`] for those primitives of `set` that are
    /// tested one by one, without traversal of the BVH. No bounding boxes are used.
    #[inline(always)]
    pub fn closest_linear(&self, ray: &Ray<L>, set: &PrimitiveSet, wanted: L::Mask) -> Hit<L> {
        let mut hit = nearest_wanted(wanted);
        for (part, range) in &set.ranges {
            let part = &self.parts[*part as usize];
            part.batch.closest(indices(range), part.base, ray, &mut hit);
        }
        hit
    }

    #[inline(never)]
    fn closest_bvh(&self, tree: &SceneBvh, ray: &Ray<L>, mut hit: Hit<L>) -> Hit<L> {
        tree.traverse(ray, hit.t, |primitive, limit| {
            let (part, i) = self.tree_primitives[primitive];
            let part = &self.parts[part as usize];
            // The limit is widened by rounding errors, so that hits at the distance of the current
            // hit are found, too. Of two hits at the same distance, `merge` keeps the primitive
            // with the lower number.
            let mut primitive_hit = Hit::with_t_max(limit * L::from_f64(1.0 + 2.0 * L::EPSILON));
            part.batch.closest(indices(&(i..i + 1)), part.base, ray, &mut primitive_hit);
            // Inactive lanes have a negative limit; here they become misses.
            primitive_hit.t =
                L::select(primitive_hit.t.gt(L::zero()), primitive_hit.t, L::from_f64(L::MAX));
            hit.merge(&primitive_hit);
            hit.t
        });
        hit
    }

    /// Iterates over the primitives of `set` that are tested one by one, without BVH. An element
    /// has three values: the batch of the primitive (all primitives of its kind), its number in the
    /// batch, and its bounding box. The box is `None` for an infinite primitive.
    #[inline(always)]
    fn boxed<'a>(
        &'a self,
        set: &'a PrimitiveSet,
    ) -> impl Iterator<Item = (&'a BatchRange<L>, u32, Option<&'a PrimitiveBox<L::Scalar>>)> {
        set.ranges.iter().flat_map(move |(part, range)| {
            let part = &self.parts[*part as usize];
            range.clone().map(move |i| (part, i, self.extents[(part.base + i) as usize].as_ref()))
        })
    }

    #[inline(never)]
    fn closest_boxed(&self, ray: &Ray<L>, set: &PrimitiveSet, mut hit: Hit<L>) -> Hit<L> {
        for (part, i, extent) in self.boxed(set) {
            if extent.is_none_or(|extent| extent.meets(ray, hit.t).any()) {
                part.batch.closest(indices(&(i..i + 1)), part.base, ray, &mut hit);
            }
        }
        hit
    }

    #[inline(never)]
    fn blocked_in_boxes(
        &self,
        ray: &Ray<L>,
        limit: L,
        wanted: L::Mask,
        set: &PrimitiveSet,
    ) -> L::Mask {
        let mut occluded = L::mask(false);
        for (part, i, extent) in self.boxed(set) {
            let open = wanted.and_not(occluded);
            let open = extent.map_or(open, |extent| open & extent.meets(ray, limit));
            if open.any() {
                let new = part.batch.occluded(indices(&(i..i + 1)), ray, limit, open);
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
        if !self.extents.is_empty() {
            return self.blocked_in_boxes(ray, limit, wanted, set);
        }
        let occluded = self.occluded_linear(ray, limit, wanted, set);
        match &self.tree {
            Some(tree) if set.tree && wanted.and_not(occluded).any() => {
                self.blocked_in(tree, ray, limit, wanted, occluded)
            }
            _ => occluded,
        }
    }

    /// Returns the lanes of `wanted` whose ray hits, at a distance between 0 and `limit`, one of
    /// those primitives of `set` that are tested one by one, without traversal of the BVH. No
    /// bounding boxes are used.
    #[inline(always)]
    pub fn occluded_linear(
        &self,
        ray: &Ray<L>,
        limit: L,
        wanted: L::Mask,
        set: &PrimitiveSet,
    ) -> L::Mask {
        let mut occluded = L::mask(false);
        for (part, range) in &set.ranges {
            let open = wanted.and_not(occluded);
            let batch = &self.parts[*part as usize].batch;
            occluded = occluded | batch.occluded(indices(range), ray, limit, open);
            if wanted.and_not(occluded).none() {
                break;
            }
        }
        occluded
    }

    /// Returns the lanes of `wanted` whose ray hits one given primitive of the BVH at a distance
    /// between 0 and `limit`. `number` is the primitive's index in [`Aggregate::in_tree`].
    #[inline(always)]
    pub fn occluded_by(&self, number: u32, ray: &Ray<L>, limit: L, wanted: L::Mask) -> L::Mask {
        let (part, i) = self.tree_primitives[number as usize];
        self.parts[part as usize].batch.occluded(indices(&(i..i + 1)), ray, limit, wanted)
    }

    #[inline(never)]
    fn blocked_in(
        &self,
        tree: &SceneBvh,
        ray: &Ray<L>,
        limit: L,
        wanted: L::Mask,
        mut occluded: L::Mask,
    ) -> L::Mask {
        let limit_of = |occluded| L::select(wanted.and_not(occluded), limit, L::from_f64(-1.0));
        tree.traverse(ray, limit_of(occluded), |primitive, left| {
            let open = left.gt(L::zero());
            let new = self.occluded_by(primitive as u32, ray, left, open);
            occluded = occluded | (new & open);
            limit_of(occluded)
        });
        occluded
    }

    /// Returns the hits of the rays with `primitive` that are nearer than `limit`. If
    /// `primitive` is the first part of a compound, these are the hits with the whole compound.
    pub fn closest_to(&self, primitive: u32, ray: &Ray<L>, limit: L) -> Hit<L> {
        let part = &self.parts[self.parts.partition_point(|part| part.end <= primitive)];
        let (i, mut hit) = ((primitive - part.base) as usize, Hit::with_t_max(limit));
        part.batch.closest(i..i + 1, part.base, ray, &mut hit);
        hit
    }

    /// Returns the projection of `point` onto the surface of `primitive`, with the normal
    /// there. `point` is the computed hit point of a ray, with rounding errors. `triangle_tag` is
    /// the id of the hit triangle if the primitive is a mesh.
    #[inline(always)]
    pub fn surface(&self, primitive: u32, triangle_tag: L, point: Vec3<L>) -> SurfacePoint<L> {
        for part in &self.parts {
            if primitive < part.end {
                return part.batch.surface((primitive - part.base) as usize, triangle_tag, point);
            }
        }
        unreachable!("every primitive belongs to a part")
    }

    /// Returns two values: all mesh primitives of the aggregate, and the number of the first one.
    /// The others have the following numbers, which are the highest of the aggregate. Returns
    /// `None` if there are no meshes.
    fn meshes(&self) -> Option<(&Meshes<L::Scalar>, u32)> {
        match self.parts.last()? {
            BatchRange { batch: PrimitiveBatch::Meshes(meshes), base, .. } => Some((meshes, *base)),
            _ => None,
        }
    }

    /// Returns `true` if some primitive has interpolated normals; see
    /// [`Aggregate::shading_normal`].
    pub fn is_smooth(&self) -> bool {
        self.meshes().is_some_and(|(meshes, _)| meshes.is_smooth())
    }

    /// Returns `true` if some primitive has vertex or face colours; see [`Aggregate::color`].
    pub fn is_colored(&self) -> bool {
        self.meshes().is_some_and(|(meshes, _)| meshes.is_colored())
    }

    /// Returns the shading normal of `primitive` at a hit point. `triangle_tag` is the id of
    /// the hit triangle if the primitive is a mesh. `at` has two vectors: the hit point, and the
    /// geometric normal on the viewer's side. `direction` is the direction of the rays. The angles
    /// of the shading normal to the geometric normal and to the direction of the viewer are below
    /// 90 degrees.
    pub fn shading_normal(
        &self,
        (primitive, triangle_tag): (u32, L),
        at: (Vec3<L>, Vec3<L>),
        direction: Vec3<L>,
    ) -> Vec3<L> {
        match self.meshes() {
            Some((meshes, base)) if primitive >= base => {
                meshes.shading_normal((primitive - base) as usize, triangle_tag, at, direction)
            }
            _ => at.1,
        }
    }

    /// Returns the colour that the mesh file of `primitive` gives to the triangle with the id
    /// `triangle_tag`. Returns `None` if the primitive is no mesh, or if the file has no colours.
    pub fn color(&self, primitive: u32, triangle_tag: L) -> Option<Vec3<L>> {
        let (meshes, base) = self.meshes()?;
        (primitive >= base).then(|| meshes.color((primitive - base) as usize, triangle_tag))?
    }

    /// Returns the texture coordinates that the geometry of `primitive` defines at `point`;
    /// `None` if it defines none. `triangle_tag` is the id of the triangle at `point` if the
    /// primitive is a mesh.
    pub fn uv(&self, primitive: u32, triangle_tag: L, point: Vec3<L>) -> Option<UvGradients<L>> {
        let part = &self.parts[self.parts.partition_point(|part| part.end <= primitive)];
        part.batch.uv((primitive - part.base) as usize, triangle_tag, point)
    }
}

/// Returns a miss in every lane, with which the search for the closest hit begins. The lanes of
/// `wanted` accept hits at any distance. Other lanes accept none, because their distance limit is
/// negative.
#[inline(always)]
fn nearest_wanted<L: SimdFloat>(wanted: L::Mask) -> Hit<L> {
    Hit::with_t_max(L::select(wanted, L::from_f64(L::MAX), L::from_f64(-1.0)))
}

fn indices(range: &Range<u32>) -> Range<usize> {
    range.start as usize..range.end as usize
}

impl<L: SimdFloat> fmt::Display for Aggregate<L> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.counts.is_empty() {
            return f.write_str("no objects");
        }
        f.write_str(&self.counts.join(", "))
    }
}
