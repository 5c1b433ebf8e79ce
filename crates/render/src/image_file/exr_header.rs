//! Sorting of the attributes of an OpenEXR header, so that equal pictures have equal files. The
//! crate `exr` takes their order from a hash map; it differs between runs.
//!
//! Source: *OpenEXR File Layout*. A header is a list of attributes that ends with a zero byte. An
//! attribute consists of a name and a type (each ends with a zero byte), a size (i32,
//! little-endian), and `size` bytes of data.

/// Number of bytes of an OpenEXR file before the first attribute: magic number and version.
const PREAMBLE: usize = 8;

/// Returns the header at the start of `file`, an OpenEXR file, with its attributes sorted by name.
/// `None` if the header is incomplete.
pub(super) fn sorted_header(file: &[u8]) -> Option<Vec<u8>> {
    let (preamble, mut bytes) = file.split_at_checked(PREAMBLE)?;
    let mut attributes = Vec::new();
    while *bytes.first()? != 0 {
        let name = bytes.iter().position(|b| *b == 0)? + 1;
        let kind = bytes[name..].iter().position(|b| *b == 0)? + 1;
        let size = bytes.get(name + kind..)?.first_chunk()?;
        let end = name + kind + 4 + usize::try_from(i32::from_le_bytes(*size)).ok()?;
        attributes.push(bytes.get(..end)?);
        bytes = &bytes[end..];
    }
    attributes.sort_unstable();
    Some([preamble, &attributes.concat(), &[0]].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &[u8] = b"magicver\
        b\0int\0\x04\0\0\0abcd\
        a\0string\0\x03\0\0\0x\0y\
        \0rest";
    const SORTED: &[u8] = b"magicver\
        a\0string\0\x03\0\0\0x\0y\
        b\0int\0\x04\0\0\0abcd\
        \0";

    #[test]
    fn attributes_are_sorted() {
        assert_eq!(sorted_header(FILE).unwrap(), SORTED);
        for end in 0..SORTED.len() {
            assert_eq!(sorted_header(&FILE[..end]), None, "{end} bytes");
        }
    }
}
