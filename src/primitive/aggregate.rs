//! All primitives of a scene, compiled for rays: batches, and a BVH over them where it is faster.

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

/// Least number of bounded items for a BVH. With rays in a ball of spheres the BVH is faster than a
/// list from about 50 items for coherent packets, and from about 300 for incoherent ones. Whole
/// pictures, whose tiles skip the items of the list that they cannot see, are faster with the list
/// up to 95 (`benches/acceleration.rs`).
pub const BVH_MIN_PRIMITIVES: usize = 96;

impl PrimitiveSet {
    /// Returns `true` if the set is empty.
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty() && !self.tree
    }
}

/// One batch and the range of its items in the numbering of all items.
struct BatchRange<L: SimdFloat> {
    batch: PrimitiveBatch<L>,
    base: u32,
    end: u32,
}

/// Primitives of a scene, compiled for item_hit lane type.
pub struct Aggregate<L: SimdFloat> {
    parts: Vec<BatchRange<L>>,
    all: PrimitiveSet,
    tree: Option<SceneBvh>,
    /// Items of the BVH, as `(part, number in the part)`.
    tree_items: Vec<(u32, u32)>,
    /// Box of each item, tested before the item; `None` for an infinite item. Empty if no boxes are
    /// used.
    extents: Vec<Option<ItemBox<L::Scalar>>>,
    /// Form of each item, by position in the list given to [`Aggregate::new`], and its part.
    source: Vec<PrimitiveId>,
    counts: Vec<String>,
}

/// Set of items of an [`Aggregate`].
#[derive(Clone, Debug, Default)]
pub struct PrimitiveSet {
    /// Items outside the BVH, by part and number in the part.
    ranges: Vec<(u32, Range<u32>)>,
    /// `true` if the set includes all items of the BVH.
    tree: bool,
}

impl<L: SimdFloat> Aggregate<L> {
    /// Compiles `forms`, as a list or with a BVH depending on their number.
    pub fn new(forms: &[Form]) -> Self {
        Self::accelerated(forms, Acceleration::Auto)
    }

    /// Compiles `forms` with or without a BVH, regardless of their number.
    pub fn with_tree(forms: &[Form], tree: bool) -> Self {
        Self::compiled(forms, if tree { Acceleration::Bvh } else { Acceleration::Auto }, tree)
    }

    /// Compiles `forms` with the acceleration structure `acceleration`.
    pub fn accelerated(forms: &[Form], acceleration: Acceleration) -> Self {
        let is_large =
            || forms.iter().filter(|f| f.bounds().is_some()).count() >= BVH_MIN_PRIMITIVES;
        let tree = match acceleration {
            Acceleration::Auto => is_large(),
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
            let oriented = acceleration == Acceleration::Obb;
            let box_of = |source: &PrimitiveId| ItemBox::new(&forms[source.form], oriented);
            out.extents = out.source.iter().map(box_of).collect();
        }
        out
    }

    /// Returns the items for which `wanted` is true, and all items of the BVH, which culls by
    /// itself.
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

    /// Returns `items` of the BVH, and all items outside it.
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

    /// Returns the items in the BVH, in ascending order.
    pub fn in_tree(&self) -> Vec<u32> {
        let item = |(part, i): &(u32, u32)| self.parts[*part as usize].base + i;
        self.tree_items.iter().map(item).collect()
    }

    /// Returns `true` if the bounded items are in a BVH.
    pub fn has_tree(&self) -> bool {
        self.tree.is_some()
    }

    /// Returns `true` if there are neither BVH nor boxes: only lists.
    pub fn has_no_tree(&self) -> bool {
        self.tree.is_none() && self.extents.is_empty()
    }

    /// Returns the set of all items.
    pub fn all(&self) -> &PrimitiveSet {
        &self.all
    }

    /// Returns the number of items.
    pub fn len(&self) -> usize {
        self.source.len()
    }

    /// Returns `true` if there are no items.
    pub fn is_empty(&self) -> bool {
        self.source.is_empty()
    }

    /// Returns the form and part of each item.
    pub fn sources(&self) -> &[PrimitiveId] {
        &self.source
    }

    /// Returns the closest hit of each ray with the items of `set`. At equal distances the item
    /// with the lowest number wins, so that the result depends neither on the order in the BVH nor
    /// on the other rays of the packet.
    #[inline(always)]
    pub fn closest(&self, ray: &Ray<L>, set: &PrimitiveSet) -> Hit<L> {
        self.closest_masked(ray, set, L::mask(true))
    }

    /// [`Aggregate::closest`] for the lanes in `wanted`; other lanes are meaningless.
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

