//! Implementations of the SIMD traits with several lanes, based on the types of the `wide` crate.

use crate::lanes::{MAX_WIDTH, Mask, ROUNDER, SimdFloat, SimdU32, array_from_fn, by_own_methods};
use std::ops::Shl;
use wide::bytemuck::cast;
use wide::{f32x4, f32x8, f64x2, f64x4, i32x4, i32x8, i64x4, u32x4, u32x8};
#[cfg(target_feature = "avx512f")]
use wide::{f32x16, f64x8, i32x16, i64x8, u32x16};

macro_rules! vector_bits {
    ($bits:ident, $reverse:expr) => {
        impl SimdU32 for $bits {
            #[inline(always)]
            fn splat(x: u32) -> Self {
                $bits::splat(x)
            }
            #[inline(always)]
            fn from_fn(f: impl FnMut(usize) -> u32) -> Self {
                $bits::new(array_from_fn(f))
            }
            #[inline(always)]
            fn lane(self, i: usize) -> u32 {
                self.as_array()[i]
            }
            #[inline(always)]
            fn shift_right(self, n: u32) -> Self {
                self >> n
            }
            #[inline(always)]
            fn reverse(self) -> Self {
                let reverse: fn($bits) -> $bits = $reverse;
                reverse(self)
            }
        }
    };
}

/// Reverses the bits of each 32-bit lane by shifts and masks.
#[inline(always)]
fn reverse_by_shifts<B: SimdU32 + Shl<u32, Output = B>>(x: B) -> B {
    let swap = |x: B, n: u32, m: u32| (x.shift_right(n) & B::splat(m)) | ((x & B::splat(m)) << n);
    let x = swap(x, 1, 0x5555_5555);
    let x = swap(x, 2, 0x3333_3333);
    let x = swap(x, 4, 0x0f0f_0f0f);
    let x = swap(x, 8, 0x00ff_00ff);
    x.shift_right(16) | (x << 16)
}

/// Returns a table for byte shuffles: bits of each 4-bit index reversed, then shifted by `SHIFT`.
const fn nibbles<const SHIFT: u32>() -> [i8; 16] {
    let mut table = [0i8; 16];
    let mut n = 0;
    while n < 16 {
        table[n] = ((n as u8).reverse_bits() >> 4 << SHIFT) as i8;
        n += 1;
    }
    table
}

/// Reverses the bits of each lane. A table lookup reverses each group of four bits; then the bytes
/// of each word are reversed.
#[inline(always)]
fn reverse8(x: u32x8) -> u32x8 {
    use wide::i8x32;
    const fn twice(t: [i8; 16]) -> [i8; 32] {
        let mut out = [0; 32];
        let mut i = 0;
        while i < 32 {
            out[i] = t[i % 16];
            i += 1;
        }
        out
    }
    const HIGH: [i8; 32] = twice(nibbles::<4>());
    const LOW: [i8; 32] = twice(nibbles::<0>());
    const ORDER: [i8; 32] = twice([3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12]);
    let nibble = u32x8::splat(0x0f0f_0f0f);
    let high: u32x8 = cast(i8x32::new(HIGH).swizzle_half_relaxed(cast(x & nibble)));
    let low: u32x8 = cast(i8x32::new(LOW).swizzle_half_relaxed(cast((x >> 4u32) & nibble)));
    let bytes = high | low;
    cast(i8x32::swizzle_half_relaxed(cast(bytes), i8x32::new(ORDER)))
}

vector_bits!(u32x8, reverse8);
vector_bits!(u32x4, reverse_by_shifts);
#[cfg(target_feature = "avx512f")]
vector_bits!(u32x16, reverse_by_shifts);

/// Returns `table[indices[i]]` in each lane i, by one instruction if the table has 16 elements.
#[cfg(target_feature = "avx512f")]
#[inline(always)]
fn gather16(table: &[f32], indices: &[u32; MAX_WIDTH]) -> f32x16 {
    use safe_arch::{m512i, permute_i32_m512i};
    let Ok(table) = <[f32; 16]>::try_from(table) else {
        return f32x16::new(array_from_fn(|i| table[indices[i] as usize]));
    };
    let indices = m512i::from(cast::<[u32; 16], [i32; 16]>(*indices));
    let table = m512i::from(cast::<[f32; 16], [i32; 16]>(table));
    let lanes: [i32; 16] = permute_i32_m512i(indices, table).into();
    f32x16::new(cast(lanes))
}

