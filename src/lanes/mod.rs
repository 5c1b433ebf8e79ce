//! The numbers that kernels are written in.
//!
//! A kernel (intersection, shading, sampling) is written once, generic over [`SimdFloat`]: a vector of
//! `WIDTH` floats that are computed side by side. Instances:
//!
//! | type | precision | width | use |
//! |---|---|---|---|
//! | `wide::f32x8` | single | 8 | production, speed |
//! | `wide::f64x4` | double | 4 | production, accuracy |
//! | `wide::f32x16`, `wide::f64x8` | both | 16, 8 | the same two when built for AVX-512 |
//! | `f32`, `f64` | both | 1 | tests, benches, and kinds that resist packets |
//!
//! All operations up to `sqrt` are IEEE operations, so that every instance of one precision gives the
//! same bits; [`SimdFloat::mul_add`] is fused exactly where the vectors fuse it. Only `sin_cos`, `atan2`, `ln`
//! and `exp` may differ between the vector instances and the width-1 ones, by a few ulps.

mod scalar;
mod vec3;
mod vector;

pub use vec3::{Frame, Vec3};

use std::fmt::Debug;
use std::ops::{
    Add, AddAssign, BitAnd, BitOr, BitXor, Div, Mul, MulAssign, Neg, Not, Shl, Shr, Sub, SubAssign,
};

/// The single-precision instance that renders.
#[cfg(not(target_feature = "avx512f"))]
pub type Single = wide::f32x8;
/// The double-precision instance that renders.
#[cfg(not(target_feature = "avx512f"))]
pub type Double = wide::f64x4;
/// The single-precision instance that renders.
#[cfg(target_feature = "avx512f")]
pub type Single = wide::f32x16;
/// The double-precision instance that renders.
#[cfg(target_feature = "avx512f")]
pub type Double = wide::f64x8;

/// The widest instance: arrays indexed by lane have this length.
pub const MAX_WIDTH: usize = if cfg!(target_feature = "avx512f") { 16 } else { 8 };

/// One lane: `f32` or `f64`.
pub trait Float: Copy + Debug + PartialOrd + Default + Send + Sync + 'static {
    /// Distance from 1 to the next larger number of this precision.
    const EPSILON: f64;
    /// Nearest value of this precision.
    fn from_f64(x: f64) -> Self;
    /// Exact.
    fn to_f64(self) -> f64;
}

impl Float for f32 {
    const EPSILON: f64 = f32::EPSILON as f64;
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        x as f32
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Float for f64 {
    const EPSILON: f64 = f64::EPSILON;
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
}

/// The result of a comparison, one truth value per lane.
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
    /// True in at least one lane.
    fn any(self) -> bool;
    /// True in every lane.
    fn all(self) -> bool;
    /// Bit `i` is lane `i`.
    fn bits(self) -> u32;
    /// Lane `i`.
    #[inline(always)]
    fn lane(self, i: usize) -> bool {
        self.bits() >> i & 1 != 0
    }
    /// True in no lane.
    #[inline(always)]
    fn none(self) -> bool {
        !self.any()
    }
    /// `self` and not `other`.
    #[inline(always)]
    fn and_not(self, other: Self) -> Self {
        self & !other
    }
}

/// Unsigned 32-bit integers, one per lane, for hashes and sample sequences. Arithmetic wraps.
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
    + Shl<u32, Output = Self>
    + Shr<u32, Output = Self>
    + 'static
{
    /// The same value in every lane.
    fn splat(x: u32) -> Self;
    /// Lane `i` is `f(i)`.
    fn from_fn(f: impl FnMut(usize) -> u32) -> Self;
    /// Lane `i`.
    fn lane(self, i: usize) -> u32;
    /// Bit 0 becomes bit 31 and so on, in each lane.
    fn reverse(self) -> Self;
}