    /// [`Aggregate::closest_masked`] for items outside the BVH, without tests of boxes.
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
        tree.traverse(ray, hit.t, |item, limit| {
            let (part, i) = self.tree_items[item];
            let part = &self.parts[part as usize];
            // The limit is widened by rounding: at equal distances the lowest tag wins.
            let mut item_hit = Hit::with_t_max(limit * L::from_f64(1.0 + 2.0 * L::EPSILON));
            part.batch.closest(indices(&(i..i + 1)), part.base, ray, &mut item_hit);
            // Inactive lanes have no hit.
            item_hit.t = L::select(item_hit.t.gt(L::zero()), item_hit.t, L::from_f64(L::MAX));
            hit.merge(&item_hit);
            hit.t
        });
        hit
    }

    /// Returns each item of `set` with its batch range, its number in that range and its box.
    #[inline(always)]
    fn boxed<'a>(
        &'a self,
        set: &'a PrimitiveSet,
    ) -> impl Iterator<Item = (&'a BatchRange<L>, u32, Option<&'a ItemBox<L::Scalar>>)> {
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

    /// Returns the lanes of `wanted` that hit any item of `set` at a distance in (0, limit).
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

    /// [`Aggregate::occluded`] by items outside the BVH, without tests of boxes.
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

    /// [`Aggregate::occluded`] by item_hit item of the BVH; `number` is its position in
    /// [`Aggregate::in_tree`].
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

    /// Returns hits nearer than `limit` with `item`; the first part of a compound represents all of
    /// it.
    pub fn closest_to(&self, item: u32, ray: &Ray<L>, limit: L) -> Hit<L> {
        let part = &self.parts[self.parts.partition_point(|part| part.end <= item)];
        let (i, mut hit) = ((item - part.base) as usize, Hit::with_t_max(limit));
        part.batch.closest(i..i + 1, part.base, ray, &mut hit);
        hit
    }

    /// Returns the surface of `item` near `point`; `triangle_tag` is the triangle of the hit.
    #[inline(always)]
    pub fn surface(&self, item: u32, triangle_tag: L, point: Vec3<L>) -> SurfacePoint<L> {
        for part in &self.parts {
            if item < part.end {
                return part.batch.surface((item - part.base) as usize, triangle_tag, point);
            }
        }
        unreachable!("every item belongs to a part")
    }

    /// Returns the meshes and the number of the first mesh item. Meshes are last in the numbering.
    fn meshes(&self) -> Option<(&Meshes<L::Scalar>, u32)> {
        match self.parts.last()? {
            BatchRange { batch: PrimitiveBatch::Meshes(meshes), base, .. } => Some((meshes, *base)),
            _ => None,
        }
    }

    /// Returns `true` if any surface has interpolated normals: [`Aggregate::shading_normal`].
    pub fn is_smooth(&self) -> bool {
        self.meshes().is_some_and(|(meshes, _)| meshes.is_smooth())
    }

    /// Returns `true` if primitives have colours of their own: [`Aggregate::color`].
    pub fn is_colored(&self) -> bool {
        self.meshes().is_some_and(|(meshes, _)| meshes.is_colored())
    }

    /// Returns the shading normal at `at`, the point of `item` that rays along `direction` hit and
    /// its geometric normal on the viewer's side. The shading normal is on the same side and faces
    /// the viewer.
    pub fn shading_normal(
        &self,
        (item, triangle_tag): (u32, L),
        at: (Vec3<L>, Vec3<L>),
        direction: Vec3<L>,
    ) -> Vec3<L> {
        match self.meshes() {
            Some((meshes, base)) if item >= base => {
                meshes.shading_normal((item - base) as usize, triangle_tag, at, direction)
            }
            _ => at.1,
        }
    }

    /// Returns the colour of `item` at the triangle `triangle_tag`; `None` if the item has none.
    pub fn color(&self, item: u32, triangle_tag: L) -> Option<Vec3<L>> {
        let (meshes, base) = self.meshes()?;
        (item >= base).then(|| meshes.color((item - base) as usize, triangle_tag))?
    }

    /// Returns the texture coordinates of `item` at `point`, near its triangle `triangle_tag`;
    /// `None` if the item has none.
    pub fn uv(&self, item: u32, triangle_tag: L, point: Vec3<L>) -> Option<UvGradients<L>> {
        let part = &self.parts[self.parts.partition_point(|part| part.end <= item)];
        part.batch.uv((item - part.base) as usize, triangle_tag, point)
    }
}

/// Returns an empty hit; inactive lanes get a negative `t_max`.
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
