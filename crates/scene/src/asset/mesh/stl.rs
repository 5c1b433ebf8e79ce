//! STL files, ASCII and binary. Triangles in this format share no vertices. This module merges
//! vertices with equal positions, so that normals can be smooth. The normals in the file are
//! ignored, because they follow from the corners.

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::file::FileContents;
use crate::asset::mesh::builder::{Builder, Welder};
use std::io::{Cursor, Read, Seek, SeekFrom};
use zerkalo_kernel::primitive::TriangleMesh;

/// Number of bytes of the header of a binary STL file.
const HEADER: usize = 84;
/// Number of bytes of a triangle in a binary STL file.
const TRIANGLE: usize = 50;

/// Parses an STL file.
pub fn parse(mut source: FileContents) -> Result<TriangleMesh, AssetError> {
    let (text, announced) = normalise(&mut source)?;
    let mut builder = Builder::new(&source);
    builder.check_limits(0, announced)?;
    let mut welder = Welder::default();
    let mut reader = ByLine { cursor: Cursor::new(&source.bytes), line: 0, text };
    let wrong = |error: std::io::Error, place| {
        source.error(place, format!("the file cannot be read: {error}"), "an STL file")
    };
    let triangles = stl_io::create_stl_reader(&mut reader)
        .map_err(|error| wrong(error, FileLocation::Whole))?;
    let mut failure = None;
    for (n, triangle) in triangles.enumerate() {
        let triangle = match triangle {
            Ok(triangle) => triangle,
            Err(error) => {
                failure = Some((error, n));
                break;
            }
        };
        let place = || FileLocation::Part(format!("triangle {n} (from 0)"));
        let corners = triangle.vertices.map(|v| v.0);
        if corners.iter().flatten().any(|x| !x.is_finite()) {
            return Err(source.error(place(), "a corner is not finite", "finite coordinates"));
        }
        builder.check_limits(3, 1)?;
        let corners = corners.map(|c| welder.index(c, &mut builder));
        builder.triangle(corners, place)?;
    }
    if let Some((error, n)) = failure {
        let line = FileLocation::Line(reader.line);
        return Err(wrong(
            error,
            if text { line } else { FileLocation::Byte(HEADER + TRIANGLE * n) },
        ));
    }
    drop(welder);
    builder.finish()
}

/// Changes the beginning of the file so that `stl_io` takes text for text and binary for binary. Returns whether it
/// is a text file, and the number of triangles in the header of a binary one.
fn normalise(source: &mut FileContents) -> Result<(bool, usize), AssetError> {
    let bytes = &mut source.bytes;
    let announced = bytes.get(80..HEADER).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let fits = announced
        .is_some_and(|n| bytes.len() as u64 >= HEADER as u64 + TRIANGLE as u64 * u64::from(n));
    let exact = fits && announced.is_some_and(|n| bytes.len() == HEADER + TRIANGLE * n as usize);
    let zeros = bytes.iter().take(HEADER).any(|b| *b == 0);
    let text = bytes.starts_with(b"solid") && !exact && !zeros;
    if text {
        // The library requires a space after `solid`; the format does not.
        if bytes.get(5) != Some(&b' ') {
            bytes.insert(5, b' ');
        }
        return Ok((true, 0));
    }
    let Some(announced) = announced else {
        let found = format!("the file has {} bytes and does not begin with \"solid\"", bytes.len());
        return Err(source.fault(found, "an STL file"));
    };
    if !fits {
        let found = format!("the header declares {announced} triangles, more than the file holds");
        let expected = format!("at most {}", (bytes.len() - HEADER) / TRIANGLE);
        return Err(source.error(FileLocation::Byte(80), found, &expected));
    }
    // Some binary files start with `solid` like a text file. The first byte is overwritten, so that
    // the library does not read such a file as text.
    bytes[0] = b' ';
    Ok((false, announced as usize))
}

/// Reader of an STL file that counts lines. Each read of a text file returns at most one line.
struct ByLine<'a> {
    cursor: Cursor<&'a Vec<u8>>,
    line: usize,
    text: bool,
}

impl Read for ByLine<'_> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        if !self.text {
            return self.cursor.read(out);
        }
        let bytes = self.cursor.get_ref();
        let remaining = &bytes[(self.cursor.position() as usize).min(bytes.len())..];
        let end = remaining.iter().take(out.len()).position(|b| *b == b'\n').map(|e| e + 1);
        self.line += usize::from(end.is_some() || remaining.len() <= out.len());
        let n = end.unwrap_or(out.len().min(remaining.len()));
        self.cursor.read(&mut out[..n])
    }
}

impl Seek for ByLine<'_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.line = 0;
        self.cursor.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    fn read(bytes: &[u8]) -> Result<TriangleMesh, AssetError> {
        parse(FileContents { path: PathBuf::from("a.stl"), bytes: bytes.to_vec() })
    }

    const FACET: &str = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
                         endloop\nendfacet\n";

    fn binary(triangles: &[[f32; 12]], announced: u32) -> Vec<u8> {
        let mut bytes = b"solid though binary".to_vec();
        bytes.resize(80, 0);
        bytes.extend(announced.to_le_bytes());
        for t in triangles {
            t.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
            bytes.extend([0, 0]);
        }
        bytes
    }

    #[test]
    fn stl_encodings_give_same_mesh() {
        let other = FACET.replace("vertex 0 0 0", "vertex 1 1 0");
        let text = read(format!("solid\n{FACET}{other}endsolid\n").as_bytes()).unwrap();
        let bytes = binary(
            &[
                [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
                [0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 1.0, 0.0, -0.0, 0.0, 1.0, 0.0],
            ],
            2,
        );
        assert_eq!(read(&bytes).unwrap(), text);
        assert_eq!(text.positions.len(), 4);
    }

    #[test]
    fn stl_errors_are_reported() {
        let cut = FACET.replace("vertex 0 1 0", "vertex 0 x 0");
        let error = read(format!("solid a\n{FACET}{cut}").as_bytes()).unwrap_err();
        assert_eq!(error.place, FileLocation::Line(13), "{error}");
        let error = read(&binary(&[[0.0; 12]], 4_000_000_000)).unwrap_err();
        assert!(error.found.contains("4000000000 triangles"), "{error}");
        let error = read(&binary(&[[f32::NAN; 12]], 1)).unwrap_err();
        assert!(error.found.contains("not finite"), "{error}");
        assert!(read(b"solid").is_err() && read(b"").is_err() && read(&[0; 84]).is_err());
    }
}
