//! STL files: binary, or ASCII with any number of solids. Each triangle states its corners; corners
//! at one position become one vertex. The normals in the file are ignored, because they follow from
//! the corners. Colours, which some programs write into the attributes of binary files, are not
//! read.

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::file::FileContents;
use crate::asset::mesh::builder::Builder;
use crate::asset::text::{Lines, numbers, take_word, words};
use std::collections::HashMap;
use zerkalo_kernel::primitive::TriangleMesh;

/// Number of bytes of the header of a binary STL file.
const HEADER: usize = 84;
/// Number of bytes of a triangle in a binary STL file.
const TRIANGLE: usize = 50;
/// Number of bytes at the beginning in which a binary file has a zero.
const SAMPLE: usize = 512;

/// Parses an STL file.
pub fn parse(source: &FileContents) -> Result<TriangleMesh, AssetError> {
    let mut parser = Parser { source, builder: Builder::new(source), vertices: HashMap::new() };
    let bytes = &source.bytes;
    let text = Lines::new(bytes).rest;
    let begins_as_text = words(text).next().is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    // Some binary files begin with `solid` like a text file.
    let has_zeros = bytes.iter().take(SAMPLE).any(|byte| *byte == 0);
    let has_binary_size = declared(bytes)
        .is_some_and(|count| HEADER as u64 + TRIANGLE as u64 * count == bytes.len() as u64);
    match begins_as_text && !has_zeros && !has_binary_size {
        true => parser.parse_text(text)?,
        false => parser.parse_binary()?,
    }
    parser.builder.finish()
}

/// Returns the number of triangles that the header of a binary file declares.
fn declared(bytes: &[u8]) -> Option<u64> {
    Some(u32::from_le_bytes(*bytes.get(80..)?.first_chunk()?).into())
}

struct Parser<'a> {
    source: &'a FileContents,
    builder: Builder<'a>,
    /// Index in the mesh of each vertex, by the bits of its coordinates.
    vertices: HashMap<[u32; 3], u32>,
}

impl Parser<'_> {
    /// Adds the triangles of an ASCII file. Words may be in any case and on any line, and `end` may
    /// be a word of its own.
    fn parse_text(&mut self, mut text: &[u8]) -> Result<(), AssetError> {
        let source = self.source;
        let mut corners: Vec<[f32; 3]> = Vec::new();
        while let Some(word) = take_word(&mut text) {
            let after = text;
            let wrong =
                |found| source.error(source.line_of(after), found, "a line of the STL format");
            match word.to_ascii_lowercase().as_slice() {
                b"vertex" => {
                    let words = std::iter::from_fn(|| take_word(&mut text));
                    let corner = numbers(words).map(|corner| corner.map(|x| x as f32));
                    let corner = corner.filter(is_finite);
                    let found = "this vertex is not three finite numbers";
                    corners.push(corner.ok_or_else(|| wrong(found))?);
                }
                b"endfacet" | b"facet" if !corners.is_empty() => {
                    let Ok(triangle) = std::mem::take(&mut corners).try_into() else {
                        return Err(wrong("this facet does not have three corners"));
                    };
                    self.add(triangle)?;
                }
                b"normal" => {
                    for _ in 0..3 {
                        take_word(&mut text);
                    }
                }
                // A name may have the word `facet`, but no `normal` after it.
                b"solid" | b"endsolid" => {
                    let (_, name) = Lines::new(text).next().unwrap_or_default();
                    let is_facet = |words: &[u8]| words.eq_ignore_ascii_case(b"facet normal");
                    let length = name.windows(12).position(is_facet).unwrap_or(name.len());
                    text = &text[length..];
                }
                b"facet" | b"outer" | b"loop" | b"endloop" | b"endfacet" | b"end" => {}
                _ => return Err(wrong("this line cannot be read")),
            }
        }
        match corners.is_empty() {
            true => Ok(()),
            false => Err(source.fault("the file ends in a facet", "a whole file")),
        }
    }

    /// Adds the triangles of a binary file.
    fn parse_binary(&mut self) -> Result<(), AssetError> {
        let bytes = &self.source.bytes;
        let Some(declared) = declared(bytes) else {
            let found =
                format!("the file has {} bytes and does not begin with \"solid\"", bytes.len());
            return Err(self.source.fault(found, "an STL file"));
        };
        let triangles = bytes[HEADER..].chunks_exact(TRIANGLE);
        if declared > triangles.len() as u64 {
            let found =
                format!("the header declares {declared} triangles, more than the file holds");
            let expected = format!("at most {}", triangles.len());
            return Err(self.source.error(FileLocation::Byte(80), found, &expected));
        }
        for (n, bytes) in triangles.take(declared as usize).enumerate() {
            // VisCAM marks a colour by the highest bit of the attribute.
            if bytes[49] & 0x80 != 0 {
                self.builder.note("a colour of a triangle was not read");
            }
            // The first three numbers are the normal.
            let numbers = bytes[12..48].as_chunks().0.iter().map(|b| f32::from_le_bytes(*b));
            let numbers: Vec<f32> = numbers.collect();
            let corners = [0, 3, 6].map(|i| [numbers[i], numbers[i + 1], numbers[i + 2]]);
            if !corners.iter().all(is_finite) {
                let place = FileLocation::Part(format!("triangle {n} (from 0)"));
                return Err(self.source.error(place, "a corner is not finite", "finite numbers"));
            }
            self.add(corners)?;
        }
        Ok(())
    }

    /// Adds a triangle. A corner becomes the vertex with its position, or a new vertex.
    fn add(&mut self, corners: [[f32; 3]; 3]) -> Result<(), AssetError> {
        let corners = corners.map(|position| {
            // +0 and -0 are the same position.
            let key = position.map(|x| if x == 0.0 { 0 } else { x.to_bits() });
            let vertex = || self.builder.vertex(position.map(f64::from), None, None);
            *self.vertices.entry(key).or_insert_with(vertex)
        });
        self.builder.triangle(corners)
    }
}

