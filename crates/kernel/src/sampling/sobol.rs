//! Sobol points in eight dimensions with a 32-bit index, and their Owen scrambling. The dimensions
//! form four pairs. Each pair consists of the first two dimensions of the Sobol sequence, a (0,
//! 2)-sequence in base 2.
//!
//! Pair k has the points of this (0, 2)-sequence in an order of its own: point i of the pair is
//! point `M_k i` of the sequence. Here i is a vector of bits, and `M_k` is an upper triangular
//! matrix of bits with ones on its diagonal. Such a matrix permutes the first 2^m indices for every
//! m, so that each pair is still a (0, 2)-sequence (Faure and Tezuka 2002, *Another Random
//! Scrambling of Digital (t,s)-Sequences*). With the usual direction numbers (Joe and Kuo 2008)
//! only the first pair is a (0, 2)-sequence. This matters for images in a mirror: their noise
//! depends on only two pairs, the position in the pixel and the direction in the lobe.
//! docs/accuracy.md has the measured benefit.
//!
//! The first columns of the matrices were found by search, one column after the other. The search
//! minimised the errors of two estimates from 2^m randomly scrambled points. One is the volume of a
//! random half-space whose border is oblique to the axes of several pairs. The other is the mean of
//! a smooth product over several pairs. The remaining columns are random.
//!
//! Values are stored with the first binary digit in bit 0, as the scrambling hash requires.

use crate::lanes::SimdU32;
use crate::sampling::hash::hash_scalar;

/// Number of dimensions of the Sobol points.
pub const DIMENSIONS: usize = 8;

/// First columns of the bit matrices `M_1`, `M_2` and `M_3`. Bit r of a column is row r.
const COLUMNS: [&[u32]; 3] = [
    &[1, 3, 4, 13, 22, 46, 65, 179, 390, 573, 1694, 2956, 5907],
    &[1, 2, 6, 15, 22, 33, 100, 158, 457, 810],
    &[1, 2, 7, 12, 22, 39, 88, 191, 277],
];

/// Returns column `bit` of the bit matrix `M_k` with k = `pair`.
const fn column(pair: usize, bit: usize) -> u32 {
    let diagonal = 1 << bit;
    if pair == 0 {
        return diagonal;
    }
    let found = COLUMNS[pair - 1];
    if bit < found.len() {
        return found[bit];
    }
    diagonal | (hash_scalar((32 * (pair - 1) + bit) as u32) & (diagonal - 1))
}

/// Returns direction number `bit` of the first two dimensions of the Sobol sequence, 0 and 1.
const fn direction(dimension: usize, bit: usize) -> u32 {
    let mut row = 1 << bit;
    if dimension == 1 {
        // Pascal's triangle modulo 2.
        row = 1;
        let mut i = 0;
        while i < bit {
            row ^= row << 1;
            i += 1;
        }
    }
    row
}

/// Returns the direction numbers of a dimension, 0 to 7.
const fn directions(dimension: usize) -> [u32; 32] {
    let mut v = [0; 32];
    let mut bit = 0;
    while bit < 32 {
        let mut rows = column(dimension / 2, bit);
        while rows != 0 {
            v[bit] ^= direction(dimension % 2, rows.trailing_zeros() as usize);
            rows &= rows - 1;
        }
        bit += 1;
    }
    v
}

type Tables = [[[u32; 256]; 4]; DIMENSIONS];

/// Lookup tables of Sobol points. `TABLES[d][k][byte]` is XORed into dimension d of the point if
/// byte k of its index is `byte`.
static TABLES: Tables = {
    let mut tables = [[[0u32; 256]; 4]; DIMENSIONS];
    let mut d = 0;
    while d < DIMENSIONS {
        let v = directions(d);
        let mut k = 0;
        while k < 4 {
            let mut byte = 1;
            while byte < 256usize {
                let low = byte.trailing_zeros() as usize;
                tables[d][k][byte] = tables[d][k][byte & (byte - 1)] ^ v[8 * k + low];
                byte += 1;
            }
            k += 1;
        }
        d += 1;
    }
    tables
};

/// Returns Sobol point `index` in `dimension`, as a binary fraction of 32 digits.
#[inline(always)]
pub fn point(dimension: usize, index: u32) -> u32 {
    let t = &TABLES[dimension];
    let mut x = t[0][(index & 255) as usize];
    if index > 255 {
        x ^= t[1][(index >> 8 & 255) as usize];
        x ^= t[2][(index >> 16 & 255) as usize];
        x ^= t[3][(index >> 24) as usize];
    }
    x
}

