//! The first eight dimensions of the Sobol sequence, 32-bit index.
//!
//! Direction numbers: Joe and Kuo 2008, *Constructing Sobol sequences with better two-dimensional
//! projections*, table new-joe-kuo-6. Values are stored with the first binary digit in bit 0, as the
//! scrambling hash wants them.

/// Dimensions of one joint set.
pub const DIMENSIONS: usize = 8;

/// Degree s, coefficients a, and initial numbers m of the primitive polynomial of a dimension.
struct Polynomial {
    s: usize,
    a: u32,
    m: [u32; 5],
}

const POLYNOMIALS: [Polynomial; DIMENSIONS - 1] = [
    Polynomial { s: 1, a: 0, m: [1, 0, 0, 0, 0] },
    Polynomial { s: 2, a: 1, m: [1, 3, 0, 0, 0] },
    Polynomial { s: 3, a: 1, m: [1, 3, 1, 0, 0] },
    Polynomial { s: 3, a: 2, m: [1, 1, 1, 0, 0] },
    Polynomial { s: 4, a: 1, m: [1, 1, 3, 3, 0] },
    Polynomial { s: 4, a: 4, m: [1, 3, 5, 13, 0] },
    Polynomial { s: 5, a: 2, m: [1, 1, 5, 5, 17] },
];

/// Direction numbers of a dimension, first digit in bit 31.
const fn directions(dimension: usize) -> [u32; 32] {
    let mut v = [0u32; 32];
    let mut i = 0;
    if dimension == 0 {
        while i < 32 {
            v[i] = 1 << (31 - i);
            i += 1;
        }
        return v;
    }
    let p = &POLYNOMIALS[dimension - 1];
    while i < 32 {
        if i < p.s {
            v[i] = p.m[i] << (31 - i);
        } else {
            let mut x = v[i - p.s] ^ (v[i - p.s] >> p.s);
            let mut k = 1;
            while k < p.s {
                if p.a >> (p.s - 1 - k) & 1 == 1 {
                    x ^= v[i - k];
                }
                k += 1;
            }
            v[i] = x;
        }
        i += 1;
    }
    v
}

type Tables = [[[u32; 256]; 4]; DIMENSIONS];

/// `TABLES[d][k][byte]`: what byte k of the index adds (XOR) to dimension d, digits reversed.
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
                tables[d][k][byte] =
                    tables[d][k][byte & (byte - 1)] ^ v[8 * k + low].reverse_bits();
                byte += 1;
            }
            k += 1;
        }
        d += 1;
    }
    tables
};

/// Point `index` of the sequence in `dimension` (below [`DIMENSIONS`]), first digit in bit 0.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Every dimension alone is a (0, m, 1)-net, and the first two together a (0, m, 2)-net: each
    /// elementary interval of volume 2^-m holds exactly one of the first 2^m points.
    #[test]
    fn elementary_intervals_hold_one_point_each() {
        let m = 10;
        for d in 0..DIMENSIONS {
            let mut seen = vec![0; 1 << m];
            for i in 0..1u32 << m {
                seen[(point(d, i).reverse_bits() >> (32 - m)) as usize] += 1;
            }
            assert!(seen.iter().all(|n| *n == 1), "dimension {d}");
        }
        for split in 0..=m {
            let mut seen = vec![0; 1 << m];
            for i in 0..1u32 << m {
                let x = u64::from(point(0, i).reverse_bits()) << split >> 32;
                let y = u64::from(point(1, i).reverse_bits()) << (m - split) >> 32;
                seen[((x << (m - split)) | y) as usize] += 1;
            }
            assert!(seen.iter().all(|n| *n == 1), "split {split}");
        }
    }

    /// The first points of the Sobol sequence as published with the direction numbers.
    #[test]
    fn first_points_are_the_published_ones() {
        let row = |i| [0, 1, 2].map(|d| f64::from(point(d, i).reverse_bits()) / 4_294_967_296.0);
        // Index order without Gray code: 0, 1, 2, 3 in radical-inverse order.
        assert_eq!(row(0), [0.0, 0.0, 0.0]);
        assert_eq!(row(1), [0.5, 0.5, 0.5]);
        assert_eq!(row(2), [0.25, 0.75, 0.75]);
        assert_eq!(row(3), [0.75, 0.25, 0.25]);
        assert_eq!(row(4), [0.125, 0.625, 0.375]);
    }

    /// Eight aligned points are one point XOR eight constants: what the packets rely on.
    #[test]
    fn aligned_points_are_one_point_and_constants() {
        for d in 0..DIMENSIONS {
            for i in [0u32, 8, 4096, 0xffff_fff8, 0x1234_5678] {
                for low in 0..8 {
                    assert_eq!(point(d, i | low), point(d, i) ^ point(d, low));
                }
            }
        }
    }
}
