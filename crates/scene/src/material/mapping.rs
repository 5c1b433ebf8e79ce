//! Texture coordinates of surface points and their gradients, in SIMD lanes.
//!
//! A projection is a formula in texture space, not a parametrisation of a surface; one formula
//! therefore serves every shape. Its gradient along the surface is equivalent to Blinn's partial
//! derivatives of the surface (Blinn 1978, *Simulation of Wrinkled Surfaces*; Mikkelsen 2010, *Bump
//! Mapping Unparametrized Surfaces on the GPU*).

use crate::material::texture::{Axis, Mapping, Placement};
use glam::{DAffine3, DMat3, DVec3};
use std::f64::consts::{FRAC_1_PI, TAU};
use zerkalo_kernel::lanes::{Float, Mask, SimdFloat, Vec3};
use zerkalo_kernel::primitive::{Projection, TexCoord};

/// Distance that v keeps from 0 and 1 in a cylindrical projection, so that rounding errors at a flat
/// end of the shape do not move v past the edge of the image.
const RIM: f64 = 1.0 / 16_384.0;

/// Factor that favours the later of the axes x, y and z at equal angles to the normal, when a box
/// projection chooses a side of the box.
const TIE: f64 = 1.001;

/// Upper bound of the error of a surface point, and of a texture coordinate computed from it. The
/// unit is the rounding error of the largest number in the computation.
const POINT_ROUNDINGS: f64 = 16.0;

/// Largest angle between the normal of a surface and the gradient of a texture coordinate at which
/// the coordinate counts as constant along the surface. The unit is the machine epsilon.
const ANGLE_ROUNDINGS: f64 = 64.0;

/// Placement of a texture on one part of an object, compiled for the kernels.
#[derive(Clone, Copy, Debug)]
pub struct TextureMapping<S> {
    projection: Projection,
    /// Columns of the linear map from scene space to texture space.
    texture_from_scene: [[S; 3]; 3],
    /// Columns of the linear map from texture space to scene space.
    scene_from_texture: [[S; 3]; 3],
    /// Centre, in the scene, of the part of the object that has this texture. Points are mapped
    /// relative to it, so that rounding errors are in proportion to the size of the part.
    center: [S; 3],
    /// Position of `center` in texture space, relative to the point from which the projection
    /// measures its coordinates.
    texture_center: [S; 3],
    /// Edge lengths of the part's bounding box in texture space.
    extent: [S; 3],
    scale: [S; 2],
    offset: [S; 2],
    /// Rounding error of the coordinates in the scene file, in scene units.
    input_error: S,
}

/// Returns the rotation from texture space to the coordinates of the projection's formula, which
/// projects along z or around y. The rotation turns `axis`, if given, to this z or y axis.
fn axes_for(projection: Projection, axis: Option<Axis>) -> DMat3 {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let rows = match (projection, axis) {
        (Projection::Planar, Some(Axis::X)) => [-z, y, x],
        (Projection::Planar, Some(Axis::Y)) => [x, -z, y],
        (Projection::Spherical | Projection::Cylindrical, Some(Axis::X)) => [z, x, y],
        (Projection::Spherical | Projection::Cylindrical, Some(Axis::Z)) => [y, z, x],
        (Projection::Planar, None | Some(Axis::Z))
        | (Projection::Spherical | Projection::Cylindrical, None | Some(Axis::Y))
        | (Projection::Box | Projection::Uv, _) => [x, y, z],
    };
    DMat3::from_cols(rows[0], rows[1], rows[2]).transpose()
}