/// Applies Owen scrambling to binary fractions whose first digit is in bit 0. Whether a digit is
/// flipped depends on `seed` and on all preceding digits.
///
/// Laine-Karras construction with the constants of Vegdahl 2021, *Building a Better LK Hash*.
#[inline(always)]
pub fn owen<B: SimdU32>(x: B, seed: B) -> B {
    owen_scramble_suffix(owen_scramble_prefix(x), seed, owen_factor(seed))
}

/// Computes the first part of [`owen`], which does not depend on the seed.
#[inline(always)]
pub fn owen_scramble_prefix<B: SimdU32>(x: B) -> B {
    x ^ (x * B::splat(0x3d20_adea))
}

/// Returns the odd factor of the multiplication in [`owen`].
#[inline(always)]
pub fn owen_factor<B: SimdU32>(seed: B) -> B {
    seed.shift_right(16) | B::splat(1)
}

/// Computes the second part of [`owen`].
#[inline(always)]
pub fn owen_scramble_suffix<B: SimdU32>(prefix: B, seed: B, factor: B) -> B {
    let x = (prefix + seed) * factor;
    let x = x ^ (x * B::splat(0x0552_6c56));
    x ^ (x * B::splat(0x53a2_2864))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn digits(dimension: usize, index: u32) -> u32 {
        point(dimension, index).reverse_bits()
    }

    /// Checks that each pair of dimensions is a (0, m, 2)-net for every m: each elementary interval
    /// of volume 2^-m contains exactly one of the first 2^m points. The same is checked for later
    /// runs of 2^m points that begin at a multiple of 2^m.
    #[test]
    fn elementary_intervals_hold_one_point_each() {
        for (pair, m) in (0..DIMENSIONS / 2).flat_map(|pair| (0..=12u32).map(move |m| (pair, m))) {
            for (first, split) in
                [0, 5, 0xabcde].iter().flat_map(|n| (0..=m).map(move |s| (n << m, s)))
            {
                let mut seen = vec![0; 1 << m];
                for i in first..first + (1 << m) {
                    let x = u64::from(digits(2 * pair, i)) << split >> 32;
                    let y = u64::from(digits(2 * pair + 1, i)) << (m - split) >> 32;
                    seen[((x << (m - split)) | y) as usize] += 1;
                }
                assert!(
                    seen.iter().all(|n| *n == 1),
                    "pair {pair}, 2^{m} points from {first}, split {split}"
                );
            }
        }
    }

    /// Checks that the first points of the Sobol sequence are those that were published with its
    /// direction numbers.
    #[test]
    fn first_points_are_the_published_ones() {
        let row = |i| [0, 1].map(|d| f64::from(digits(d, i)) / 4_294_967_296.0);
        // Points are in the order of radical inverses, without Gray code.
        let rows = [[0.0, 0.0], [0.5, 0.5], [0.25, 0.75], [0.75, 0.25], [0.125, 0.625]];
        (0..).zip(rows).for_each(|(i, published)| assert_eq!(row(i), published));
    }

    /// Checks that scrambled points estimate the volumes of random half-spaces better than
    /// independent points. The limits are for the RMS error of scrambled points divided by that of
    /// independent points. The normal of a half-space lies in the plane of dimensions 2 and 3 ("the
    /// lobe"), or it has components in all of the dimensions 0 to 3. For comparison: in the case
    /// "the lobe" the usual Sobol points have the ratios 0.30 (64 points) and 0.23 (256 points).
    #[test]
    fn scrambled_points_estimate_half_spaces_better_than_random_points() {
        use crate::lanes::SimdFloat;
        type One = f32;
        let unit = |bits: u32| f64::from(bits) / 4_294_967_296.0;
        let mut state = 1;
        let mut random = || {
            state += 1;
            hash_scalar(state)
        };
        for (name, weights, points, max_ratio) in [
            ("the lobe", [0.0, 1.0], 64, 0.30),
            ("mostly the lobe", [0.1, 1.0], 64, 0.35),
            ("both", [1.0, 1.0], 64, 0.50),
            ("the lobe", [0.0, 1.0], 256, 0.22),
            ("mostly the lobe", [0.1, 1.0], 256, 0.33),
            ("both", [1.0, 1.0], 256, 0.46),
        ] {
            let (mut error, mut independent) = (0.0, 0.0);
            for _ in 0..2000 {
                let angle = [0, 1].map(|_| std::f64::consts::TAU * unit(random()));
                let normal = [0, 1, 2, 3].map(|d| {
                    weights[d / 2]
                        * if d % 2 == 0 { angle[d / 2].cos() } else { angle[d / 2].sin() }
                });
                let height = |point: [u32; 4]| {
                    point.iter().zip(normal).map(|(x, n)| unit(*x) * n).sum::<f64>()
                };
                let border = height([0; 4].map(|_: u32| random()));
                let mut volume = || {
                    let keys = [0; 4].map(|_: u32| random());
                    let scrambled =
                        |i| [0, 1, 2, 3].map(|d| owen_1(point(d, i), keys[d]).reverse_bits());
                    (0..points).filter(|i| height(scrambled(*i)) > border).count() as f64
                        / f64::from(points)
                };
                let (a, b) = (volume(), volume());
                error += (a - b).powi(2) / 2.0;
                independent += 0.25 * (a + b) * (2.0 - a - b) / f64::from(points);
            }
            let ratio = f64::sqrt(error / independent);
            assert!(
                ratio < max_ratio,
                "{name}, {points} points: {ratio} of the error of random ones"
            );
        }
        fn owen_1(x: u32, seed: u32) -> u32 {
            owen(<One as SimdFloat>::SimdU32::splat(x), <One as SimdFloat>::SimdU32::splat(seed))
                .lane(0)
        }
    }

    /// Returns the largest gain coefficient of the dimensions `a` and `b` (Owen 1997, *Monte Carlo
    /// Variance of Scrambled Net Quadrature*): the variance of the first 2^m scrambled points
    /// divided by that of independent points, for the worst integrand of both dimensions.
    ///
    /// It is the maximum over all levels (j, k) of the mean over points p of the sum over points q
    /// of psi_j psi_k. Here psi_j = 2 [the first j + 1 digits of p and q are equal] - [the first j
    /// digits are equal] in dimension `a`, where [...] is 1 if true and 0 otherwise. psi_k is the
    /// same in dimension `b`.
    fn gain(a: usize, b: usize, m: u32) -> f64 {
        let count = 1u32 << m;
        let alike = |d: usize| {
            let first = digits(d, 0);
            // Point 0 is enough: the first 2^m points are a group under XOR, so that every point p
            // has the same numbers of digits in common with the points q.
            (0..count).map(move |i| (digits(d, i) ^ first).leading_zeros()).collect::<Vec<u32>>()
        };
        let (a, b) = (alike(a), alike(b));
        let psi = |same: u32, level: u32| {
            2.0 * f64::from(u8::from(same > level)) - f64::from(u8::from(same >= level))
        };
        let component =
            |j: u32, k: u32| a.iter().zip(&b).map(|(a, b)| psi(*a, j) * psi(*b, k)).sum::<f64>();
        let levels = (0..=m).flat_map(|j| (0..=m).map(move |k| (j, k)));
        levels.map(|(j, k)| component(j, k)).fold(0.0, f64::max)
    }

    /// Checks the table of the worst pairs of Sobol dimensions in docs/accuracy.md. The worst pairs
    /// are among dimensions 4 to 7. Without a lens, these four dimensions are used for the second
    /// sampled direction of a path and for the choices between reflection and transmission.
    #[test]
    fn worst_pairs_of_dimensions_are_the_documented_ones() {
        for (m, worst, first_lobes) in [
            (4, 8.0, 8.0),
            (5, 16.0, 8.0),
            (6, 32.0, 8.0),
            (7, 64.0, 8.0),
            (8, 16.0, 8.0),
            (9, 32.0, 16.0),
        ] {
            let pairs = |below: usize| (0..below).flat_map(move |b| (0..b).map(move |a| (a, b)));
            let largest = |below| pairs(below).map(|(a, b)| gain(a, b, m)).fold(0.0, f64::max);
            let found = (largest(DIMENSIONS), largest(6));
            assert_eq!(found, (worst, first_lobes), "2^{m} points");
        }
        assert_eq!((gain(5, 6, 6), gain(4, 7, 6)), (32.0, 16.0));
        // The dimensions of one pair are a (0, 2)-sequence, whose gain is at most 2 in base 2.
        assert!((0..4).all(|pair| gain(2 * pair, 2 * pair + 1, 6) <= 2.0));
    }

    /// Checks runs of sixteen successive points that begin at a multiple of 16. Point i of a run
    /// must be its first point XOR a constant that depends only on i. [`Sampler::block`] relies on
    /// this.
    #[test]
    fn aligned_points_are_one_point_and_constants() {
        for d in 0..DIMENSIONS {
            for i in [0u32, 16, 4096, 0xffff_fff0, 0x1234_5670] {
                for low in 0..16 {
                    assert_eq!(point(d, i | low), point(d, i) ^ point(d, low));
                }
            }
        }
    }
}
