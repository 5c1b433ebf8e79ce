//! Integer hashes of 32-bit words and of SIMD vectors of them, for random numbers.

use crate::lanes::SimdU32;

/// Returns a bijective 32-bit hash of `x` with low bias (constants: Wellons 2018, *Prospecting for
/// Hash Functions*, `lowbias32`).
#[inline(always)]
pub fn hash<B: SimdU32>(x: B) -> B {
    let x = (x ^ x.shift_right(16)) * B::splat(0x7feb_352d);
    let x = (x ^ x.shift_right(15)) * B::splat(0x846c_a68b);
    x ^ x.shift_right(16)
}

/// Hashes a single 32-bit word as [`hash`] does.
pub const fn hash_scalar(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Returns a 32-bit hash of `words`, which depends on the order of the words.
pub fn hash_words(words: &[u32]) -> u32 {
    words.iter().fold(0x9e37_79b9, |h, w| {
        hash_scalar(h.rotate_left(5).wrapping_add(0x85eb_ca6b) ^ hash_scalar(*w))
    })
}
