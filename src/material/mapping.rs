//! From points on a surface to the coordinates of a texture, in lanes, and how these grow from place to
//! place.
//!
//! A projection is a function of space, so that one formula serves every shape. Its gradient along the
//! surface is what Blinn's partial derivatives of the surface come to (Blinn 1978, *Simulation of
//! Wrinkled Surfaces*; Mikkelsen 2010, *Bump Mapping Unparametrized Surfaces on the GPU*).

use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::material::texture::{Axis, Mapping, Placement};
use glam::{DAffine3, DMat3, DVec3};
use std::f64::consts::{FRAC_1_PI, TAU};

/// A formula for the coordinates of a texture, in the texture's space: x to the right, y up, z to the
/// front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Projection {
    /// (x, y).
    Planar,
    /// The angle around y in turns, 1/2 at the front; the angle from the lower pole in half turns.
    Spherical,
    /// The angle around y in turns, 1/2 at the front; the height in heights of the shape.
    Cylindrical,
    /// Each side as it is seen from outside.
    Box,
    /// What the shape itself says.
    Uv,
}

/// How far from the ends of a cylindrical projection its coordinate stays, in heights: ends show the
/// colours of their rims, whatever rounding does.
const RIM: f64 = 1.0 / 16_384.0;

/// Sides between two axes belong to the later one: rounding does not decide.
const TIE: f64 = 1.001;

/// Coordinates of a texture in repeats, and their gradients in the texture's space.
#[derive(Clone, Copy, Debug)]
pub struct TexCoord<L> {
    /// To the right.
    pub u: L,
    /// Up.
    pub v: L,
    /// Gradient of u.
    pub grad_u: Vec3<L>,
    /// Gradient of v.
    pub grad_v: Vec3<L>,
}

/// A projection onto one thing of the scene.
#[derive(Clone, Copy, Debug)]
pub struct TextureMapping<S> {
    projection: Projection,
    /// Columns of the linear map.
    texture_from_scene: [[S; 3]; 3],
    /// Columns of its inverse.
    scene_from_texture: [[S; 3]; 3],
    /// The middle of the thing in the scene, and in the texture's space relative to where the
    /// projection begins: so the error of a point is that of the thing's size.
    middle: [S; 3],
    inner_middle: [S; 3],
    /// Lengths of the box around the thing in the texture's space.
    extent: [S; 3],
    scale: [S; 2],
    offset: [S; 2],
}

/// The axes of the space in which a mapping along or around `axis` is one along z or around y.
fn turned(projection: Projection, axis: Option<Axis>) -> DMat3 {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let rows = match (projection, axis) {
        (Projection::Planar, Some(Axis::X)) => [-z, y, x],
        (Projection::Planar, Some(Axis::Y)) => [x, -z, y],
        (Projection::Spherical | Projection::Cylindrical, Some(Axis::X)) => [z, x, y],
        (Projection::Spherical | Projection::Cylindrical, Some(Axis::Z)) => [y, z, x],
        _ => [x, y, z],
    };
    DMat3::from_cols(rows[0], rows[1], rows[2]).transpose()
}

impl<S: Float> TextureMapping<S> {
    /// By `placement`, whose mapping comes to `projection` here, onto a thing that `low` and `high` are
    /// corners of the box around, in the texture's space.
    pub fn new(
        placement: &Placement,
        projection: Projection,
        scene_from_texture: &DAffine3,
        [low, high]: [DVec3; 2],
    ) -> Self {
        let turn = turned(projection, placement.axis);
        let ends = [turn * low, turn * high];
        let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        let scene_from_texture = *scene_from_texture * DAffine3::from_mat3(turn.transpose());
        let middle = 0.5 * (low + high);
        let begin = match projection {
            Projection::Planar | Projection::Box | Projection::Uv => low,
            Projection::Spherical => middle,
            Projection::Cylindrical => DVec3::new(middle.x, low.y, middle.z),
        };
        let outer = scene_from_texture.matrix3;
        let inner = outer.inverse();
        let columns =
            |m: DMat3| [m.x_axis, m.y_axis, m.z_axis].map(|c| c.to_array().map(S::from_f64));
        let mut scale = placement.scale;
        let extent = high - low;
        if projection == Projection::Planar && placement.mapping == Mapping::Uv {
            // Once from edge to edge of what is flat.
            scale = [scale[0] / extent.x, scale[1] / extent.y];
        }
        Self {
            projection,
            texture_from_scene: columns(inner),
            scene_from_texture: columns(outer),
            middle: scene_from_texture.transform_point3(middle).to_array().map(S::from_f64),
            inner_middle: (middle - begin).to_array().map(S::from_f64),
            extent: extent.to_array().map(S::from_f64),
            scale: scale.map(S::from_f64),
            offset: placement.offset.map(S::from_f64),
        }
    }

    /// Whether the shape's own coordinates are asked for.
    pub fn wants_uv(&self) -> bool {
        self.projection == Projection::Uv
    }

