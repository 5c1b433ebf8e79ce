//! All primitives of a scene, compiled for rays: batches, and a tree over them where it pays.

use crate::bvh::{Hit, Ray};
use crate::lanes::{Mask, SimdFloat, Vec3};
use crate::primitive::batch::{
    LabelledBatch, PrimitiveBatch, PrimitiveId, SurfacePoint, UvGradients, compile,
};
use crate::primitive::form::Form;
use crate::primitive::item_box::{Acceleration, ItemBox};
use crate::primitive::mesh_instance::Meshes;
use crate::primitive::scene_bvh::SceneBvh;
use std::fmt;
use std::ops::Range;

/// From this many bounded items there is a tree. With rays in a ball of spheres it is faster than a list
/// from some 50 where packets stay together, and from some 300 where they do not; whole pictures, of which a
/// list's tiles leave out what they do not see, gain by the list up to 95 (`benches/acceleration.rs`).
pub const BVH_MIN_PRIMITIVES: usize = 96;

impl PrimitiveSet {
    /// Returns `true` if there are none.
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty() && !self.tree
    }
}

/// One batch and where its items stand in the numbering of all items.
struct BatchRange<L: SimdFloat> {
    batch: PrimitiveBatch<L>,
    base: u32,
    end: u32,
}

/// Primitives of a scene, compiled for one lane type.
pub struct Aggregate<L: SimdFloat> {
    parts: Vec<BatchRange<L>>,
    all: PrimitiveSet,
    tree: Option<SceneBvh>,
    /// `(part, number in the part)` of the tree's items.
    tree_items: Vec<(u32, u32)>,
    /// For each item a box that is asked first, if it has one; empty: none has.
    extents: Vec<Option<ItemBox<L::Scalar>>>,
    /// `source[item]`: which form, in the order given to [`Aggregate::new`], and which part of it.
    source: Vec<PrimitiveId>,
    counts: Vec<String>,
}

/// Some items of a geometry.
#[derive(Clone, Debug, Default)]
pub struct PrimitiveSet {
    /// Items that are no tree's, by part and number in the part.
    ranges: Vec<(u32, Range<u32>)>,
    /// All items of the tree.
    tree: bool,
}

impl<L: SimdFloat> Aggregate<L> {
    /// Compiles `forms`, as a list or with a tree by their number.
    pub fn new(forms: &[Form]) -> Self {
        Self::accelerated(forms, Acceleration::Auto)
    }

    /// Compiles `forms` with or without a tree, whatever their number.
    pub fn with_tree(forms: &[Form], tree: bool) -> Self {
        Self::compiled(forms, if tree { Acceleration::Bvh } else { Acceleration::Auto }, tree)
    }

    /// Compiles `forms` with what `acceleration` says.
    pub fn accelerated(forms: &[Form], acceleration: Acceleration) -> Self {
        let many = || forms.iter().filter(|f| f.bounds().is_some()).count() >= BVH_MIN_PRIMITIVES;
        let tree = match acceleration {
            Acceleration::Auto => many(),
            Acceleration::Bvh => true,
            _ => false,
        };
        Self::compiled(forms, acceleration, tree)
    }

