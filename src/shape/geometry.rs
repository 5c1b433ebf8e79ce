//! All things of a scene, ready for rays: batches, and a tree over them where it pays.

use super::batch::{Batch, Compiled, Hit, Ray, Source, Surface, compile};
use super::form::Form;
use super::tree::Tree;
use crate::lanes::{Lanes, Mask, V3};
use glam::DVec3;
use std::fmt;

/// From this many bounded items a tree is faster than a list. Measured by `benches/kernel.rs`,
/// group `list or tree`: spheres in a ball cross over between 64 (list 1.35 times faster) and 256 (tree
/// 2.3 times faster).
pub const TREE_FROM: usize = 96;

/// One batch and where its items stand in the numbering of all items.
struct Part<L: Lanes> {
    batch: Box<dyn Batch<L>>,
    base: u32,
    end: u32,
    len: usize,
    in_tree: bool,
}

/// The things of a scene, compiled for one lane type.
pub struct Geometry<L: Lanes> {
    parts: Vec<Part<L>>,
    tree: Option<Tree<L>>,
    /// `(part, number in the part)` of the tree's items.
    tree_items: Vec<(u32, u32)>,
    /// `source[item]`: which form, in the order given to [`Geometry::new`], and which part of it.
    source: Vec<Source>,
    /// Bounding spheres of the items; `None`: without an end.
    spheres: Vec<Option<(DVec3, f64)>>,
    counts: Vec<String>,
}

/// Items that some rays can meet.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// `(part, number in the part)`.
    items: Vec<(u32, u32)>,
}

/// The sphere around a box.
fn around((low, high): (DVec3, DVec3)) -> (DVec3, f64) {
    (0.5 * (low + high), 0.5 * low.distance(high))
}

impl<L: Lanes> Geometry<L> {
    /// Compiles `forms`, as a list or with a tree by their number.
    pub fn new(forms: &[Form]) -> Self {
        let bounded = forms.iter().filter(|f| f.bounds().is_some()).count();
        Self::with_tree(forms, bounded >= TREE_FROM)
    }

    /// Compiles `forms` with or without a tree, whatever their number.
    pub fn with_tree(forms: &[Form], tree: bool) -> Self {
        let mut out = Self {
            parts: Vec::new(),
            tree: None,
            tree_items: Vec::new(),
            source: Vec::new(),
            spheres: Vec::new(),
            counts: Vec::new(),
        };
        let mut bounds = Vec::new();
        for Compiled { batch, sources, noun, infinite } in compile(forms) {
            let base = out.source.len() as u32;
            let in_tree = tree && !infinite;
            let how = if in_tree { "tree" } else { "list" };
            let whole = |source: &&Source| source.part == 0;
            let count = sources.iter().filter(whole).count();
            let name = if count == 1 { noun.0 } else { noun.1 };
            out.counts.push(format!("{count} {name} ({how})"));
            if in_tree {
                for (i, source) in sources.iter().enumerate().filter(|(_, s)| s.part == 0) {
                    bounds.extend(forms[source.form].bounds());
                    out.tree_items.push((out.parts.len() as u32, i as u32));
                }
            }
            let spheres = sources.iter().map(|s| forms[s.form].bounds().map(around));
            out.spheres.extend(spheres);
            out.source.extend(&sources);
            let end = out.source.len() as u32;
            out.parts.push(Part { batch, base, end, len: sources.len(), in_tree });
        }
        out.tree = (!bounds.is_empty()).then(|| Tree::new(&bounds));
        out
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
    pub fn sources(&self) -> &[Source] {
        &self.source
    }

    /// The nearest item in front of each ray; of several at the same distance the one with the lowest
    /// number, so that neither the order in the tree nor the other rays of the packet decide.
    #[inline]
    pub fn closest(&self, ray: &Ray<L>) -> Hit<L> {
        let mut hit = Hit::none();
        for part in self.parts.iter().filter(|p| !p.in_tree) {
            part.batch.closest(0..part.len, part.base, ray, &mut hit);
        }
        if let Some(tree) = &self.tree {
            tree.walk(ray, hit.t, |item, _| {
                let (part, i) = self.tree_items[item];
                let part = &self.parts[part as usize];
                let mut one = Hit::none();
                part.batch.closest(i as usize..i as usize + 1, part.base, ray, &mut one);
                hit.take(&one);
                hit.t
            });
        }
        hit
    }

    /// The items that rays inside a cone can meet: for many rays that leave one point, such as those
    /// of a tile of the picture. With a tree the tree knows better: then there are none to name.
    ///
    /// `axis` is a unit vector, `spread` the half-angle in radians, below pi / 2.
    pub fn seen_from(&self, apex: DVec3, axis: DVec3, spread: f64) -> Option<Seen> {
        if self.tree.is_some() {
            return None;
        }
        let sees = |(center, radius): &(DVec3, f64)| {
            let to = *center - apex;
            let distance = to.length();
            // Inside the sphere, or the angle between axis and centre is at most that of the cone
            // plus that of the sphere, with a little to spare for rounding.
            distance <= *radius * 1.001
                || to.angle_between(axis) <= spread + (*radius / distance).asin() + 1e-5
        };
        let mut items = Vec::new();
        for (p, part) in self.parts.iter().enumerate() {
            for i in 0..part.len {
                let item = part.base as usize + i;
                if self.source[item].part == 0 && self.spheres[item].as_ref().is_none_or(sees) {
                    items.push((p as u32, i as u32));
                }
            }
        }
        Some(Seen { items })
    }

    /// The nearest item in front of each ray, of those in `seen`.
    #[inline]
    pub fn closest_seen(&self, ray: &Ray<L>, seen: &Seen) -> Hit<L> {
        let mut hit = Hit::none();
        for (part, i) in &seen.items {
            let part = &self.parts[*part as usize];
            let i = *i as usize;
            part.batch.closest(i..i + 1, part.base, ray, &mut hit);
        }
        hit
    }

    /// Which lanes of `wanted` meet anything at a distance in (0, limit).
    #[inline]
    pub fn blocked(&self, ray: &Ray<L>, limit: L, wanted: L::Mask) -> L::Mask {
        let mut blocked = L::mask(false);
        for part in self.parts.iter().filter(|p| !p.in_tree) {
            let open = wanted.and_not(blocked);
            blocked = blocked | part.batch.blocked(0..part.len, ray, limit, open);
            if wanted.and_not(blocked).none() {
                return blocked;
            }
        }
        if let Some(tree) = &self.tree {
            let limit_of = |blocked| L::select(wanted.and_not(blocked), limit, L::of(-1.0));
            tree.walk(ray, limit_of(blocked), |item, left| {
                let (part, i) = self.tree_items[item];
                let i = i as usize;
                let open = wanted.and_not(blocked);
                let batch = &self.parts[part as usize].batch;
                let new = batch.blocked(i..i + 1, ray, left, open);
                blocked = blocked | (new & open);
                limit_of(blocked)
            });
        }
        blocked
    }

    /// The surface of `item` near `point`.
    #[inline]
    pub fn surface(&self, item: u32, point: V3<L>) -> Surface<L> {
        for part in &self.parts {
            if item < part.end {
                return part.batch.surface((item - part.base) as usize, point);
            }
        }
        unreachable!("every item belongs to a part")
    }
}

impl<L: Lanes> fmt::Display for Geometry<L> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.counts.is_empty() {
            return f.write_str("no objects");
        }
        f.write_str(&self.counts.join(", "))
    }
}
