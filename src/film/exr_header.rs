//! Puts the attributes of an OpenEXR header in order, so that equal pictures are equal files.
//!
//! The format leaves the order of attributes free, and the library that writes them takes that of a
//! hash map, which is another in every run. OpenEXR File Layout: a header is a list of attributes,
//! each a name and a type (both end in a zero byte), a size (i32, little-endian) and so many bytes,
//! and ends in a zero byte.

use std::io::{self, Seek, SeekFrom, Write};

/// Bytes before the first attribute: magic number and version.
const PREAMBLE: usize = 8;

/// Holds back what is written until the header is complete, and then passes it on with the attributes
/// in the order of their names.
pub(super) struct Ordered<W: Write + Seek> {
    sink: W,
    /// The bytes held back; `None` once they are passed on.
    held: Option<Vec<u8>>,
}

impl<W: Write + Seek> Ordered<W> {
    /// A file's beginning is to be written to `sink`.
    pub fn new(sink: W) -> Self {
        Self { sink, held: Some(Vec::new()) }
    }
}

impl<W: Write + Seek> Write for Ordered<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let Some(held) = &mut self.held else { return self.sink.write(bytes) };
        held.extend_from_slice(bytes);
        if let Some((mut attributes, rest)) = held.get(PREAMBLE..).and_then(attributes) {
            attributes.sort_unstable();
            self.sink.write_all(&[&held[..PREAMBLE], &attributes.concat(), rest].concat())?;
            self.held = None;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        // The header is only passed on as a whole.
        if self.held.is_none() { self.sink.flush() } else { Ok(()) }
    }
}

impl<W: Write + Seek> Seek for Ordered<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        if self.held.is_some() {
            return Err(io::Error::other("a seek before the end of an OpenEXR header"));
        }
        self.sink.seek(to)
    }
}

/// Splits a header into its attributes and what follows them.
fn attributes(mut bytes: &[u8]) -> Option<(Vec<&[u8]>, &[u8])> {
    let mut found = Vec::new();
    while *bytes.first()? != 0 {
        let name = bytes.iter().position(|b| *b == 0)? + 1;
        let kind = bytes[name..].iter().position(|b| *b == 0)? + 1;
        let size = bytes.get(name + kind..)?.first_chunk()?;
        let end = name + kind + 4 + usize::try_from(i32::from_le_bytes(*size)).ok()?;
        found.push(bytes.get(..end)?);
        bytes = &bytes[end..];
    }
    Some((found, bytes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    const HEAD: &[u8] = b"magicver\
        b\0int\0\x04\0\0\0abcd\
        a\0string\0\x03\0\0\0x\0y\
        \0rest";
    const ORDERED: &[u8] = b"magicver\
        a\0string\0\x03\0\0\0x\0y\
        b\0int\0\x04\0\0\0abcd\
        \0rest";

    #[test]
    fn attributes_are_put_in_order_and_the_rest_follows() {
        for piece in 1..HEAD.len() {
            let mut file = Ordered::new(Cursor::new(Vec::new()));
            for bytes in HEAD.chunks(piece) {
                file.write_all(bytes).unwrap();
            }
            assert_eq!(file.sink.get_ref(), ORDERED, "in pieces of {piece}");
            file.seek(SeekFrom::Start(HEAD.len() as u64 - 4)).unwrap();
            file.write_all(b"back").unwrap();
            assert_eq!(&file.sink.into_inner()[HEAD.len() - 4..], b"back");
        }
    }

    #[test]
    fn only_the_header_is_held_back() {
        let mut file = Ordered::new(Cursor::new(Vec::new()));
        let (header, rest) = HEAD.split_at(HEAD.len() - 5);
        file.write_all(header).unwrap();
        assert!(file.sink.get_ref().is_empty());
        assert!(file.seek(SeekFrom::Start(0)).is_err());
        file.write_all(&rest[..1]).unwrap();
        assert_eq!(file.sink.get_ref().len(), header.len() + 1);
    }
}
