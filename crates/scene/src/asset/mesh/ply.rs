//! PLY files: positions, normals, texture coordinates and polygons, in ASCII and in binary with
//! both byte orders.

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::file::FileContents;
use crate::asset::mesh::builder::Builder;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType,
    ScalarType,
};
use zerkalo_kernel::primitive::TriangleMesh;

/// Number of PLY elements that the parser library parses at a time. It limits the memory for parsed
/// elements.
const PIECE: usize = 4096;

/// Names of the eight PLY vertex properties that are read. Each property has a list of accepted
/// names, because different programs write different names.
const NUMBERS: [&[&str]; 8] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx"],
    &["ny"],
    &["nz"],
    &["u", "s", "texture_u"],
    &["v", "t", "texture_v"],
];

/// Names of the PLY list property that holds the vertex indices of a face.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// One vertex or face of a PLY file, filled by the parser library. `numbers` has the properties of
/// a vertex in the order of [`NUMBERS`]. `corners` has the vertex indices of a face.
struct Record {
    numbers: [f64; 8],
    corners: Vec<u32>,
}

impl PropertyAccess for Record {
    fn new() -> Self {
        Self { numbers: [0.0; 8], corners: Vec::new() }
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        let number = match value {
            Property::Float(x) => f64::from(x),
            Property::Double(x) => x,
            Property::Char(x) => f64::from(x),
            Property::UChar(x) => f64::from(x),
            Property::Short(x) => f64::from(x),
            Property::UShort(x) => f64::from(x),
            Property::Int(x) => f64::from(x),
            Property::UInt(x) => f64::from(x),
            list => return self.set_list(name, list),
        };
        match NUMBERS.iter().position(|names| names.contains(&name)) {
            Some(i) => {
                self.numbers[i] = number;
                PropertyAccessResult::Set
            }
            None => PropertyAccessResult::Ignored,
        }
    }
}

