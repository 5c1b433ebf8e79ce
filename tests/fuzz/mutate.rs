//! Mutations of files, similar to those that faulty writers, transfers and editors cause.

use crate::harness::*;

/// Generator of random mutations.
pub struct Random(Numbers);

/// Texts that replace numbers in a file.
const NUMBERS: &str = "0 -1 1 2 -0.0 nan inf -inf 1e400 1e-400 9999999999 4294967295 2147483648 \
     -9223372036854775808 18446744073709551615 0.5 . 1e ";

impl Random {
    /// Creates the generator with the given seed.
    pub fn new(seed: u64) -> Self {
        Self(Numbers::new(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15)))
    }

    /// Returns a random integer from 0 to `n` - 1; `n` must be greater than 0.
    pub fn below(&mut self, n: usize) -> usize {
        self.0.below(n)
    }

    /// Returns `bytes` after one to four mutations, which may insert pieces of `other`.
    pub fn mutated(&mut self, bytes: &[u8], other: &[u8]) -> Vec<u8> {
        let mut out = bytes.to_vec();
        for _ in 0..=self.below(4) {
            if out.is_empty() {
                break;
            }
            self.mutate(&mut out, other);
        }
        out
    }

    fn mutate(&mut self, out: &mut Vec<u8>, other: &[u8]) {
        let at = self.below(out.len());
        match self.below(10) {
            0 => out[at] ^= 1 << self.below(8),
            1 => out[at] = [0, 1, 0x7f, 0x80, 0xff, b'\n', b' ', b'"'][self.below(8)],
            2 => out[at] = self.0.bits() as u8,
            3 => out.truncate(at),
            4 => {
                let end = (at + 1 + self.below(16)).min(out.len());
                out.drain(at..end);
            }
            5 => {
                let end = (at + 1 + self.below(64)).min(out.len());
                let piece = out[at..end].to_vec();
                out.splice(at..at, piece);
            }
            6 => {
                let from = self.below(other.len());
                let piece = &other[from..(from + 1 + self.below(64)).min(other.len())];
                out.splice(at..at, piece.iter().copied());
            }
            7 => {
                // Four bytes become an extreme integer, or the bits of NaN or infinity.
                let value = [0, 1, -1, i32::MAX, i32::MIN, 0x7fc0_0000, 0x7f80_0000, 65_536];
                let value: i32 = value[self.below(8)];
                for (slot, byte) in out[at..].iter_mut().zip(value.to_le_bytes()) {
                    *slot = byte;
                }
            }
            _ => self.number(out, at),
        }
    }

    /// Replaces the first number after the position `at` of a text by one of [`NUMBERS`].
    fn number(&mut self, out: &mut Vec<u8>, at: usize) {
        let digit = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-');
        let Some(begin) = out[at..].iter().position(digit).map(|b| b + at) else { return };
        let length = out[begin..].iter().position(|b| !digit(b)).unwrap_or(out.len() - begin);
        let number = NUMBERS.split(' ').nth(self.below(NUMBERS.split(' ').count())).unwrap();
        out.splice(begin..begin + length, number.bytes());
    }
}