/// A vector of `WIDTH` floats. See the room's description.
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
    + SubAssign
    + MulAssign
    + 'static
{
    /// Number of lanes.
    const WIDTH: usize;
    /// Name for statistics, such as `f32x8`.
    const NAME: &'static str;
    /// Distance from 1 to the next larger number of this precision.
    const EPSILON: f64 = Self::Scalar::EPSILON;
    /// Largest finite number of this precision.
    const MAX: f64;
    /// One lane.
    type Scalar: Float;
    /// The result of comparisons.
    type Mask: Mask;
    /// Integers of the same width.
    type SimdU32: SimdU32;

    /// The same value in every lane.
    fn splat(x: Self::Scalar) -> Self;
    /// Lane `i` is `f(i)`.
    fn from_fn(f: impl FnMut(usize) -> Self::Scalar) -> Self;
    /// Lane `i`.
    fn lane(self, i: usize) -> Self::Scalar;
    /// The same value, rounded to this precision, in every lane.
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        Self::splat(Self::Scalar::from_f64(x))
    }
    /// Zero in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::from_f64(0.0)
    }
    /// One in every lane.
    #[inline(always)]
    fn one() -> Self {
        Self::from_f64(1.0)
    }

    /// `self * a + b`, rounded once if the target has fused multiply-add, else twice.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// The smaller. If `self` is NaN, `other`; unspecified (but no panic) if `other` is NaN.
    fn min(self, other: Self) -> Self;
    /// The larger. If `self` is NaN, `other`; unspecified (but no panic) if `other` is NaN.
    fn max(self, other: Self) -> Self;
    /// The smallest and the largest lane; lanes that are NaN do not count (the largest number and its
    /// negative, if all are).
    fn min_max(self) -> (Self::Scalar, Self::Scalar);
    /// Absolute value.
    fn abs(self) -> Self;
    /// Square root; NaN below zero.
    fn sqrt(self) -> Self;
    /// Sine and cosine of radians.
    fn sin_cos(self) -> (Self, Self);
    /// The angle of the point (`x`, `self`) from the x axis, in radians from -pi to pi.
    fn atan2(self, x: Self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// e to the power `self`.
    fn exp(self) -> Self;
    /// The magnitude of `self` with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;

    /// `self < other`; false for NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`; false for NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// `self > other`; false for NaN.
    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }
    /// `self >= other`; false for NaN.
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }
    /// The same truth value in every lane.
    fn mask(value: bool) -> Self::Mask;
    /// `yes` where `mask` is true, `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// `self` where `mask` is true, zero elsewhere.
    #[inline(always)]
    fn masked(self, mask: Self::Mask) -> Self {
        Self::select(mask, self, Self::zero())
    }

    /// A 32-bit label carried through [`SimdFloat::select`]; not a number to compute with. Labels below
    /// 2^31 - 2^23 compare by [`SimdFloat::lt`] and [`SimdFloat::le`] like integers, as the bits of all
    /// positive floats do.
    fn from_id(label: u32) -> Self;
    /// The label in lane `i`.
    fn id_lane(self, i: usize) -> u32;
    /// Where the label is `label`.
    fn id_eq(self, label: u32) -> Self::Mask;

    /// Uniform in [0, 1) from 32 random bits: 24 of them in single precision, all in double (there
    /// in the middle of its step).
    fn to_unit(bits: Self::SimdU32) -> Self;

    /// The sum over lanes of `round(lane * scale)`. Each lane is rounded by itself, so that the sum
    /// is exact in any grouping; `|lane * scale|` must not exceed 2^49.
    fn fixed_sum(self, scale: f64) -> i64;
    /// `round(lane * scale)` of every lane, zeros behind the last; the same bounds.
    fn fixed(self, scale: f64) -> [i64; MAX_WIDTH];
}

/// Id of the first lane of `mask`, and the lanes of `mask` that have this id; `None` if `mask` is empty.
#[inline(always)]
pub(crate) fn next_distinct<L: SimdFloat>(ids: L, mask: L::Mask) -> Option<(u32, L::Mask)> {
    let bits = mask.bits();
    if bits == 0 {
        return None;
    }
    let id = ids.id_lane(bits.trailing_zeros() as usize);
    Some((id, mask & ids.id_eq(id)))
}

/// 1.5 x 2^52: a double below 2^51 in magnitude plus this has no fraction bits left: it is rounded to
/// the nearest integer, which is the difference of the bits.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// `round(x)` to nearest even, for `|x| < 2^51`.
#[inline(always)]
fn round_i64(x: f64) -> i64 {
    ((x + ROUNDER).to_bits() as i64).wrapping_sub(ROUNDER.to_bits() as i64)
}

/// Begins to bring the cache line in which `thing` begins from memory, where the processor can be asked
/// to; nothing waits for it.
#[inline(always)]
pub fn prefetch<T>(thing: &T) {
    #[cfg(target_arch = "x86_64")]
    safe_arch::prefetch_t0(thing);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = thing;
}
