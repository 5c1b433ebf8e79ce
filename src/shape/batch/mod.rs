//! What rays meet: one batch per form, all items of a form side by side, so that a form that does
//! not occur costs nothing.

mod compound;
mod convex;
mod ellipsoid;
mod flat;
mod span;
mod sphere;
mod tapered;

use super::form::Form;
use crate::lanes::{Lanes, Mask, V3};
use std::ops::Range;

/// A packet of half-lines.
#[derive(Clone, Copy, Debug)]
pub struct Ray<L> {
    /// Origins.
    pub origin: V3<L>,
    /// Directions, of unit length.
    pub direction: V3<L>,
}

impl<L: Lanes> Ray<L> {
    /// The point at distance `t`.
    #[inline(always)]
    pub fn at(&self, t: L) -> V3<L> {
        self.direction.mul_add(t, self.origin)
    }
}

/// The nearest crossing found so far.
#[derive(Clone, Copy, Debug)]
pub struct Hit<L> {
    /// Distance along the ray; `L::MAX`: nothing met.
    pub t: L,
    /// Tag of the item met; meaningless where nothing was.
    pub item: L,
}

impl<L: Lanes> Hit<L> {
    /// Nothing met.
    #[inline(always)]
    pub fn none() -> Self {
        Self { t: L::of(L::MAX), item: L::tag(0) }
    }

    /// Takes `t` and `item` where `t` is positive, nearer than what is known, and `mask` is true.
    #[inline(always)]
    fn narrow(&mut self, mask: L::Mask, t: L, item: u32) {
        let nearer = mask & t.gt(L::zero()) & t.lt(self.t);
        self.t = L::select(nearer, t, self.t);
        self.item = L::select(nearer, L::tag(item), self.item);
    }

    /// Takes `other` where it is nearer, or as near with a lower tag.
    #[inline(always)]
    pub(super) fn take(&mut self, other: &Self) {
        let mut nearer = other.t.lt(self.t);
        let tie = (other.t.le(self.t) & other.t.lt(L::of(L::MAX))).and_not(nearer);
        // Rare; and tags are subnormal as floats, which some processors compare slowly.
        if tie.any() {
            nearer = nearer | (tie & other.item.lt(self.item));
        }
        self.t = L::select(nearer, other.t, self.t);
        self.item = L::select(nearer, other.item, self.item);
    }
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug)]
pub struct Surface<L> {
    /// The point, put back on the surface as exactly as the precision allows.
    pub point: V3<L>,
    /// Unit geometric normal: outward for solids, on the front for flat shapes.
    pub normal: V3<L>,
    /// Largest magnitude of a coordinate that took part in computing the point: its rounding error
    /// is a few units of the last place of this.
    pub reach: L,
}

/// All items of one form.
pub trait Batch<L: Lanes>: Send + Sync {
    /// Narrows `hit` by the items in `range`; an item's tag is `base` + its number.
    fn closest(&self, range: Range<usize>, base: u32, ray: &Ray<L>, hit: &mut Hit<L>);

    /// Where a surface of the items in `range` lies at a distance in (0, limit) of the ray. May stop
    /// early once all lanes of `wanted` are blocked.
    fn blocked(&self, range: Range<usize>, ray: &Ray<L>, limit: L, wanted: L::Mask) -> L::Mask;

    /// The surface of `item` at `point` (near it, from `ray.at(t)`).
    fn surface(&self, item: usize, point: V3<L>) -> Surface<L>;
}

/// Collects forms, then compiles those that occur.
#[derive(Default)]
struct Sorted {
    spheres: Vec<(usize, Form)>,
    ellipsoids: Vec<(usize, Form)>,
    convex: Vec<(usize, Form)>,
    tapered: Vec<(usize, Form)>,
    compounds: Vec<(usize, Form)>,
    parallelograms: Vec<(usize, Form)>,
    planes: Vec<(usize, Form)>,
}

/// What an item came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Source {
    /// Position in the list given to [`compile`].
    pub form: usize,
    /// Which part of a compound; 0 for all other forms. Part 0 stands for the whole compound where
    /// rays ask for items; its other parts never meet anything by themselves.
    pub part: usize,
}

/// A compiled batch and what its items came from.
pub struct Compiled<L: Lanes> {
    /// The batch.
    pub batch: Box<dyn Batch<L>>,
    /// `sources[item]`: which form, which part of it.
    pub sources: Vec<Source>,
    /// How the inventory counts the items: singular and plural.
    pub noun: (&'static str, &'static str),
    /// Items without an end, which no tree can hold.
    pub infinite: bool,
}

/// One batch per form that occurs in `forms`.
pub fn compile<L: Lanes>(forms: &[Form]) -> Vec<Compiled<L>> {
    let mut sorted = Sorted::default();
    for (i, form) in forms.iter().enumerate() {
        let list = match form {
            Form::Sphere { .. } => &mut sorted.spheres,
            Form::Ellipsoid { .. } => &mut sorted.ellipsoids,
            Form::Convex { .. } => &mut sorted.convex,
            Form::Tapered { .. } => &mut sorted.tapered,
            Form::Compound(_) => &mut sorted.compounds,
            Form::Parallelogram { .. } => &mut sorted.parallelograms,
            Form::Plane { .. } => &mut sorted.planes,
        };
        list.push((i, form.clone()));
    }
    let mut out = Vec::new();
    let mut add =
        |list: Vec<(usize, Form)>, noun, infinite, batch: fn(&[Form]) -> Box<dyn Batch<L>>| {
            if !list.is_empty() {
                let (numbers, forms): (Vec<_>, Vec<_>) = list.into_iter().unzip();
                let mut sources = Vec::new();
                for (source, form) in numbers.into_iter().zip(&forms) {
                    sources.extend((0..form.parts()).map(|part| Source { form: source, part }));
                }
                out.push(Compiled { batch: batch(&forms), sources, noun, infinite });
            }
        };
    add(sorted.parallelograms, ("rectangle", "rectangles"), false, |f| {
        Box::new(flat::Parallelograms::new(f))
    });
    add(sorted.planes, ("plane", "planes"), true, |f| Box::new(flat::Planes::new(f)));
    add(sorted.spheres, ("sphere", "spheres"), false, |f| Box::new(sphere::Spheres::new(f)));
    add(sorted.ellipsoids, ("ellipsoid", "ellipsoids"), false, |f| {
        Box::new(ellipsoid::Ellipsoids::new(f))
    });
    add(sorted.convex, ("convex solid", "convex solids"), false, |f| {
        Box::new(convex::Convexes::new(f))
    });
    add(sorted.tapered, ("tapered cylinder", "tapered cylinders"), false, |f| {
        Box::new(tapered::Tapereds::new(f))
    });
    add(sorted.compounds, ("compound", "compounds"), false, |f| {
        Box::new(compound::Compounds::new(f))
    });
    out
}

/// Largest magnitude of a coordinate in a bounded form.
fn reach(form: &Form) -> f64 {
    form.bounds().map_or(0.0, |(low, high)| low.abs().max(high.abs()).max_element())
}