    /// A normal in one space from one in the other, of any length: by the columns of the map back.
    #[inline(always)]
    fn normal<L: SimdFloat<Scalar = S>>(columns: &[[S; 3]; 3], n: Vec3<L>) -> Vec3<L> {
        let [x, y, z] = columns.map(Vec3::splat);
        Vec3::new(x.dot(n), y.dot(n), z.dot(n))
    }

    /// The coordinates at `point` of the scene, where the thing's outer normal is `normal`. With
    /// [`TextureMapping::wants_uv`] these are zero.
    pub fn coordinates<L: SimdFloat<Scalar = S>>(
        &self,
        point: Vec3<L>,
        normal: Vec3<L>,
    ) -> TexCoord<L> {
        let [x, y, z] = self.texture_from_scene.map(Vec3::splat);
        let from_middle = point - Vec3::splat(self.middle);
        let p = x * from_middle.x + y * from_middle.y + z * from_middle.z;
        let p = p + Vec3::splat(self.inner_middle);
        let found = match self.projection {
            Projection::Planar => planar(p),
            Projection::Spherical => spherical(p),
            Projection::Cylindrical => cylindrical(p, L::splat(self.extent[1])),
            Projection::Box => {
                let normal = Self::normal(&self.scene_from_texture, normal);
                sides(p, normal, Vec3::splat(self.extent))
            }
            Projection::Uv => {
                TexCoord { u: L::zero(), v: L::zero(), grad_u: Vec3::zero(), grad_v: Vec3::zero() }
            }
        };
        self.placed(found)
    }

    /// Coordinates of the shape itself, scaled and moved.
    pub fn placed<L: SimdFloat<Scalar = S>>(&self, found: TexCoord<L>) -> TexCoord<L> {
        let ([su, sv], [ou, ov]) = (self.scale.map(L::splat), self.offset.map(L::splat));
        TexCoord {
            u: found.u.mul_add(su, ou),
            v: found.v.mul_add(sv, ov),
            grad_u: found.grad_u * su,
            grad_v: found.grad_v * sv,
        }
    }

    /// The unit normal of the surface that rises above the one with the unit normal `normal` by a
    /// height whose gradient in the texture's space is `gradient`. `outward`: 1 where `normal` points
    /// the way that heights rise, -1 where it points back.
    ///
    /// Heights rise along the normal in the texture's space, so that an object that is transformed
    /// takes its bumps along.
    pub fn bumped<L: SimdFloat<Scalar = S>>(
        &self,
        normal: Vec3<L>,
        outward: L,
        gradient: Vec3<L>,
    ) -> Vec3<L> {
        let inner = Self::normal(&self.scene_from_texture, normal).normalize();
        let along = inner.mul_add(-inner.dot(gradient), gradient);
        let bumped = along.mul_add(-outward, inner);
        Self::normal(&self.texture_from_scene, bumped).normalize()
    }
}

#[inline(always)]
fn unit<L: SimdFloat>(axis: usize, length: L) -> Vec3<L> {
    let zero = L::zero();
    match axis {
        0 => Vec3::new(length, zero, zero),
        1 => Vec3::new(zero, length, zero),
        _ => Vec3::new(zero, zero, length),
    }
}

fn planar<L: SimdFloat>(p: Vec3<L>) -> TexCoord<L> {
    TexCoord { u: p.x, v: p.y, grad_u: unit(0, L::one()), grad_v: unit(1, L::one()) }
}

/// The angle around y in turns, its gradient, and the square of the distance from y.
#[inline(always)]
fn around<L: SimdFloat>(p: Vec3<L>) -> (L, Vec3<L>, L) {
    let across2 = p.x.mul_add(p.x, p.z * p.z);
    // On the axis there is no angle, and no gradient that were finite.
    let across2 = across2.max(p.length_squared() * L::from_f64(1e-12)).max(L::from_f64(1e-30));
    let turns = p.x.atan2(p.z).mul_add(L::from_f64(1.0 / TAU), L::from_f64(0.5));
    let per = L::from_f64(1.0 / TAU) / across2;
    (turns, Vec3::new(p.z * per, L::zero(), -(p.x * per)), across2)
}

fn spherical<L: SimdFloat>(p: Vec3<L>) -> TexCoord<L> {
    let (u, du, across2) = around(p);
    let across = across2.sqrt();
    let v = p.y.atan2(across).mul_add(L::from_f64(FRAC_1_PI), L::from_f64(0.5));
    let per = L::from_f64(FRAC_1_PI) / across2.mul_add(L::one(), p.y * p.y);
    let inward = -(p.y * per) / across;
    TexCoord { u, v, grad_u: du, grad_v: Vec3::new(p.x * inward, across * per, p.z * inward) }
}

fn cylindrical<L: SimdFloat>(p: Vec3<L>, height: L) -> TexCoord<L> {
    let (u, du, _) = around(p);
    let flat = height.le(L::zero());
    let per = (L::one() / L::select(flat, L::one(), height)).masked(!flat);
    let (free, low, high) = (p.y * per, L::from_f64(RIM), L::from_f64(1.0 - RIM));
    let inside = free.ge(low) & free.le(high);
    TexCoord { u, v: free.max(low).min(high), grad_u: du, grad_v: unit(1, per.masked(inside)) }
}

