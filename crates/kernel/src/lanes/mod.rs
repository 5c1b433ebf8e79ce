//! SIMD lanes: the types of floats, masks and integers in which kernels are written.
//!
//! A kernel (intersection, shading, sampling) is written once, generic over the trait
//! [`SimdFloat`]: a vector of `WIDTH` floats. The trait has these instances:
//!
//! | type | precision | width | use |
//! |---|---|---|---|
//! | `wide::f32x8` | single | 8 | production, speed |
//! | `wide::f64x4` | double | 4 | production, accuracy |
//! | `wide::f32x16` | single | 16 | production when built for AVX-512 |
//! | `wide::f64x8` | double | 8 | production when built for AVX-512 |
//! | `f32`, `f64` | both | 1 | tests, benches, and primitives without packet kernels |
//!
//! All instances of one precision return identical bits, because arithmetic operations, comparisons
//! and square root are IEEE operations, and [`SimdFloat::mul_add`] is fused on all instances or on
//! none. Only `sin_cos`, `atan2`, `ln` and `exp` may differ by a few ulps at width 1.

mod scalar;
mod vec3;
mod vector;

pub use vec3::{Frame, Vec3};

use std::fmt::Debug;
use std::ops::{Add, AddAssign, BitAnd, BitOr, BitXor, Div, Mul, MulAssign, Neg, Not, Sub};

/// Single-precision SIMD vector that the renderer uses.
#[cfg(not(target_feature = "avx512f"))]
pub type Single = wide::f32x8;
/// Double-precision SIMD vector that the renderer uses.
#[cfg(not(target_feature = "avx512f"))]
pub type Double = wide::f64x4;
/// Single-precision SIMD vector that the renderer uses with AVX-512.
#[cfg(target_feature = "avx512f")]
pub type Single = wide::f32x16;
/// Double-precision SIMD vector that the renderer uses with AVX-512.
#[cfg(target_feature = "avx512f")]
pub type Double = wide::f64x8;

/// Number of lanes of the widest SIMD type of this build, and length of arrays indexed by lane.
pub const MAX_WIDTH: usize = if cfg!(target_feature = "avx512f") { 16 } else { 8 };

/// Returns the array whose element `i` is `f(i)`: `std::array::from_fn` as a plain loop, which the
/// compiler always inlines into a kernel.
#[inline(always)]
pub fn array_from_fn<T: Copy, const N: usize>(mut f: impl FnMut(usize) -> T) -> [T; N] {
    const { assert!(N > 0) };
    let mut values = [f(0); N];
    for (i, value) in values.iter_mut().enumerate().skip(1) {
        *value = f(i);
    }
    values
}

/// Type of one lane: `f32` or `f64`.
pub trait Float: Copy + Debug + PartialOrd + Default + Send + Sync + 'static {
    /// Distance from 1 to the next larger number.
    const EPSILON: f64;
    /// Rounds `x` to the nearest value of this type.
    fn from_f64(x: f64) -> Self;
    /// Converts to double precision without rounding.
    fn to_f64(self) -> f64;
    /// Converts to an integer, rounded towards zero and clamped to the range of `u32`.
    fn to_u32(self) -> u32;
    /// Returns `self + other`.
    fn plus(self, other: Self) -> Self;
}

macro_rules! float {
    ($float:ident) => {
        impl Float for $float {
            const EPSILON: f64 = $float::EPSILON as f64;

            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                x as $float
            }

            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }

            #[inline(always)]
            fn to_u32(self) -> u32 {
                self as u32
            }

            #[inline(always)]
            fn plus(self, other: Self) -> Self {
                self + other
            }
        }
    };
}
float!(f32);
float!(f64);

/// Implements methods of SIMD traits as calls of inherent methods of `$type`.
macro_rules! by_own_methods {
    ($type:ty: $($name:ident = $own:ident($($argument:ident),*) -> $result:ty),+ $(,)?) => {$(
        #[inline(always)]
        fn $name(self, $($argument: Self),*) -> $result {
            <$type>::$own(self, $($argument),*)
        }
    )+};
}
use by_own_methods;

