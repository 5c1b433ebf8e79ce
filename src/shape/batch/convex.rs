//! Bounded convex solids as intersections of slabs (parallel pairs of faces) and half-spaces.

use super::span::{Span, Spans};
use super::sphere::wanted_done;
use super::{Batch, Hit, Ray, Surface, reach};
use crate::lanes::{Lanes, Mask, Real, V3};
use crate::shape::form::{Form, HalfSpace};
use glam::DVec3;
use std::ops::Range;

/// The points p with low <= normal . (p - center) <= high. A single face has no low side.
#[derive(Clone, Copy)]
struct Slab<S> {
    normal: [S; 3],
    low: S,
    high: S,
}

/// One solid: its bounding sphere and the ranges of its slabs and single faces.
#[derive(Clone, Copy)]
struct Solid<S> {
    center: [S; 3],
    radius2: S,
    reach: S,
    slabs: (u32, u32),
    faces: (u32, u32),
}

/// All convex solids of a scene.
pub struct Convexes<L: Lanes> {
    solids: Vec<Solid<L::Scalar>>,
    slabs: Vec<Slab<L::Scalar>>,
    faces: Vec<Slab<L::Scalar>>,
}

impl<L: Lanes> Convexes<L> {
    /// From forms that are all convex solids.
    pub fn new(forms: &[Form]) -> Self {
        let mut out = Self { solids: Vec::new(), slabs: Vec::new(), faces: Vec::new() };
        for form in forms {
            let Form::Convex { faces, corners } = form else { continue };
            out.add(faces, corners, reach(form));
        }
        out
    }

    fn add(&mut self, faces: &[HalfSpace], corners: &[DVec3], reach: f64) {
        let of = L::Scalar::of;
        let low = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let center = 0.5 * (low + high);
        let radius2 = corners.iter().map(|c| c.distance_squared(center)).fold(0.0, f64::max);
        let (first_slab, first_face) = (self.slabs.len() as u32, self.faces.len() as u32);
        let mut paired = vec![false; faces.len()];
        for (i, face) in faces.iter().enumerate() {
            if paired[i] {
                continue;
            }
            let opposite = (i + 1..faces.len())
                .find(|j| !paired[*j] && (faces[*j].normal + face.normal).length() < 1e-14);
            let high = face.offset - face.normal.dot(center);
            let normal = face.normal.to_array().map(of);
            match opposite {
                Some(j) => {
                    paired[j] = true;
                    let low = -(faces[j].offset - faces[j].normal.dot(center));
                    self.slabs.push(Slab { normal, low: of(low), high: of(high) });
                }
                None => self.faces.push(Slab { normal, low: of(-L::MAX), high: of(high) }),
            }
        }
        self.solids.push(Solid {
            center: center.to_array().map(of),
            // Rounded up: the test may let a miss through, never lose a hit.
            radius2: of(radius2 * (1.0 + 8.0 * L::EPSILON)),
            reach: of(reach),
            slabs: (first_slab, self.slabs.len() as u32),
            faces: (first_face, self.faces.len() as u32),
        });
    }

    fn slabs_of(&self, solid: &Solid<L::Scalar>) -> &[Slab<L::Scalar>] {
        &self.slabs[solid.slabs.0 as usize..solid.slabs.1 as usize]
    }

    fn faces_of(&self, solid: &Solid<L::Scalar>) -> &[Slab<L::Scalar>] {
        &self.faces[solid.faces.0 as usize..solid.faces.1 as usize]
    }

    /// Distances at which the line enters and leaves a solid, and where it meets it.
    #[inline(always)]
    fn chord(&self, solid: &Solid<L::Scalar>, ray: &Ray<L>) -> Option<(L, L, L::Mask)> {
        let from_center = ray.origin - V3::splat(solid.center);
        let along = from_center.dot(ray.direction);
        let across = ray.direction.mul_add(-along, from_center);
        let near = across.length2().le(L::splat(solid.radius2));
        if near.none() {
            return None;
        }
        let mut enter = L::of(-L::MAX);
        let mut leave = L::of(L::MAX);
        // A direction parallel to a face becomes one that is so nearly, on the side of its zero's
        // sign: 0 / 0 cannot occur, a line inside the face is not cut by it, one beyond it has an
        // empty chord, and one in the face's plane touches the solid or not by that sign.
        let tiny = L::of(1e-30);
        let steep = |speed: L| speed.abs().max(tiny).copysign(speed);
        for slab in self.slabs_of(solid) {
            let normal = V3::splat(slab.normal);
            let inverse = L::one() / steep(ray.direction.dot(normal));
            let height = from_center.dot(normal);
            let t0 = (L::splat(slab.low) - height) * inverse;
            let t1 = (L::splat(slab.high) - height) * inverse;
            enter = t0.min(t1).max(enter);
            leave = t0.max(t1).min(leave);
        }
        for face in self.faces_of(solid) {
            let normal = V3::splat(face.normal);
            let speed = steep(ray.direction.dot(normal));
            let t = (L::splat(face.high) - from_center.dot(normal)) / speed;
            let entering = speed.lt(L::zero());
            enter = L::select(entering, t.max(enter), enter);
            leave = L::select(entering, leave, t.min(leave));
        }
        // Each lane by itself: company in the packet must not decide about a line past a corner.
        Some((enter, leave, near & enter.le(leave)))
    }
}

