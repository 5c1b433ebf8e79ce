//! STL files, ASCII and binary. Triangles in this format share no vertices. This module merges
//! vertices with equal positions, so that normals can be smooth. The normals in the file are
//! ignored, because they follow from the corners.

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::file::FileContents;
use crate::asset::mesh::builder::Builder;
use std::collections::HashMap;
use zerkalo_kernel::primitive::TriangleMesh;

/// Number of bytes of the header of a binary STL file.
const HEADER: usize = 84;
/// Number of bytes of a triangle in a binary STL file.
const TRIANGLE: usize = 50;

/// Parses an STL file.
pub fn parse(source: &FileContents) -> Result<TriangleMesh, AssetError> {
    let mut parser = Parser { source, builder: Builder::new(source), known: HashMap::new() };
    let announced =
        source.bytes.get(80..HEADER).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let size = announced.map(|count| HEADER as u64 + TRIANGLE as u64 * u64::from(count));
    let length = source.bytes.len() as u64;
    // Some binary files begin with `solid` like a text file.
    let has_zeros = source.bytes.iter().take(HEADER).any(|byte| *byte == 0);
    if source.bytes.starts_with(b"solid") && size != Some(length) && !has_zeros {
        parser.parse_text()?;
        return parser.builder.finish();
    }
    let (Some(announced), Some(size)) = (announced, size) else {
        let found = format!("the file has {length} bytes and does not begin with \"solid\"");
        return Err(source.fault(found, "an STL file"));
    };
    if size > length {
        let found = format!("the header declares {announced} triangles, more than the file holds");
        let expected = format!("at most {}", (source.bytes.len() - HEADER) / TRIANGLE);
        return Err(source.error(FileLocation::Byte(80), found, &expected));
    }
    parser.parse_binary(announced as usize)?;
    parser.builder.finish()
}

struct Parser<'a> {
    source: &'a FileContents,
    builder: Builder<'a>,
    /// Index in the mesh of each vertex, by the bits of its coordinates.
    known: HashMap<[u32; 3], u32>,
}

impl Parser<'_> {
    /// Adds the triangles of an ASCII file. Normals and names are ignored.
    fn parse_text(&mut self) -> Result<(), AssetError> {
        let mut corners: Vec<[f32; 3]> = Vec::new();
        for (line, number) in self.source.bytes.split(|byte| *byte == b'\n').zip(1..) {
            let line = String::from_utf8_lossy(line);
            let mut words = line.split_whitespace();
            let wrong = |found: &str| {
                self.source.error(FileLocation::Line(number), found, "a line of the STL format")
            };
            match words.next() {
                Some("vertex") => {
                    let numbers = words.map(|word| word.parse().ok()).collect::<Option<Vec<_>>>();
                    let corner = numbers.and_then(|numbers| numbers.try_into().ok());
                    let wrong = || wrong("this vertex is not three numbers");
                    corners.push(corner.ok_or_else(wrong)?);
                }
                Some("endfacet") => {
                    let Ok(triangle) = std::mem::take(&mut corners).try_into() else {
                        return Err(wrong("this facet does not have three corners"));
                    };
                    self.add(triangle, || FileLocation::Line(number))?;
                }
                Some("solid" | "facet" | "outer" | "endloop" | "endsolid") | None => {}
                Some(_) => return Err(wrong("this line cannot be read")),
            }
        }
        match corners.is_empty() {
            true => Ok(()),
            false => Err(self.source.fault("the file ends in a facet", "a whole file")),
        }
    }

    fn parse_binary(&mut self, count: usize) -> Result<(), AssetError> {
        self.builder.check_limits(0, count)?;
        let triangles = self.source.bytes[HEADER..].chunks_exact(TRIANGLE).take(count);
        for (n, bytes) in triangles.enumerate() {
            // The first three numbers are the normal.
            let numbers = bytes[12..48].as_chunks().0.iter().map(|b| f32::from_le_bytes(*b));
            let numbers: Vec<f32> = numbers.collect();
            let corners = [0, 3, 6].map(|i| [numbers[i], numbers[i + 1], numbers[i + 2]]);
            self.add(corners, || FileLocation::Part(format!("triangle {n} (from 0)")))?;
        }
        Ok(())
    }

    /// Adds a triangle. A corner becomes the vertex with its position, or a new vertex.
    fn add(
        &mut self,
        corners: [[f32; 3]; 3],
        place: impl Fn() -> FileLocation,
    ) -> Result<(), AssetError> {
        if corners.iter().flatten().any(|x| !x.is_finite()) {
            return Err(self.source.error(place(), "a corner is not finite", "finite coordinates"));
        }
        self.builder.check_limits(3, 1)?;
        let corners = corners.map(|position| {
            // +0 and -0 are the same position.
            let key = position.map(|x| if x == 0.0 { 0 } else { x.to_bits() });
            let vertex = || self.builder.vertex(position.map(f64::from), None, None);
            *self.known.entry(key).or_insert_with(vertex)
        });
        self.builder.triangle(corners, place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    fn read(bytes: &[u8]) -> Result<TriangleMesh, AssetError> {
        parse(&FileContents { path: PathBuf::from("a.stl"), bytes: bytes.to_vec() })
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