/// Result of a lane-wise comparison.
pub trait Mask:
    Copy
    + Debug
    + Send
    + Sync
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + Not<Output = Self>
    + 'static
{
    /// Returns lane `i` as bit `i`.
    fn bits(self) -> u32;
    /// Returns `true` if every lane is true.
    #[inline(always)]
    fn all(self) -> bool {
        (!self).none()
    }
    /// Returns `true` if at least one lane is true.
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
    /// Returns lane `i`.
    #[inline(always)]
    fn lane(self, i: usize) -> bool {
        self.bits() >> i & 1 != 0
    }
    /// Returns `true` if no lane is true.
    #[inline(always)]
    fn none(self) -> bool {
        !self.any()
    }
    /// Returns the lanes that are true in `self` and false in `other`.
    #[inline(always)]
    fn and_not(self, other: Self) -> Self {
        self & !other
    }
}

/// Vector of unsigned 32-bit integers, for hashes and sample sequences. Arithmetic wraps.
pub trait SimdU32:
    Copy
    + Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Mul<Output = Self>
    + BitXor<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + 'static
{
    /// Returns `x` in every lane.
    fn splat(x: u32) -> Self;
    /// Returns the vector whose lane `i` is `f(i)`.
    fn from_fn(f: impl FnMut(usize) -> u32) -> Self;
    /// Returns lane `i`.
    fn lane(self, i: usize) -> u32;
    /// Shifts the bits of each lane to the right by `n`.
    fn shift_right(self, n: u32) -> Self;
    /// Reverses the order of the bits in each lane.
    fn reverse(self) -> Self;
}

/// SIMD vector of `WIDTH` floats. The [module](self) has a table of its instances.
pub trait SimdFloat:
    Copy
    + Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + MulAssign
    + 'static
{
    /// Number of lanes.
    const WIDTH: usize;
    /// Name of the vector type for statistics and reports, such as `f32x8`.
    const NAME: &'static str;
    /// Distance from 1 to the next larger number of a lane.
    const EPSILON: f64 = Self::Scalar::EPSILON;
    /// Largest finite number of the lanes.
    const MAX: f64;
    /// Type of one lane.
    type Scalar: Float;
    /// Type of comparison results.
    type Mask: Mask;
    /// Integers with the same number of lanes.
    type SimdU32: SimdU32;

    /// Returns `x` in every lane.
    fn splat(x: Self::Scalar) -> Self;
    /// Returns the vector whose lane `i` is `f(i)`.
    fn from_fn(f: impl FnMut(usize) -> Self::Scalar) -> Self;
    /// Returns `table[indices[i]]` in each lane `i`.
    #[inline(always)]
    fn gather(table: &[Self::Scalar], indices: &[u32; MAX_WIDTH]) -> Self {
        Self::from_fn(|i| table[indices[i] as usize])
    }
    /// Returns lane `i`.
    fn lane(self, i: usize) -> Self::Scalar;
    /// Returns `x`, rounded, in every lane.
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        Self::splat(Self::Scalar::from_f64(x))
    }
    /// Returns zero in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::from_f64(0.0)
    }
    /// Returns one in every lane.
    #[inline(always)]
    fn one() -> Self {
        Self::from_f64(1.0)
    }

    /// Computes `self * a + b`, rounded once if the target has fused multiply-add, else twice.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// Returns the lane-wise minimum. Lanes where `self` is NaN become `other`. Lanes where `other`
    /// is NaN have an unspecified value.
    fn min(self, other: Self) -> Self;
    /// Returns the lane-wise maximum, with NaN as for [`SimdFloat::min`].
    fn max(self, other: Self) -> Self;
    /// Returns the minimum and the maximum over the lanes that are not NaN; [`SimdFloat::MAX`] and
    /// its negative if all lanes are NaN.
    fn min_max(self) -> (Self::Scalar, Self::Scalar);
    /// Returns the absolute value.
    fn abs(self) -> Self;
    /// Returns the square root; NaN for negative numbers.
    fn sqrt(self) -> Self;
    /// Returns sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);
    /// Returns the angle of the point (`x`, `self`) from the x axis, in radians from -pi to pi.
    fn atan2(self, x: Self) -> Self;
    /// Returns the natural logarithm.
    fn ln(self) -> Self;
    /// Returns e to the power of each lane.
    fn exp(self) -> Self;
    /// Returns the magnitude of `self` with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;

    /// Returns the lanes where `self < other`; false for NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// Returns the lanes where `self <= other`; false for NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// Returns the lanes where `self > other`; false for NaN.
    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }
    /// Returns the lanes where `self >= other`; false for NaN.
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }
    /// Returns a mask with `value` in every lane.
    fn mask(value: bool) -> Self::Mask;
    /// Returns `yes` in lanes where `mask` is true, `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Returns `self` in lanes where `mask` is true, zero elsewhere.
    #[inline(always)]
    fn masked(self, mask: Self::Mask) -> Self {
        Self::select(mask, self, Self::zero())
    }

    /// Stores the bits of a 32-bit id in every lane. Ids can be selected and compared; arithmetic
    /// on them is meaningless. Ids below 2^31 - 2^23 compare like integers, because positive floats
    /// have the order of their bits.
    fn from_id(id: u32) -> Self;
    /// Returns the id that [`SimdFloat::from_id`] has stored in lane `i`.
    fn id_lane(self, i: usize) -> u32;
    /// Returns the lanes in which [`SimdFloat::from_id`] has stored `id`.
    fn id_eq(self, id: u32) -> Self::Mask;

    /// Maps 32 random bits per lane to a number in [0, 1). Single precision uses 24 of the bits;
    /// double precision returns the middle of one of 2^32 equal intervals.
    fn to_unit(bits: Self::SimdU32) -> Self;

    /// Returns the sum of `round(lane * scale)` over all lanes; see [`SimdFloat::fixed`].
    fn fixed_sum(self, scale: f64) -> i64;
    /// Returns `round(lane * scale)` of each lane; array elements beyond the last lane are zero.
    /// `scale` must be a power of two, and `|lane * scale|` at most 2^49.
    fn fixed(self, scale: f64) -> [i64; MAX_WIDTH];
}

