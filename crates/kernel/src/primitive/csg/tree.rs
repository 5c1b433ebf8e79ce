//! Canonical form of compounds: their parts, and the tree of set operations that combines them.

use crate::primitive::canonical::{Bounds, CanonicalShape, Proxy};
use crate::primitive::csg::solid::Solid;
use crate::primitive::form::Form;
use glam::{DAffine3, DVec3};

/// Tree of set operations on the parts of a compound.
#[derive(Clone, Debug, PartialEq)]
pub enum CsgTree {
    /// Part, as its index in [`CsgSolid::parts`].
    Part(usize),
    /// Union: points in any of the operands.
    Union(Vec<CsgTree>),
    /// Intersection: points in all of the operands.
    Intersection(Vec<CsgTree>),
    /// Difference: points of the first operand that are in none of the others.
    Difference(Vec<CsgTree>),
}

impl CsgTree {
    /// Returns the tree with all part indices increased by `by`, for use as an operand of a larger
    /// compound.
    pub fn shifted(self, by: usize) -> Self {
        let all = |list: Vec<Self>| list.into_iter().map(|t| t.shifted(by)).collect();
        match self {
            Self::Part(i) => Self::Part(i + by),
            Self::Union(list) => Self::Union(all(list)),
            Self::Intersection(list) => Self::Intersection(all(list)),
            Self::Difference(list) => Self::Difference(all(list)),
        }
    }
}

/// Compound solid: several solids combined by set operations.
#[derive(Clone, Debug, PartialEq)]
pub struct CsgSolid {
    /// Solids that are combined; each can have a material of its own.
    pub parts: Vec<Solid>,
    /// Tree of set operations, in which every part occurs once, in the order of `parts`.
    pub tree: CsgTree,
    bounds: Option<Bounds>,
}

impl CanonicalShape for CsgSolid {
    fn bounds(&self) -> Option<Bounds> {
        self.bounds
    }

    fn thickness(&self) -> f64 {
        self.parts.iter().map(|form| form.thickness()).fold(f64::INFINITY, f64::min)
    }

    fn clearance(&self, point: DVec3) -> Option<f64> {
        self.parts.iter().filter_map(|part| part.clearance(point)).reduce(f64::min)
    }

    fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>> {
        self.parts.iter().flat_map(|part| part.normals_at(point, slack)).collect()
    }

    fn proxies(&self) -> Vec<Proxy> {
        self.parts.iter().flat_map(|form| form.proxies()).collect()
    }
}

impl CsgSolid {
    /// Combines `parts` by `tree`; `None` if a part is not a solid.
    pub fn new(parts: impl IntoIterator<Item = Form>, tree: CsgTree) -> Option<Self> {
        let parts = parts.into_iter().map(Form::into_solid).collect::<Option<_>>()?;
        Some(Self::of_solids(parts, tree))
    }

    /// Combines `parts` by `tree`.
    pub fn of_solids(parts: Vec<Solid>, tree: CsgTree) -> Self {
        let mut out = Self { parts, tree, bounds: None };
        out.bounds = out.bounds_of(&out.tree);
        out
    }

    pub(in crate::primitive) fn transformed(self, map: &DAffine3) -> Self {
        let parts = self.parts.into_iter().map(|p| p.transformed(map)).collect();
        Self::of_solids(parts, self.tree)
    }

    /// Returns `true` if the bounding boxes of the parts show that the solid has no points, for
    /// example an intersection of solids that are apart.
    pub fn is_empty(&self) -> bool {
        self.is_empty_tree(&self.tree)
    }

    fn is_empty_tree(&self, tree: &CsgTree) -> bool {
        match tree {
            CsgTree::Part(_) => false,
            CsgTree::Union(list) => list.iter().all(|tree| self.is_empty_tree(tree)),
            CsgTree::Intersection(list) => {
                let boxes = || list.iter().filter_map(|tree| self.bounds_of(tree));
                let low = boxes().map(|(low, _)| low).fold(DVec3::NEG_INFINITY, DVec3::max);
                let high = boxes().map(|(_, high)| high).fold(DVec3::INFINITY, DVec3::min);
                low.cmpgt(high).any() || list.iter().any(|tree| self.is_empty_tree(tree))
            }
            CsgTree::Difference(list) => list.first().is_some_and(|tree| self.is_empty_tree(tree)),
        }
    }

    /// Returns the bounding box of the points of `tree`; `None` if it is infinite.
    fn bounds_of(&self, tree: &CsgTree) -> Option<Bounds> {
        match tree {
            CsgTree::Part(i) => self.parts[*i].bounds(),
            CsgTree::Union(list) => {
                let boxes: Option<Vec<_>> = list.iter().map(|t| self.bounds_of(t)).collect();
                boxes?.into_iter().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
            }
            CsgTree::Intersection(list) => {
                let boxes = list.iter().filter_map(|t| self.bounds_of(t));
                let (low, high) = boxes.reduce(|a, b| (a.0.max(b.0), a.1.min(b.1)))?;
                // The result has no extent along an axis on which the boxes are disjoint.
                Some((low, high.max(low)))
            }
            CsgTree::Difference(list) => self.bounds_of(list.first()?),
        }
    }
}
