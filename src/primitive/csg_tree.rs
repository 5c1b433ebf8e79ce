//! Compound solids as what they are computed from: parts and how they are combined.

use crate::primitive::Form;
use glam::{DAffine3, DVec3};

/// How parts are combined.
#[derive(Clone, Debug, PartialEq)]
pub enum CsgTree {
    /// A part, by its position in [`CsgSolid::parts`].
    Part(usize),
    /// The points that are in any of these.
    Union(Vec<CsgTree>),
    /// The points that are in all of these.
    Intersection(Vec<CsgTree>),
    /// The points of the first that are in none of the others.
    Difference(Vec<CsgTree>),
}

impl CsgTree {
    /// The same tree over parts that stand `by` places later.
    pub(crate) fn shifted(self, by: usize) -> Self {
        let all = |list: Vec<Self>| list.into_iter().map(|t| t.shifted(by)).collect();
        match self {
            Self::Part(i) => Self::Part(i + by),
            Self::Union(list) => Self::Union(all(list)),
            Self::Intersection(list) => Self::Intersection(all(list)),
            Self::Difference(list) => Self::Difference(all(list)),
        }
    }
}

/// A solid made of solids.
#[derive(Clone, Debug, PartialEq)]
pub struct CsgSolid {
    /// Convex solids: `Sphere`, `Ellipsoid`, `Convex`, `Tapered`, and `Plane` for the half-space
    /// behind it.
    pub parts: Vec<Form>,
    /// Every part occurs once, in order.
    pub tree: CsgTree,
}

impl CsgSolid {
    /// After the invertible affine map `map`.
    pub(crate) fn transformed(self, map: &DAffine3) -> Self {
        let parts = self.parts.into_iter().map(|p| p.transformed(map)).collect();
        Self { parts, tree: self.tree }
    }

    /// Corners of an axis-parallel box around it; `None` if it has no end as far as the boxes of its
    /// parts tell.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.bounds_of(&self.tree)
    }

    fn bounds_of(&self, tree: &CsgTree) -> Option<(DVec3, DVec3)> {
        match tree {
            CsgTree::Part(i) => self.parts[*i].bounds(),
            CsgTree::Union(list) => {
                let boxes: Option<Vec<_>> = list.iter().map(|t| self.bounds_of(t)).collect();
                boxes?.into_iter().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
            }
            CsgTree::Intersection(list) => {
                let boxes = list.iter().filter_map(|t| self.bounds_of(t));
                let (low, high) = boxes.reduce(|a, b| (a.0.max(b.0), a.1.min(b.1)))?;
                // Boxes that do not overlap leave nothing: a box without extent.
                Some((low, high.max(low)))
            }
            CsgTree::Difference(list) => self.bounds_of(list.first()?),
        }
    }
}