/// Sides of a box from its lower corner on: which one, the normal says.
fn sides<L: SimdFloat>(p: Vec3<L>, normal: Vec3<L>, extent: Vec3<L>) -> TexCoord<L> {
    let zero = L::zero();
    let [ax, ay, az] = [normal.x, normal.y, normal.z].map(L::abs);
    let on_z = (az * L::from_f64(TIE)).ge(ax.max(ay));
    let on_y = (ay * L::from_f64(TIE)).ge(ax).and_not(on_z);
    let pick = |x, y, z| L::select(on_z, z, L::select(on_y, y, x));
    let sign = L::one().copysign(pick(normal.x, normal.y, normal.z));
    let front = sign.gt(zero);
    let from = |front, high: L, at: L| L::select(front, at, high - at);
    TexCoord {
        u: pick(from(!front, extent.z, p.z), p.x, from(front, extent.x, p.x)),
        v: pick(p.y, from(!front, extent.z, p.z), p.y),
        grad_u: Vec3::new(pick(zero, L::one(), sign), zero, pick(-sign, zero, zero)),
        grad_v: Vec3::new(zero, pick(L::one(), zero, L::one()), pick(zero, -sign, zero)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placement(mapping: Mapping, axis: Option<Axis>) -> Placement {
        Placement { mapping, axis, scale: [2.0, 3.0], offset: [0.25, -0.5] }
    }

    fn projector(projection: Projection, axis: Option<Axis>) -> TextureMapping<f64> {
        let there = DAffine3::from_translation(DVec3::new(5.0, -3.0, 2.0))
            * DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7)
            * DAffine3::from_scale(DVec3::new(2.0, 0.5, 1.5));
        let corners = [DVec3::new(-1.0, -2.0, -3.0), DVec3::new(2.0, 1.0, 0.5)];
        TextureMapping::new(&placement(Mapping::Auto, axis), projection, &there, corners)
    }

    fn at(p: &TextureMapping<f64>, point: DVec3, normal: DVec3) -> TexCoord<f64> {
        p.coordinates(Vec3::of(point.to_array()), Vec3::of(normal.to_array()))
    }

    /// Gradients in the texture's space, carried into the scene, against differences.
    #[test]
    fn gradients_are_those_of_the_coordinates() {
        let normal = DVec3::new(0.3, 0.8, -0.2).normalize();
        for projection in
            [Projection::Planar, Projection::Spherical, Projection::Cylindrical, Projection::Box]
        {
            for axis in [None, Some(Axis::X), Some(Axis::Y), Some(Axis::Z)] {
                let p = projector(projection, axis);
                let point = DVec3::new(5.9, -3.1, 1.2);
                let here = at(&p, point, normal);
                for (axis, way) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
                    let h = 1e-6;
                    let (a, b) = (at(&p, point - way * h, normal), at(&p, point + way * h, normal));
                    let column = Vec3::<f64>::splat(p.texture_from_scene[axis]);
                    for (a, b, gradient) in [(a.u, b.u, here.grad_u), (a.v, b.v, here.grad_v)] {
                        let slope = (b - a) / (2.0 * h);
                        let told = gradient.dot(column);
                        assert!(
                            (slope - told).abs() < 1e-6,
                            "{projection:?} {axis}: {slope} {told}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn nothing_is_infinite_on_axes_and_in_the_middle() {
        for projection in [Projection::Spherical, Projection::Cylindrical] {
            let p = TextureMapping::<f32>::new(
                &placement(Mapping::Auto, None),
                projection,
                &DAffine3::IDENTITY,
                [DVec3::NEG_ONE, DVec3::ONE],
            );
            for point in [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]] {
                let c = p.coordinates(Vec3::<f32>::of(point), Vec3::of([0.0, 1.0, 0.0]));
                let numbers = [c.u, c.v, c.grad_u.max_abs(), c.grad_v.max_abs()];
                assert!(numbers.iter().all(|x| x.is_finite()), "{projection:?} {point:?} {c:?}");
            }
        }
    }

    #[test]
    fn a_ramp_tilts_the_normal_by_the_angle_of_its_slope() {
        let p = TextureMapping::<f64>::new(
            &placement(Mapping::Auto, None),
            Projection::Planar,
            &DAffine3::from_scale(DVec3::splat(7.0)),
            [DVec3::ZERO, DVec3::ONE],
        );
        let slope = Vec3::<f64>::of([0.4, 0.0, 9.0]);
        let up = p.bumped(Vec3::of([0.0, 0.0, 1.0]), 1.0, slope);
        assert!((up.x / up.z + 0.4).abs() < 1e-14 && up.y == 0.0 && up.z > 0.0);
        let back = p.bumped(Vec3::of([0.0, 0.0, -1.0]), -1.0, slope);
        assert!((back.x / back.z + 0.4).abs() < 1e-14 && back.z < 0.0, "the same surface");
    }
}
