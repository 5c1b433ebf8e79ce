//! Morton codes: positions on a space-filling curve.

/// Number of bits of each coordinate in a Morton code.
const BITS: u32 = 20;

/// Returns the Morton code of a point in the unit cube. Coordinates are rounded down to 20 bits.
/// Bit k of x, y and z is bit 3k, 3k + 1 and 3k + 2 of the code. A coordinate that is NaN counts as
/// 0.
pub fn morton_code(point: [f64; 3]) -> u64 {
    let [x, y, z] = point.map(|x| spread((x * f64::from((1u32 << BITS) - 1)) as u64));
    x | y << 1 | z << 2
}

/// Moves bit k of `x` to bit 3k.
fn spread(x: u64) -> u64 {
    let step = |x: u64, shift: u32, mask: u64| (x | x << shift) & mask;
    let x = step(x, 32, 0x001f_0000_0000_ffff);
    let x = step(x, 16, 0x001f_0000_ff00_00ff);
    let x = step(x, 8, 0x100f_00f0_0f00_f00f);
    let x = step(x, 4, 0x10c3_0c30_c30c_30c3);
    step(x, 2, 0x1249_2492_4924_9249)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn morton_code_interleaves_bits() {
        let mut state = 1u64;
        for _ in 0..1000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let x = state >> (64 - BITS);
            let expected = (0..BITS).map(|k| (x >> k & 1) << (3 * k)).sum::<u64>();
            assert_eq!(spread(x), expected, "{x}");
        }
        assert_eq!(morton_code([1.0, 0.0, f64::NAN]), spread((1 << BITS) - 1));
        assert_eq!(morton_code([1.0; 3]), (1 << (3 * BITS)) - 1);
    }
}