impl<L: Lanes> Batch<L> for Convexes<L> {
    fn closest(&self, range: Range<usize>, base: u32, ray: &Ray<L>, hit: &mut Hit<L>) {
        for (item, solid) in range.clone().zip(&self.solids[range]) {
            if let Some((enter, leave, meets)) = self.chord(solid, ray) {
                let t = L::select(enter.gt(L::zero()), enter, leave);
                hit.narrow(meets, t, base + item as u32);
            }
        }
    }

    fn blocked(&self, range: Range<usize>, ray: &Ray<L>, limit: L, wanted: L::Mask) -> L::Mask {
        let mut blocked = L::mask(false);
        for solid in &self.solids[range] {
            if let Some((enter, leave, meets)) = self.chord(solid, ray) {
                let t = L::select(enter.gt(L::zero()), enter, leave);
                blocked = blocked | (meets & t.gt(L::zero()) & t.lt(limit));
                if wanted_done::<L>(wanted, blocked) {
                    break;
                }
            }
        }
        blocked
    }

    /// The face is the one whose plane is nearest to the point: outside by most, or inside by least.
    fn surface(&self, item: usize, point: V3<L>) -> Surface<L> {
        let solid = &self.solids[item];
        let from_center = point - V3::splat(solid.center);
        let mut outside = L::of(-L::MAX);
        let mut normal = V3::zero();
        for slab in self.slabs_of(solid) {
            let n = V3::splat(slab.normal);
            let height = from_center.dot(n);
            let above = height - L::splat(slab.high);
            let below = L::splat(slab.low) - height;
            let upper = above.gt(below);
            let distance = L::select(upper, above, below);
            let nearer = distance.gt(outside);
            outside = L::select(nearer, distance, outside);
            normal = V3::select(nearer, V3::select(upper, n, -n), normal);
        }
        for face in self.faces_of(solid) {
            let n = V3::splat(face.normal);
            let distance = from_center.dot(n) - L::splat(face.high);
            let nearer = distance.gt(outside);
            outside = L::select(nearer, distance, outside);
            normal = V3::select(nearer, n, normal);
        }
        Surface { point: normal.mul_add(-outside, point), normal, reach: L::splat(solid.reach) }
    }
}

impl<L: Lanes> Spans<L> for Convexes<L> {
    fn span(&self, item: usize, ray: &Ray<L>) -> Option<Span<L>> {
        let solid = &self.solids[item];
        let (enter, leave, meets) = self.chord(solid, ray)?;
        let from_center = ray.origin - V3::splat(solid.center);
        // The face at an end is the one that is nearest there, of those that the line crosses in
        // the right sense.
        let mut best = (L::of(-L::MAX), L::of(-L::MAX));
        let mut cosines = (L::one(), L::one());
        let mut face = |normal: V3<L>, offset: L| {
            let speed = normal.dot(ray.direction);
            let height = from_center.dot(normal) - offset;
            let above = |t: L| speed.mul_add(t, height);
            let nearer = speed.lt(L::zero()) & above(enter).gt(best.0);
            best.0 = L::select(nearer, above(enter), best.0);
            cosines.0 = L::select(nearer, -speed, cosines.0);
            let nearer = speed.gt(L::zero()) & above(leave).gt(best.1);
            best.1 = L::select(nearer, above(leave), best.1);
            cosines.1 = L::select(nearer, speed, cosines.1);
        };
        for slab in self.slabs_of(solid) {
            let normal = V3::splat(slab.normal);
            face(normal, L::splat(slab.high));
            face(-normal, -L::splat(slab.low));
        }
        for half_space in self.faces_of(solid) {
            face(V3::splat(half_space.normal), L::splat(half_space.high));
        }
        let (enter_cosine, leave_cosine) = cosines;
        Some(Span { enter, leave, enter_cosine, leave_cosine, meets })
    }
}