impl Record {
    fn set_list(&mut self, name: &str, list: Property) -> PropertyAccessResult {
        if !CORNERS.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        self.corners = match list {
            Property::ListUInt(list) => list,
            Property::ListInt(list) => indices(list),
            Property::ListShort(list) => indices(list),
            Property::ListChar(list) => indices(list),
            Property::ListUShort(list) => indices(list),
            Property::ListUChar(list) => indices(list),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// Converts `list` to vertex indices. Negative numbers become `u32::MAX`, an index that is out of
/// range in every mesh.
fn indices<T: TryInto<u32>>(list: Vec<T>) -> Vec<u32> {
    list.into_iter().map(|index| index.try_into().unwrap_or(u32::MAX)).collect()
}

/// Parses a PLY file.
pub fn parse(source: &FileContents) -> Result<TriangleMesh, AssetError> {
    let parser = Parser::<Record>::new();
    let mut reader = Reader::new(&source.bytes[..]);
    let header = parser.read_header(&mut reader).map_err(|e| library_error(source, &e, None))?;
    check_header(source, &header, reader.get_ref().len())?;
    let mut builder = Builder::new(source);
    for element in header.elements.values() {
        let has = |names: &[&str]| names.iter().any(|n| element.properties.contains_key(*n));
        let (normals, uvs) =
            (NUMBERS[3..6].iter().all(|n| has(n)), NUMBERS[6..].iter().all(|n| has(n)));
        match element.name.as_str() {
            "vertex" => builder.reserve(element.count, 0)?,
            "face" => builder.reserve(0, element.count)?,
            _ => {}
        }
        let mut piece = element.clone();
        let mut done = 0;
        while done < element.count {
            piece.count = PIECE.min(element.count - done);
            let records = parser.read_payload_for_element(&mut reader, &piece, &header);
            let records = records.map_err(|e| {
                let byte = source.bytes.len() - reader.get_ref().len();
                library_error(source, &e, (header.encoding != Encoding::Ascii).then_some(byte))
            })?;
            for (i, record) in records.iter().enumerate() {
                match element.name.as_str() {
                    "vertex" => {
                        let [x, y, z, ref others @ ..] = record.numbers;
                        let [nx, ny, nz, u, v] = others.map(|number| number as f32);
                        let normal = normals.then_some([nx, ny, nz]);
                        builder.vertex([x, y, z], normal, uvs.then_some([u, v]));
                    }
                    "face" => {
                        let place = || FileLocation::Part(format!("face {} (from 0)", done + i));
                        builder.polygon(&record.corners, place)?;
                    }
                    _ => {}
                }
            }
            done += piece.count;
        }
    }
    builder.finish()
}

/// Converts an error of the PLY parser library to an error with file and location. `byte` is the
/// offset of the error in a binary file; `None` for a text file.
fn library_error(source: &FileContents, error: &ParseError, byte: Option<usize>) -> AssetError {
    let place = match (byte, error.line()) {
        (Some(byte), _) => FileLocation::Byte(byte),
        (None, Some(line)) => FileLocation::Line(line),
        (None, None) => FileLocation::Whole,
    };
    let message = error.to_string();
    // The first line of the message states the error; the other lines repeat the input.
    let first = message.lines().next().unwrap_or_default();
    let first =
        first.split_once(": ").filter(|(l, _)| l.starts_with("Line ")).map_or(first, |p| p.1);
    source.error(place, first.trim_end_matches(['.', ':']), "a PLY file")
}

/// Checks that a PLY header declares the required elements and properties, and that `left`, the
/// number of bytes after the header, suffices for the declared elements.
fn check_header(source: &FileContents, header: &Header, left: usize) -> Result<(), AssetError> {
    let missing = |what: &str| Err(source.fault(format!("the header names no {what}"), "a mesh"));
    let Some(vertex) = header.elements.get("vertex") else { return missing("element vertex") };
    for names in &NUMBERS[..3] {
        if !vertex.properties.contains_key(names[0]) {
            return missing(&format!("property {} of vertices", names[0]));
        }
    }
    let Some(face) = header.elements.get("face") else { return missing("element face") };
    if !CORNERS.iter().any(|name| face.properties.contains_key(*name)) {
        return missing("list vertex_indices of faces");
    }
    let order = |name| header.elements.get_index_of(name);
    if order("face") < order("vertex") {
        return Err(source.fault("the faces precede the vertices", "vertices first"));
    }
    let mut least = 0u128;
    for element in header.elements.values() {
        let bytes = least_bytes(element, header.encoding);
        if bytes == 0 && element.count > 0 {
            let found = format!("the element {} has no properties", element.name);
            return Err(source.fault(found, "at least one"));
        }
        least += bytes as u128 * element.count as u128;
        if least > left as u128 + 1 {
            let found = format!(
                "the header declares {} times {}, more than the file holds",
                element.count, element.name
            );
            return Err(source.fault(found, "as many as there are"));
        }
    }
    Ok(())
}

/// Returns the smallest number of bytes that an element (vertex or face) takes in a PLY file with
/// the given encoding. In an ASCII file each property needs at least a digit and a separator.
fn least_bytes(element: &ElementDef, encoding: Encoding) -> usize {
    let size = |scalar: &ScalarType| match scalar {
        _ if encoding == Encoding::Ascii => 2,
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    };
    let least = |p: &PropertyType| match p {
        PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => size(scalar),
    };
    element.properties.values().map(|p| least(&p.data_type)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    fn read(bytes: &[u8]) -> Result<TriangleMesh, AssetError> {
        parse(&FileContents { path: PathBuf::from("a.ply"), bytes: bytes.to_vec() })
    }

    fn header(format: &str, vertices: &str, faces: &str) -> String {
        format!(
            "ply\nformat {format} 1.0\ncomment x\nelement vertex {vertices}\nproperty float x\n\
             property double y\nproperty float z\nproperty float s\nproperty float t\n\
             element face {faces}\nproperty list uchar int vertex_indices\nproperty uchar red\n\
             end_header\n"
        )
    }

    const TEXT: &str = "0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n4 0 1 2 3 255\n";

    #[test]
    fn ply_encodings_give_same_mesh() {
        let text = read((header("ascii", "4", "1") + TEXT).as_bytes()).unwrap();
        assert_eq!(text.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(text.uvs.as_ref().unwrap()[2], [1.0, 1.0]);
        for big in [false, true] {
            let format = if big { "binary_big_endian" } else { "binary_little_endian" };
            let mut bytes = header(format, "4", "1").into_bytes();
            let mut put = |mut b: Vec<u8>| {
                if big {
                    b.reverse();
                }
                bytes.extend(b);
            };
            for [x, y] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
                put(f32::to_le_bytes(x).to_vec());
                put(f64::to_le_bytes(f64::from(y)).to_vec());
                put(f32::to_le_bytes(0.0).to_vec());
                put(f32::to_le_bytes(x).to_vec());
                put(f32::to_le_bytes(y).to_vec());
            }
            put(vec![4]);
            (0..4).for_each(|i: i32| put(i.to_le_bytes().to_vec()));
            put(vec![255]);
            assert_eq!(read(&bytes).unwrap(), text, "{format}");
            bytes.truncate(bytes.len() - 3);
            let error = read(&bytes).unwrap_err();
            assert!(matches!(error.place, FileLocation::Byte(_)), "{error}");
        }
    }

    #[test]
    fn ply_errors_are_reported() {
        for (text, place, words) in [
            (
                header("ascii", "9999999999", "1") + TEXT,
                FileLocation::Whole,
                "9999999999 times vertex",
            ),
            (
                header("ascii", "4", "1") + &TEXT.replace("4 0 1 2 3", "4 0 1 2 4"),
                FileLocation::Part("face 0 (from 0)".into()),
                "vertex 4",
            ),
            (
                header("ascii", "4", "1") + &TEXT.replace("4 0 1 2 3", "4 0 1 2 -3"),
                FileLocation::Part("face 0 (from 0)".into()),
                "vertex 4294967295",
            ),
            (
                header("ascii", "4", "1") + &TEXT.replace("1 1 0 1 1", "1 x 0 1 1"),
                FileLocation::Line(16),
                "Couldn't",
            ),
            (header("ascii", "4", "0") + TEXT, FileLocation::Whole, "no triangles"),
            (
                header("ascii", "4", "1").replace("float z", "float w") + TEXT,
                FileLocation::Whole,
                "property z",
            ),
            (
                "ply\nformat ascii 1.0\nelement nothing 4000000000\nend_header\n".into(),
                FileLocation::Whole,
                "no element vertex",
            ),
            (
                header("ascii", "4", "1").replace("end_header", "element n 4000000000\nend_header")
                    + TEXT,
                FileLocation::Whole,
                "no properties",
            ),
            ("plx\n".into(), FileLocation::Line(1), "magic"),
        ] {
            let error = read(text.as_bytes()).unwrap_err();
            assert!(error.found.contains(words), "{error}");
            assert_eq!(error.place, place, "{error}");
        }
    }

    #[test]
    fn ply_far_from_origin_keeps_shape() {
        let text = TEXT
            .replace("1 1 0 1 1", "1 100000000.125 0 1 1")
            .replace("0 1 0 0 1", "0 100000001 0 0 1");
        let text = text
            .replace("0 0 0 0 0", "0 100000000 0 0 0")
            .replace("1 0 0 1 0", "1 100000000 0 1 0");
        let mesh = read((header("ascii", "4", "1") + &text).as_bytes()).unwrap();
        let y: Vec<f64> = mesh.positions.iter().map(|p| f64::from(p[1]) + mesh.center[1]).collect();
        assert_eq!(y, [1e8, 1e8, 1e8 + 0.125, 1e8 + 1.0]);
    }
}
