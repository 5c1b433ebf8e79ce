//! Implementations of the SIMD traits with one lane: `f32` and `f64`. Operations have the same
//! order as with several lanes, so that results have identical bits.

use crate::lanes::{MAX_WIDTH, Mask, SimdFloat, SimdU32, by_own_methods};
use std::num::Wrapping;

impl Mask for bool {
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self)
    }
}

impl SimdU32 for Wrapping<u32> {
    #[inline(always)]
    fn splat(x: u32) -> Self {
        Self(x)
    }
    #[inline(always)]
    fn from_fn(mut f: impl FnMut(usize) -> u32) -> Self {
        Self(f(0))
    }
    #[inline(always)]
    fn lane(self, _: usize) -> u32 {
        self.0
    }
    #[inline(always)]
    fn shift_right(self, n: u32) -> Self {
        Self(self.0 >> n)
    }
    by_own_methods! { Wrapping<u32>: reverse = reverse_bits() -> Self }
}

macro_rules! scalar_lanes {
    ($float:ident, $bits:ident, $unit:expr) => {
        impl SimdFloat for $float {
            const WIDTH: usize = 1;
            const NAME: &'static str = stringify!($float);
            const MAX: f64 = $float::MAX as f64;
            type Scalar = $float;
            type Mask = bool;
            type SimdU32 = Wrapping<u32>;

            #[inline(always)]
            fn splat(x: $float) -> Self {
                x
            }
            #[inline(always)]
            fn from_fn(mut f: impl FnMut(usize) -> $float) -> Self {
                f(0)
            }
            #[inline(always)]
            fn lane(self, _: usize) -> $float {
                self
            }
            #[inline(always)]
            fn mul_add(self, a: Self, b: Self) -> Self {
                // The vector types use fused multiply-add on these targets only.
                if cfg!(any(target_feature = "fma", target_arch = "aarch64")) {
                    <$float>::mul_add(self, a, b)
                } else {
                    self * a + b
                }
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn min_max(self) -> (Self, Self) {
                (SimdFloat::min(self, <$float>::MAX), SimdFloat::max(self, -<$float>::MAX))
            }
            by_own_methods! {
                $float:
                abs = abs() -> Self,
                sqrt = sqrt() -> Self,
                sin_cos = sin_cos() -> (Self, Self),
                atan2 = atan2(x) -> Self,
                ln = ln() -> Self,
                exp = exp() -> Self,
                copysign = copysign(sign) -> Self,
            }
            #[inline(always)]
            fn lt(self, other: Self) -> bool {
                self < other
            }
            #[inline(always)]
            fn le(self, other: Self) -> bool {
                self <= other
            }
            #[inline(always)]
            fn mask(value: bool) -> bool {
                value
            }
            #[inline(always)]
            fn select(mask: bool, yes: Self, no: Self) -> Self {
                if mask { yes } else { no }
            }
            #[inline(always)]
            fn from_id(id: u32) -> Self {
                <$float>::from_bits($bits::from(id))
            }
            #[inline(always)]
            fn id_lane(self, _: usize) -> u32 {
                self.to_bits() as u32
            }
            #[inline(always)]
            fn id_eq(self, id: u32) -> bool {
                self.id_lane(0) == id
            }
            #[inline(always)]
            fn to_unit(bits: Wrapping<u32>) -> Self {
                let unit: fn(u32) -> $float = $unit;
                unit(bits.0)
            }
            #[inline(always)]
            fn fixed_sum(self, scale: f64) -> i64 {
                (f64::from(self) * scale).round_ties_even() as i64
            }
            #[inline(always)]
            fn fixed(self, scale: f64) -> [i64; MAX_WIDTH] {
                let mut each = [0; MAX_WIDTH];
                each[0] = self.fixed_sum(scale);
                each
            }
        }
    };
}

scalar_lanes!(f32, u32, |x| (x >> 8) as f32 * (1.0 / 16_777_216.0));
scalar_lanes!(f64, u64, |x| (f64::from(x) + 0.5) * (1.0 / 4_294_967_296.0));
