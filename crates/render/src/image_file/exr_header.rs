//! Sorting of the attributes of an OpenEXR header, so that equal pictures have equal files.
//!
//! The order of the crate `exr` comes from a hash map and differs between runs. Source: *OpenEXR
//! File Layout*. A header is a list of attributes that ends with a zero byte. An attribute consists
//! of a name and a type (each ends with a zero byte), a size (i32, little-endian), and `size` bytes
//! of data.

use std::io::{self, Cursor, Seek, SeekFrom, Write};

/// Number of bytes of an OpenEXR file before the first attribute: magic number and version.
const PREAMBLE: usize = 8;

/// Writer that sorts the attributes of an OpenEXR header by name and passes on all further bytes.
pub(super) struct Ordered<W: Write + Seek> {
    sink: W,
    /// Bytes of the header, until it is complete.
    buffer: Option<Vec<u8>>,
    /// Number of bytes of the header; 0 until it is complete.
    header_len: usize,
}

impl<W: Write + Seek> Ordered<W> {
    /// Creates a writer of an OpenEXR file that starts at the current position of `sink`.
    pub fn new(sink: W) -> Self {
        Self { sink, buffer: Some(Vec::new()), header_len: 0 }
    }
}

impl Ordered<Cursor<Vec<u8>>> {
    /// Returns the sorted header, or nothing if it is not complete.
    pub fn into_header(self) -> Vec<u8> {
        let mut bytes = self.sink.into_inner();
        bytes.truncate(self.header_len);
        bytes
    }
}

impl<W: Write + Seek> Write for Ordered<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let Some(buffer) = &mut self.buffer else { return self.sink.write(bytes) };
        buffer.extend_from_slice(bytes);
        if let Some(mut attributes) = buffer.get(PREAMBLE..).and_then(attributes) {
            attributes.sort_unstable();
            let sorted = attributes.concat();
            self.header_len = PREAMBLE + sorted.len() + 1;
            buffer[PREAMBLE..self.header_len - 1].copy_from_slice(&sorted);
            self.sink.write_all(buffer)?;
            self.buffer = None;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.buffer.is_none() { self.sink.flush() } else { Ok(()) }
    }
}

impl<W: Write + Seek> Seek for Ordered<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        if self.buffer.is_some() {
            return Err(io::Error::other("a seek before the end of an OpenEXR header"));
        }
        self.sink.seek(to)
    }
}

/// Returns the attributes in `bytes`, an OpenEXR header without its first [`PREAMBLE`] bytes. `None`
/// if the header is incomplete.
fn attributes(mut bytes: &[u8]) -> Option<Vec<&[u8]>> {
    let mut found = Vec::new();
    while *bytes.first()? != 0 {
        let name = bytes.iter().position(|b| *b == 0)? + 1;
        let kind = bytes[name..].iter().position(|b| *b == 0)? + 1;
        let size = bytes.get(name + kind..)?.first_chunk()?;
        let end = name + kind + 4 + usize::try_from(i32::from_le_bytes(*size)).ok()?;
        found.push(bytes.get(..end)?);
        bytes = &bytes[end..];
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &[u8] = b"magicver\
        b\0int\0\x04\0\0\0abcd\
        a\0string\0\x03\0\0\0x\0y\
        \0rest";
    const ORDERED: &[u8] = b"magicver\
        a\0string\0\x03\0\0\0x\0y\
        b\0int\0\x04\0\0\0abcd\
        \0rest";

    #[test]
    fn attributes_are_sorted_and_other_bytes_follow() {
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
    fn only_the_header_is_buffered() {
        let mut file = Ordered::new(Cursor::new(Vec::new()));
        let (header, rest) = HEAD.split_at(HEAD.len() - 5);
        file.write_all(header).unwrap();
        assert!(file.sink.get_ref().is_empty());
        assert!(file.seek(SeekFrom::Start(0)).is_err());
        file.write_all(&rest[..1]).unwrap();
        assert_eq!(file.sink.get_ref().len(), header.len() + 1);
    }
}