impl<S: Float> TextureMapping<S> {
    /// Compiles the placement of a texture, with the `projection` that it selects for a part of an
    /// object. `low` and `high` are corners of the part's bounding box in texture space, and
    /// `input_error` is the rounding error of coordinates in the scene file.
    pub fn new(
        placement: &Placement,
        projection: Projection,
        scene_from_texture: &DAffine3,
        [low, high]: [DVec3; 2],
        input_error: f64,
    ) -> Self {
        let rotation = axes_for(projection, placement.axis);
        let ends = [rotation * low, rotation * high];
        let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        let scene_from_texture = *scene_from_texture * DAffine3::from_mat3(rotation.transpose());
        let center = 0.5 * (low + high);
        let origin = match projection {
            Projection::Planar | Projection::Box | Projection::Uv => low,
            Projection::Spherical => center,
            Projection::Cylindrical => DVec3::new(center.x, low.y, center.z),
        };
        let outer = scene_from_texture.matrix3;
        let inner = outer.inverse();
        let columns =
            |m: DMat3| [m.x_axis, m.y_axis, m.z_axis].map(|c| c.to_array().map(S::from_f64));
        let mut scale = placement.scale;
        let extent = high - low;
        if projection == Projection::Planar && placement.mapping == Mapping::Uv {
            // With the mapping `uv`, one repetition of the image spans a flat shape from edge to
            // edge.
            scale = [scale[0] / extent.x, scale[1] / extent.y];
        }
        Self {
            projection,
            texture_from_scene: columns(inner),
            scene_from_texture: columns(outer),
            center: scene_from_texture.transform_point3(center).to_array().map(S::from_f64),
            texture_center: (center - origin).to_array().map(S::from_f64),
            extent: extent.to_array().map(S::from_f64),
            scale: scale.map(S::from_f64),
            offset: placement.offset.map(S::from_f64),
            input_error: S::from_f64(input_error),
        }
    }

    /// Returns `true` if the texture uses the shape's own texture coordinates.
    pub fn wants_uv(&self) -> bool {
        self.projection == Projection::Uv
    }

    /// Maps a normal of any length by the transpose of the matrix with the given `columns`, which
    /// maps points in the opposite direction.
    #[inline(always)]
    fn normal<L: SimdFloat<Scalar = S>>(columns: &[[S; 3]; 3], n: Vec3<L>) -> Vec3<L> {
        let [x, y, z] = columns.map(Vec3::splat);
        Vec3::new(x.dot(n), y.dot(n), z.dot(n))
    }