macro_rules! vector_lanes {
    ($vector:ident, $half:ident, $scalar:ident, $bits:ident, $raw:ident, $n:literal, [$double:ident, $long:ident],
     $unit:expr $(; $gather:ident)?) => {
        impl Mask for $vector {
            by_own_methods! { $vector: bits = to_bitmask() -> u32 }
        }

        impl SimdFloat for $vector {
            const WIDTH: usize = $n;
            const NAME: &'static str = stringify!($vector);
            const MAX: f64 = $scalar::MAX as f64;
            type Scalar = $scalar;
            type Mask = $vector;
            type SimdU32 = $bits;

            #[inline(always)]
            fn splat(x: $scalar) -> Self {
                $vector::splat(x)
            }
            #[inline(always)]
            fn from_fn(f: impl FnMut(usize) -> $scalar) -> Self {
                $vector::new(array_from_fn(f))
            }
            $(#[inline(always)]
            fn gather(table: &[$scalar], indices: &[u32; MAX_WIDTH]) -> Self {
                $gather(table, indices)
            })?
            #[inline(always)]
            fn lane(self, i: usize) -> $scalar {
                self.as_array()[i]
            }
            #[inline(always)]
            fn min_max(self) -> ($scalar, $scalar) {
                // First the halves of the vector are compared, then the lanes of the result.
                let max = $vector::splat($scalar::MAX);
                let [a, b]: [$half; 2] = cast(SimdFloat::min(self, max));
                let [c, d]: [$half; 2] = cast(SimdFloat::max(self, -max));
                let (low, high) = (a.fast_min(b).to_array(), c.fast_max(d).to_array());
                let smaller = |a, b| if a < b { a } else { b };
                let larger = |a, b| if a > b { a } else { b };
                (
                    low.into_iter().fold($scalar::MAX, smaller),
                    high.into_iter().fold(-$scalar::MAX, larger),
                )
            }
            by_own_methods! {
                $vector:
                mul_add = mul_add(a, b) -> Self,
                min = fast_min(other) -> Self,
                max = fast_max(other) -> Self,
                abs = abs() -> Self,
                sqrt = sqrt() -> Self,
                sin_cos = sin_cos() -> (Self, Self),
                atan2 = atan2(x) -> Self,
                ln = ln() -> Self,
                exp = exp() -> Self,
                copysign = copysign(sign) -> Self,
                lt = simd_lt(other) -> Self,
                le = simd_le(other) -> Self,
            }
            #[inline(always)]
            fn mask(value: bool) -> Self {
                let bits = if value { $raw::MAX } else { 0 };
                $vector::splat($scalar::from_bits(bits))
            }
            #[inline(always)]
            fn select(mask: Self, yes: Self, no: Self) -> Self {
                mask.select(yes, no)
            }
            #[inline(always)]
            fn masked(self, mask: Self) -> Self {
                self & mask
            }
            #[inline(always)]
            fn from_id(id: u32) -> Self {
                $vector::splat($scalar::from_bits($raw::from(id)))
            }
            #[inline(always)]
            fn id_lane(self, i: usize) -> u32 {
                self.as_array()[i].to_bits() as u32
            }
            #[inline(always)]
            fn id_eq(self, id: u32) -> Self {
                $vector::from_bits(self.to_bits().simd_eq(Self::from_id(id).to_bits()))
            }
            #[inline(always)]
            fn to_unit(bits: $bits) -> Self {
                let unit: fn($bits) -> $vector = $unit;
                unit(bits)
            }
            #[inline(always)]
            fn fixed_sum(self, scale: f64) -> i64 {
                // The bits of `ROUNDER` are subtracted from the sum once for each lane.
                let (scale, rounder) = ($double::splat(scale), $double::splat(ROUNDER));
                let mut sum = $long::splat(0);
                for part in self.as_array().chunks_exact(<$double as SimdFloat>::WIDTH) {
                    let x = $double::new(std::array::from_fn(|i| f64::from(part[i])));
                    sum += cast::<$double, $long>(x.mul_add(scale, rounder));
                }
                let all = sum.as_array().iter().fold(0i64, |all, lane| all.wrapping_add(*lane));
                all.wrapping_sub((ROUNDER.to_bits() as i64).wrapping_mul($n))
            }
            #[inline(always)]
            fn fixed(self, scale: f64) -> [i64; MAX_WIDTH] {
                // Whole vectors are converted, because the compiler would store single lanes one by
                // one.
                let (scale, rounder) = ($double::splat(scale), $double::splat(ROUNDER));
                let mut each = [0; MAX_WIDTH];
                let parts = self.as_array().chunks_exact(<$double as SimdFloat>::WIDTH);
                for (each, part) in each.chunks_exact_mut(<$double as SimdFloat>::WIDTH).zip(parts)
                {
                    let x = $double::new(std::array::from_fn(|i| f64::from(part[i])));
                    let bits = cast::<$double, $long>(x.mul_add(scale, rounder));
                    let rounded = bits - $long::splat(ROUNDER.to_bits() as i64);
                    each.copy_from_slice(&rounded.to_array());
                }
                each
            }
        }
    };
}

vector_lanes!(f32x8, f32x4, f32, u32x8, u32, 8, [f64x4, i64x4], |bits| {
    f32x8::from_i32x8(cast::<u32x8, i32x8>(bits >> 8u32)) * f32x8::splat(1.0 / 16_777_216.0)
});
vector_lanes!(f64x4, f64x2, f64, u32x4, u64, 4, [f64x4, i64x4], |bits| {
    let signed: i32x4 = cast(bits ^ u32x4::splat(0x8000_0000));
    (f64x4::from_i32x4(signed) + f64x4::splat(2_147_483_648.5))
        * f64x4::splat(1.0 / 4_294_967_296.0)
});
#[cfg(target_feature = "avx512f")]
vector_lanes!(f32x16, f32x8, f32, u32x16, u32, 16, [f64x8, i64x8], |bits| {
    f32x16::from_i32x16(cast::<u32x16, i32x16>(bits >> 8u32)) * f32x16::splat(1.0 / 16_777_216.0)
}; gather16);
#[cfg(target_feature = "avx512f")]
vector_lanes!(f64x8, f64x4, f64, u32x8, u64, 8, [f64x8, i64x8], |bits| {
    let signed: i32x8 = cast(bits ^ u32x8::splat(0x8000_0000));
    (f64x8::from_i32x8(signed) + f64x8::splat(2_147_483_648.5))
        * f64x8::splat(1.0 / 4_294_967_296.0)
});
