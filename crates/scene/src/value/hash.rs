//! 64-bit FNV-1a hash, which is stable across platforms and versions.

/// Incremental 64-bit FNV-1a hash (draft-eastlake-fnv).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fnv1a64(u64);

impl Default for Fnv1a64 {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv1a64 {
    /// Adds `bytes` to the hashed data.
    pub fn update(&mut self, bytes: &[u8]) {
        const PRIME: u64 = 0x0000_0100_0000_01b3;
        self.0 = bytes.iter().fold(self.0, |h, byte| (h ^ u64::from(*byte)).wrapping_mul(PRIME));
    }

    /// Returns the hash of all bytes added so far.
    pub fn value(self) -> u64 {
        self.0
    }
}

/// Returns the 64-bit FNV-1a hash of `bytes`, see [`Fnv1a64`].
pub fn fnv1a64(bytes: &[u8]) -> u64 {
    let mut hash = Fnv1a64::default();
    hash.update(bytes);
    hash.value()
}

#[cfg(test)]
mod tests {
    use super::fnv1a64;

    /// Checks the hashes of the test vectors in the FNV draft (draft-eastlake-fnv).
    #[test]
    fn fnv1a64_matches_reference_values() {
        assert_eq!(fnv1a64(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a64(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(fnv1a64(b"foobar"), 0x8594_4171_f739_67e8);
    }
}