    fn compiled(forms: &[Form], acceleration: Acceleration, tree: bool) -> Self {
        let mut out = Self {
            parts: Vec::new(),
            all: PrimitiveSet::default(),
            tree: None,
            tree_items: Vec::new(),
            extents: Vec::new(),
            source: Vec::new(),
            counts: Vec::new(),
        };
        let how_listed = match acceleration {
            Acceleration::Auto | Acceleration::Bvh => "list",
            Acceleration::None => "bare list",
            Acceleration::ScreenBounds => "screen rectangles",
            Acceleration::Obb => "boxes of their own",
            Acceleration::Aabb => "boxes",
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
                    out.tree_items.push((part, i as u32));
                }
            } else {
                out.all.ranges.push((part, 0..sources.len() as u32));
            }
            out.source.extend(&sources);
            out.parts.push(BatchRange { batch, base, end: out.source.len() as u32 });
        }
        out.tree = (!bounds.is_empty()).then(|| SceneBvh::new(&bounds));
        out.all.tree = out.tree.is_some();
        if matches!(acceleration, Acceleration::Obb | Acceleration::Aabb) {
            let own = acceleration == Acceleration::Obb;
            let of = |source: &PrimitiveId| ItemBox::new(&forms[source.form], own);
            out.extents = out.source.iter().map(of).collect();
        }
        out
    }

    /// Those items for which `wanted` is true; all of those in a tree, which knows better.
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

    /// Those `items` of a tree, and all that are in none.
    pub fn select_indices(&self, items: &[u32]) -> PrimitiveSet {
        let mut ranges = self.all.ranges.clone();
        for item in items {
            let part = self.parts.partition_point(|part| part.end <= *item);
            let i = item - self.parts[part].base;
            ranges.push((part as u32, i..i + 1));
        }
        ranges.sort_unstable_by_key(|(part, range)| (*part, range.start));
        PrimitiveSet { ranges, tree: false }
    }

    /// The items that stand in a tree, in ascending order.
    pub fn in_tree(&self) -> Vec<u32> {
        let item = |(part, i): &(u32, u32)| self.parts[*part as usize].base + i;
        self.tree_items.iter().map(item).collect()
    }

    /// Returns `true` if the bounded items stand in a tree.
    pub fn has_tree(&self) -> bool {
        self.tree.is_some()
    }

    /// Returns `true` if there is neither a tree nor a box: nothing but lists.
    pub fn has_no_tree(&self) -> bool {
        self.tree.is_none() && self.extents.is_empty()
    }

    /// All items.
    pub fn all(&self) -> &PrimitiveSet {
        &self.all
    }

    /// Number of items.
    pub fn len(&self) -> usize {
        self.source.len()
    }

    /// No items at all.
    pub fn is_empty(&self) -> bool {
        self.source.is_empty()
    }

    /// For each item, which form it came from, and which part of it.
    pub fn sources(&self) -> &[PrimitiveId] {
        &self.source
    }

    /// The nearest of some items in front of each ray; of several at the same distance the one with
    /// the lowest number, so that neither the order in the tree nor the other rays of the packet decide.
    #[inline(always)]
    pub fn closest(&self, ray: &Ray<L>, of: &PrimitiveSet) -> Hit<L> {
        self.closest_masked(ray, of, L::mask(true))
    }

    /// As [`Aggregate::closest`], in those lanes for which `wanted` is true; the others are meaningless.
    #[inline(always)]
    pub fn closest_masked(&self, ray: &Ray<L>, of: &PrimitiveSet, wanted: L::Mask) -> Hit<L> {
        if !self.extents.is_empty() {
            return self.closest_boxed(ray, of, nearest_wanted(wanted));
        }
        let hit = self.closest_linear(ray, of, wanted);
        match &self.tree {
            Some(tree) if of.tree => self.closest_bvh(tree, ray, hit),
            _ => hit,
        }
    }

    /// As [`Aggregate::closest_masked`], of those items that are in no tree; boxes are not asked.
    #[inline(always)]
    pub fn closest_linear(&self, ray: &Ray<L>, of: &PrimitiveSet, wanted: L::Mask) -> Hit<L> {
        let mut hit = nearest_wanted(wanted);
        for (part, range) in &of.ranges {
            let part = &self.parts[*part as usize];
            part.batch.closest(indices(range), part.base, ray, &mut hit);
        }
        hit
    }

    #[inline(never)]
    fn closest_bvh(&self, tree: &SceneBvh, ray: &Ray<L>, mut hit: Hit<L>) -> Hit<L> {
        tree.traverse(ray, hit.t, |item, limit| {
            let (part, i) = self.tree_items[item];
            let part = &self.parts[part as usize];
            // As near is near enough: of equal distances the lowest tag counts.
            let mut one = Hit::with_t_max(limit * L::from_f64(1.0 + 2.0 * L::EPSILON));
            part.batch.closest(indices(&(i..i + 1)), part.base, ray, &mut one);
            // Lanes of no interest have met nothing.
            one.t = L::select(one.t.gt(L::zero()), one.t, L::from_f64(L::MAX));
            hit.merge(&one);
            hit.t
        });
        hit
    }

    /// The items of `of`, as a part and the number in it, with their boxes.
    #[inline(always)]
    fn boxed<'a>(
        &'a self,
        of: &'a PrimitiveSet,
    ) -> impl Iterator<Item = (&'a BatchRange<L>, u32, Option<&'a ItemBox<L::Scalar>>)> {
        of.ranges.iter().flat_map(move |(part, range)| {
            let part = &self.parts[*part as usize];
            range.clone().map(move |i| (part, i, self.extents[(part.base + i) as usize].as_ref()))
        })
    }

    #[inline(never)]
    fn closest_boxed(&self, ray: &Ray<L>, of: &PrimitiveSet, mut hit: Hit<L>) -> Hit<L> {
        for (part, i, extent) in self.boxed(of) {
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
        by: &PrimitiveSet,
    ) -> L::Mask {
        let mut occluded = L::mask(false);
        for (part, i, extent) in self.boxed(by) {
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

    /// Lanes of `wanted` that hit any of some items at a distance in (0, limit).
    #[inline(always)]
    pub fn occluded(&self, ray: &Ray<L>, limit: L, wanted: L::Mask, by: &PrimitiveSet) -> L::Mask {
        if !self.extents.is_empty() {
            return self.blocked_in_boxes(ray, limit, wanted, by);
        }
        let occluded = self.occluded_linear(ray, limit, wanted, by);
        match &self.tree {
            Some(tree) if by.tree && wanted.and_not(occluded).any() => {
                self.blocked_in(tree, ray, limit, wanted, occluded)
            }
            _ => occluded,
        }
    }

    /// As [`Aggregate::occluded`], by those items that are in no tree; boxes are not asked.
    #[inline(always)]
    pub fn occluded_linear(
        &self,
        ray: &Ray<L>,
        limit: L,
        wanted: L::Mask,
        by: &PrimitiveSet,
    ) -> L::Mask {
        let mut occluded = L::mask(false);
        for (part, range) in &by.ranges {
            let open = wanted.and_not(occluded);
            let batch = &self.parts[*part as usize].batch;
            occluded = occluded | batch.occluded(indices(range), ray, limit, open);
            if wanted.and_not(occluded).none() {
                break;
            }
        }
        occluded
    }

    /// As [`Aggregate::occluded`], by one item of the tree: `number` in [`Aggregate::in_tree`].
    #[inline(always)]
    pub fn occluded_by(&self, number: u32, ray: &Ray<L>, limit: L, wanted: L::Mask) -> L::Mask {
        let (part, i) = self.tree_items[number as usize];
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
        tree.traverse(ray, limit_of(occluded), |item, left| {
            let open = left.gt(L::zero());
            let new = self.occluded_by(item as u32, ray, left, open);
            occluded = occluded | (new & open);
            limit_of(occluded)
        });
        occluded
    }

    /// Hits of rays with `item`, a compound's first part for all of it, nearer than `limit`.
    pub fn closest_to(&self, item: u32, ray: &Ray<L>, limit: L) -> Hit<L> {
        let part = &self.parts[self.parts.partition_point(|part| part.end <= item)];
        let (i, mut hit) = ((item - part.base) as usize, Hit::with_t_max(limit));
        part.batch.closest(i..i + 1, part.base, ray, &mut hit);
        hit
    }

    /// The surface of `item` near `point`; `facet`: as the hit has it.
    #[inline(always)]
    pub fn surface(&self, item: u32, facet: L, point: Vec3<L>) -> SurfacePoint<L> {
        for part in &self.parts {
            if item < part.end {
                return part.batch.surface((item - part.base) as usize, facet, point);
            }
        }
        unreachable!("every item belongs to a part")
    }

    /// The meshes, and the number of the first; they are the last of all items.
    fn meshes(&self) -> Option<(&Meshes<L::Scalar>, u32)> {
        match self.parts.last()? {
            BatchRange { batch: PrimitiveBatch::Meshes(meshes), base, .. } => Some((meshes, *base)),
            _ => None,
        }
    }

    /// Returns `true` if light sees other normals than the surfaces' own anywhere: [`Aggregate::shading_normal`].
    pub fn is_smooth(&self) -> bool {
        self.meshes().is_some_and(|(meshes, _)| meshes.is_smooth())
    }

    /// Returns `true` if primitives have colours of their own: [`Aggregate::color`].
    pub fn is_colored(&self) -> bool {
        self.meshes().is_some_and(|(meshes, _)| meshes.is_colored())
    }

    /// The normal that light is computed with where rays along `direction` meet `item` at `point`, whose
    /// geometric normal on the viewer's side is `normal`: on the same side, and facing the viewer.
    pub fn shading_normal(
        &self,
        (item, facet): (u32, L),
        at: (Vec3<L>, Vec3<L>),
        direction: Vec3<L>,
    ) -> Vec3<L> {
        match self.meshes() {
            Some((meshes, base)) if item >= base => {
                meshes.shading_normal((item - base) as usize, facet, at, direction)
            }
            _ => at.1,
        }
    }

    /// The colour of its own that `item` has at `facet`, if it has one.
    pub fn color(&self, item: u32, facet: L) -> Option<Vec3<L>> {
        let (meshes, base) = self.meshes()?;
        (item >= base).then(|| meshes.color((item - base) as usize, facet))?
    }

    /// Texture coordinates that `item` has of its own at `point`, near its triangles tagged `facet`; `None`
    /// if it has none.
    pub fn uv(&self, item: u32, facet: L, point: Vec3<L>) -> Option<UvGradients<L>> {
        let part = &self.parts[self.parts.partition_point(|part| part.end <= item)];
        part.batch.uv((item - part.base) as usize, facet, point)
    }
}

/// An empty hit; inactive lanes get a negative `t_max`.
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