/// Returns the id in the first lane of `mask`, and all lanes of `mask` that have this id; `None` if
/// `mask` is empty.
#[inline(always)]
pub fn next_distinct<L: SimdFloat>(ids: L, mask: L::Mask) -> Option<(u32, L::Mask)> {
    let bits = mask.bits();
    if bits == 0 {
        return None;
    }
    let id = ids.id_lane(bits.trailing_zeros() as usize);
    Some((id, mask & ids.id_eq(id)))
}

/// Iterates over the distinct ids in the lanes of `mask`: each id, and the lanes that have it.
#[inline(always)]
pub fn distinct<L: SimdFloat>(ids: L, mask: L::Mask) -> impl Iterator<Item = (u32, L::Mask)> {
    let mut remaining = mask;
    std::iter::from_fn(move || {
        let (id, lanes) = next_distinct(ids, remaining)?;
        remaining = remaining.and_not(lanes);
        Some((id, lanes))
    })
}

/// Returns the polynomial `k[0] + k[1] x + k[2] x^2 + ...`.
#[inline(always)]
pub fn polynomial<L: SimdFloat>(k: &[f64], x: L) -> L {
    k.iter().rev().fold(L::zero(), |sum, k| sum.mul_add(x, L::from_f64(*k)))
}

/// Constant 1.5 x 2^52. Adding it to a double with a magnitude below 2^51 rounds the double to an
/// integer: the difference between the bits of the sum and the bits of the constant.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// Prefetches the first cache line of `value`; does nothing on processors without prefetch.
#[inline(always)]
pub fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    safe_arch::prefetch_t0(value);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    /// Returns the largest errors of atan2, in radians, and of sine and cosine, at angles all around.
    fn errors_of_angles<L: SimdFloat>() -> [f64; 2] {
        let (mut of_angle, mut of_sine) = (0.0f64, 0.0f64);
        let rounded = |x: f64| L::from_f64(x).lane(0).to_f64();
        for i in 0..10_000 {
            let angle = rounded(TAU * (f64::from(i) + 0.37) / 10_000.0 - PI);
            let (sin, cos) = L::from_f64(angle).sin_cos();
            let [sin, cos] = [sin, cos].map(|x| x.lane(0).to_f64());
            of_sine = of_sine.max((sin - angle.sin()).abs()).max((cos - angle.cos()).abs());
            let found = L::from_f64(sin).atan2(L::from_f64(cos)).lane(0).to_f64();
            of_angle = of_angle.max((found - sin.atan2(cos)).abs());
        }
        [of_angle, of_sine]
    }

    #[test]
    fn angles_in_lanes_have_errors_of_a_few_ulps() {
        for ([of_angle, of_sine], ulp) in [
            (errors_of_angles::<Single>(), f64::from(f32::EPSILON)),
            (errors_of_angles::<Double>(), f64::EPSILON),
        ] {
            assert!(of_angle < 3.0 * ulp && of_sine < ulp, "{of_angle}, {of_sine}");
        }
    }
}