    /// Returns the texture coordinates at `point` with the outer normal `normal`. If
    /// [`TextureMapping::wants_uv`] is `true`, the caller must pass the shape's own coordinates to
    /// [`TextureMapping::placed`] instead.
    pub fn coordinates<L: SimdFloat<Scalar = S>>(
        &self,
        point: Vec3<L>,
        normal: Vec3<L>,
    ) -> TexCoord<L> {
        let [x, y, z] = self.texture_from_scene.map(Vec3::splat);
        let from_center = point - Vec3::splat(self.center);
        let p = x * from_center.x + y * from_center.y + z * from_center.z;
        let p = p + Vec3::splat(self.texture_center);
        let coordinates = match self.projection {
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
        self.placed(coordinates)
    }

    /// Applies the scale and the offset of the placement.
    pub fn placed<L: SimdFloat<Scalar = S>>(&self, unplaced: TexCoord<L>) -> TexCoord<L> {
        let ([su, sv], [ou, ov]) = (self.scale.map(L::splat), self.offset.map(L::splat));
        TexCoord {
            u: unplaced.u.mul_add(su, ou),
            v: unplaced.v.mul_add(sv, ov),
            grad_u: unplaced.grad_u * su,
            grad_v: unplaced.grad_v * sv,
        }
    }

    /// Returns the texture coordinates u and v, moved off edges at which the colour of the texture
    /// jumps. `coordinates` belong to a point with the outer normal `normal`; `rounding` is the
    /// rounding error of the point's largest coordinate.
    ///
    /// A flat face may lie exactly on an edge of the texture, such as the lid of a box whose height
    /// is a whole number of squares. One coordinate is constant there, and rounding would decide
    /// between two colours. A constant coordinate is therefore increased by its largest rounding
    /// error.
    pub fn beside_edges<L: SimdFloat<Scalar = S>>(
        &self,
        coordinates: &TexCoord<L>,
        normal: Vec3<L>,
        rounding: L,
    ) -> (L, L) {
        let point_error = rounding.max(L::splat(self.input_error)) * L::from_f64(POINT_ROUNDINGS);
        let periodic = matches!(self.projection, Projection::Spherical | Projection::Cylindrical);
        let beside = |value: L, gradient: Vec3<L>, scale: S, offset: S, periodic: bool| {
            let (scale, offset) = (L::splat(scale), L::splat(offset));
            let gradient = Self::normal(&self.texture_from_scene, gradient);
            let steepness = gradient.length_squared().sqrt();
            let across = normal.mul_add(-normal.dot(gradient), gradient);
            let moved = steepness * point_error;
            let angle = L::from_f64(ANGLE_ROUNDINGS * L::EPSILON) + moved / scale;
            let constant = across.length_squared().sqrt().le(steepness * angle);
            let largest = value.abs() + offset.abs() + scale;
            let error = largest.mul_add(L::from_f64(POINT_ROUNDINGS * L::EPSILON), moved);
            // The start and the end of the range of u are the same place, one turn apart.
            let at_end = if periodic {
                constant & (value - offset - scale).abs().le(error)
            } else {
                L::mask(false)
            };
            L::select(constant, L::select(at_end, offset, value) + error, value)
        };
        let TexCoord { u, v, grad_u, grad_v } = *coordinates;
        let ([su, sv], [ou, ov]) = (self.scale, self.offset);
        (beside(u, grad_u, su, ou, periodic), beside(v, grad_v, sv, ov, false))
    }

    /// Returns the unit normal perturbed by a bump map. `gradient` is the gradient of its height in
    /// texture space, so that bumps move and scale with their object. Heights rise along the outer
    /// normal: `outward` is 1 if `normal` is the outer normal, and -1 if it is the inner one.
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

/// Returns a vector of the given length along coordinate axis 0 (x), 1 (y) or 2 (z).
#[inline(always)]
fn along_axis<L: SimdFloat>(axis: usize, length: L) -> Vec3<L> {
    let zero = L::zero();
    match axis {
        0 => Vec3::new(length, zero, zero),
        1 => Vec3::new(zero, length, zero),
        _ => Vec3::new(zero, zero, length),
    }
}

fn planar<L: SimdFloat>(p: Vec3<L>) -> TexCoord<L> {
    TexCoord { u: p.x, v: p.y, grad_u: along_axis(0, L::one()), grad_v: along_axis(1, L::one()) }
}

/// Returns the angle of `p` around the y axis in turns, its gradient, and the squared distance from
/// the axis.
#[inline(always)]
fn around<L: SimdFloat>(p: Vec3<L>) -> (L, Vec3<L>, L) {
    let across2 = p.x.mul_add(p.x, p.z * p.z);
    // Angle and gradient are undefined on the axis.
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

/// Returns the cylindrical projection around y, with v from 0 to 1 over `height`.
fn cylindrical<L: SimdFloat>(p: Vec3<L>, height: L) -> TexCoord<L> {
    let (u, du, _) = around(p);
    let flat = height.le(L::zero());
    let per = (L::one() / L::select(flat, L::one(), height)).masked(!flat);
    let (free, low, high) = (p.y * per, L::from_f64(RIM), L::from_f64(1.0 - RIM));
    let inside = free.ge(low) & free.le(high);
    TexCoord {
        u,
        v: free.max(low).min(high),
        grad_u: du,
        grad_v: along_axis(1, per.masked(inside)),
    }
}

/// Returns the planar projection onto that side of a box whose outer normal is nearest to `normal`,
/// measured from the lower left corner of this side as seen from outside.
fn sides<L: SimdFloat>(p: Vec3<L>, normal: Vec3<L>, extent: Vec3<L>) -> TexCoord<L> {
    let zero = L::zero();
    let [ax, ay, az] = [normal.x, normal.y, normal.z].map(L::abs);
    let on_z = (az * L::from_f64(TIE)).ge(ax.max(ay));
    let on_y = (ay * L::from_f64(TIE)).ge(ax).and_not(on_z);
    let pick = |x, y, z| L::select(on_z, z, L::select(on_y, y, x));
    let sign = L::one().copysign(pick(normal.x, normal.y, normal.z));
    let front = sign.gt(zero);
    let from_edge = |front, high: L, x: L| L::select(front, x, high - x);
    TexCoord {
        u: pick(from_edge(!front, extent.z, p.z), p.x, from_edge(front, extent.x, p.x)),
        v: pick(p.y, from_edge(!front, extent.z, p.z), p.y),
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
        let scene_from_texture = DAffine3::from_translation(DVec3::new(5.0, -3.0, 2.0))
            * DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7)
            * DAffine3::from_scale(DVec3::new(2.0, 0.5, 1.5));
        let corners = [DVec3::new(-1.0, -2.0, -3.0), DVec3::new(2.0, 1.0, 0.5)];
        TextureMapping::new(
            &placement(Mapping::Auto, axis),
            projection,
            &scene_from_texture,
            corners,
            0.0,
        )
    }

    fn coordinates_at(p: &TextureMapping<f64>, point: DVec3, normal: DVec3) -> TexCoord<f64> {
        p.coordinates(Vec3::of(point.to_array()), Vec3::of(normal.to_array()))
    }

    /// Checks that the gradients of texture coordinates, mapped to scene space, equal central
    /// differences of the coordinates.
    #[test]
    fn gradients_match_finite_differences() {
        let normal = DVec3::new(0.3, 0.8, -0.2).normalize();
        for projection in
            [Projection::Planar, Projection::Spherical, Projection::Cylindrical, Projection::Box]
        {
            for axis in [None, Some(Axis::X), Some(Axis::Y), Some(Axis::Z)] {
                let p = projector(projection, axis);
                let point = DVec3::new(5.9, -3.1, 1.2);
                let coordinates = coordinates_at(&p, point, normal);
                for (axis, way) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
                    let h = 1e-6;
                    let a = coordinates_at(&p, point - way * h, normal);
                    let b = coordinates_at(&p, point + way * h, normal);
                    let column = Vec3::<f64>::splat(p.texture_from_scene[axis]);
                    for (a, b, gradient) in
                        [(a.u, b.u, coordinates.grad_u), (a.v, b.v, coordinates.grad_v)]
                    {
                        let slope = (b - a) / (2.0 * h);
                        let derivative = gradient.dot(column);
                        assert!(
                            (slope - derivative).abs() < 1e-6,
                            "{projection:?} {axis}: {slope} {derivative}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn coordinates_are_finite_on_axes_and_in_center() {
        for projection in [Projection::Spherical, Projection::Cylindrical] {
            let p = TextureMapping::<f32>::new(
                &placement(Mapping::Auto, None),
                projection,
                &DAffine3::IDENTITY,
                [DVec3::NEG_ONE, DVec3::ONE],
                0.0,
            );
            for point in [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]] {
                let c = p.coordinates(Vec3::<f32>::of(point), Vec3::of([0.0, 1.0, 0.0]));
                let numbers = [c.u, c.v, c.grad_u.max_abs(), c.grad_v.max_abs()];
                assert!(numbers.iter().all(|x| x.is_finite()), "{projection:?} {point:?} {c:?}");
            }
        }
    }

    #[test]
    fn ramp_tilts_normal_by_its_slope() {
        let p = TextureMapping::<f64>::new(
            &placement(Mapping::Auto, None),
            Projection::Planar,
            &DAffine3::from_scale(DVec3::splat(7.0)),
            [DVec3::ZERO, DVec3::ONE],
            0.0,
        );
        let slope = Vec3::<f64>::of([0.4, 0.0, 9.0]);
        let up = p.bumped(Vec3::of([0.0, 0.0, 1.0]), 1.0, slope);
        assert!((up.x / up.z + 0.4).abs() < 1e-14 && up.y == 0.0 && up.z > 0.0);
        let back = p.bumped(Vec3::of([0.0, 0.0, -1.0]), -1.0, slope);
        assert!((back.x / back.z + 0.4).abs() < 1e-14 && back.z < 0.0, "the same surface");
    }
}