fn is_finite(corner: &[f32; 3]) -> bool {
    corner.iter().all(|x| x.is_finite())
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

    /// ASCII files as programs write them, each with one triangle per solid.
    #[test]
    fn stl_texts_of_programs_are_read() {
        let whole = format!("solid a\n{FACET}endsolid a\n");
        let other = whole.replace("vertex 0 1 0", "vertex 0 2 0");
        let [line, other_line] = [&whole, &other].map(|text| text.replace('\n', " "));
        for (name, text, triangles) in [
            ("as it should be", whole.clone(), 1),
            ("two solids", format!("{whole}{other}"), 2),
            ("an empty solid before", format!("solid e\nendsolid e\n{whole}"), 1),
            ("upper case", whole.to_uppercase(), 1),
            ("mixed case", whole.replace("facet", "Facet").replace("outer", "OuTer"), 1),
            ("space before", format!("\n \t{whole}"), 1),
            ("byte order mark", format!("\u{feff}{whole}"), 1),
            ("no name", whole.replace(" a\n", "\n"), 1),
            ("a name like words", whole.replace("solid a", "solid vertex facet end 1"), 1),
            ("no endsolid", format!("solid a\n{FACET}"), 1),
            ("two words", whole.replace("end", "end "), 1),
            ("no endfacet", whole.replace("endfacet\n", "") + &FACET.replace("0 1 0", "0 2 0"), 2),
            ("CRLF", whole.replace('\n', "\r\n"), 1),
            ("CR", whole.replace('\n', "\r"), 1),
            ("one line", line.clone(), 1),
            ("one line for two", format!("{line}{other_line}"), 2),
            (
                "a facet in a line",
                whole.replace("\nouter", " outer").replace("\nvertex", " vertex"),
                1,
            ),
            ("NaN in a normal", whole.replace("0 0 1", "nan -nan(ind) 1.#IND"), 1),
            ("indents", whole.replace('\n', "\n\t  "), 1),
            ("numbers of C", whole.replace("1 0 0", "+1. .0E+00 -0e-3"), 1),
        ] {
            let mesh = read(text.as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(mesh.triangles.len(), triangles, "{name}");
            assert_eq!(mesh.positions[1], [1.0, 0.0, 0.0], "{name}");
        }
        let mut latin = whole.into_bytes();
        latin.splice(6..7, *b"K\xF6rper");
        assert_eq!(read(&latin).unwrap().triangles.len(), 1);
    }

    #[test]
    fn stl_colors_are_noted() {
        let facet = |y| [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, y, 0.0];
        let mut bytes = binary(&[facet(1.0), facet(2.0)], 2);
        assert_eq!(read(&bytes).unwrap().notes, [] as [String; 0]);
        bytes[133] = 0xFC;
        assert_eq!(read(&bytes).unwrap().notes, ["a colour of a triangle was not read"]);
    }

    #[test]
    fn stl_errors_are_reported() {
        let cut = FACET.replace("vertex 0 1 0", "vertex 0 x 0");
        let error = read(format!("solid a\n{FACET}{cut}").as_bytes()).unwrap_err();
        assert_eq!(error.place, FileLocation::Line(13), "{error}");
        let error = read(&binary(&[[0.0; 12]], 4_000_000_000)).unwrap_err();
        assert!(error.found.contains("4000000000 triangles"), "{error}");
        let error = read(&binary(&[[f32::NAN; 12]], 1)).unwrap_err();
        assert!(
            error.to_string().starts_with("a.stl, triangle 0 (from 0): a corner is not finite")
        );
        assert!(read(b"solid").is_err() && read(b"").is_err() && read(&[0; 84]).is_err());
    }
}
