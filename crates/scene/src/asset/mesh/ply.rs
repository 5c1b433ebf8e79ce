//! PLY files, ASCII, little-endian or big-endian: positions, normals, texture coordinates, polygons
//! and triangle strips. Other elements and properties are skipped, whatever their values.

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::file::FileContents;
use crate::asset::mesh::builder::Builder;
use crate::asset::mesh::strip;
use crate::asset::text::{Lines, number, shown, take_word, words};
use zerkalo_kernel::primitive::TriangleMesh;

/// Names of the properties that are read, several where programs write different ones. The last two
/// are lists: vertices of a face or strip, and texture coordinates of the corners of a face.
const PROPERTIES: [&[&[u8]]; 10] = [
    &[b"x"],
    &[b"y"],
    &[b"z"],
    &[b"nx"],
    &[b"ny"],
    &[b"nz"],
    &[b"u", b"s", b"texture_u"],
    &[b"v", b"t", b"texture_v"],
    &[b"vertex_indices", b"vertex_index"],
    &[b"texcoord"],
];
/// Indices in [`PROPERTIES`] of the lists.
const CORNERS: usize = 8;
const UVS: usize = 9;

/// Values of one vertex, face or strip, in the order of [`PROPERTIES`]. A list is empty if the file
/// lacks the property.
type Record = [Vec<f64>; PROPERTIES.len()];

/// Type of a number: `i`, `u` or `f` for signed, unsigned and floating-point, and the size in bytes.
type Scalar = (u8, usize);

/// Property of an element. A list begins with its length.
struct Property {
    /// Index in [`PROPERTIES`]; `None` if the property is not read.
    index: Option<usize>,
    /// Type of the length of a list; `None` for a single value.
    length: Option<Scalar>,
    scalar: Scalar,
}

/// Element that the header declares: `count` records with the same properties.
struct Element<'a> {
    name: &'a [u8],
    count: usize,
    properties: Vec<Property>,
}

impl Element<'_> {
    fn has(&self, index: usize) -> bool {
        self.properties.iter().any(|p| p.index == Some(index))
    }

    fn is_vertex(&self) -> bool {
        self.name == b"vertex"
    }

    fn is_strip(&self) -> bool {
        self.name == b"tristrips"
    }

    fn has_corners(&self) -> bool {
        (self.is_strip() || self.name == b"face") && self.has(CORNERS)
    }
}

/// Parses a PLY file.
pub fn parse(source: &FileContents) -> Result<TriangleMesh, AssetError> {
    let mut builder = Builder::new(source);
    let (begin, elements) = header(source, &mut builder)?;
    let vertices = begin.check_elements(&elements)?;
    let faces = elements.iter().filter(|e| e.has_corners()).map(|e| e.count).sum();
    builder.reserve(elements[vertices].count, faces)?;
    // Faces may precede the vertices that they name.
    let mut reader = begin.clone();
    for element in &elements[..=vertices] {
        reader.read(element, |_, record| {
            if element.is_vertex() {
                add_vertex(&mut builder, record);
            }
            Ok(())
        })?;
    }
    let mut reader = begin;
    for element in &elements {
        reader.read(element, |n, record| match element.has_corners() {
            true => add_face(&mut builder, element, n, record),
            false => Ok(()),
        })?;
    }
    builder.finish()
}

fn add_vertex(builder: &mut Builder, record: &Record) {
    let [x, y, z, nx, ny, nz, u, v] = std::array::from_fn(|i| record[i].first().copied());
    let position = [x, y, z].map(|x| x.unwrap_or(f64::NAN));
    let single = |x: Option<f64>| x.map(|x| x as f32);
    let normal = || Some([single(nx)?, single(ny)?, single(nz)?]);
    builder.vertex(position, normal(), single(u).zip(single(v)).map(|(u, v)| [u, v]));
}

/// Adds the triangles of record `n` of `element`, a polygon or one or more strips.
fn add_face(
    builder: &mut Builder,
    element: &Element,
    n: usize,
    record: &Record,
) -> Result<(), AssetError> {
    let place = || FileLocation::Part(format!("{} {n} (from 0)", shown(element.name)));
    // In strips, -1 ends a strip and begins the next one.
    for indices in record[CORNERS].split(|i| element.is_strip() && *i < 0.0) {
        let corners = indices.iter().map(|index| builder.index(*index, 0, place));
        let mut corners = corners.collect::<Result<Vec<u32>, _>>()?;
        if !element.is_strip() {
            for (corner, uv) in corners.iter_mut().zip(record[UVS].as_chunks().0) {
                *corner = builder.with_uv(*corner, uv.map(|x| x as f32))?;
            }
            builder.polygon(&corners)?;
            continue;
        }
        for i in 2..corners.len() {
            let [a, b, c] = strip(i - 2).map(|i| corners[i]);
            // Strips repeat corners to continue elsewhere.
            if a != b && b != c && c != a {
                builder.triangle([a, b, c])?;
            }
        }
    }
    Ok(())
}

/// Parses the header. Returns a reader of the bytes after it, and the elements up to the last one
/// that is read.
fn header<'a>(
    source: &'a FileContents,
    builder: &mut Builder,
) -> Result<(Reader<'a>, Vec<Element<'a>>), AssetError> {
    let mut lines = Lines::new(&source.bytes);
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        let Some((line, text)) = lines.next() else {
            return Err(source.fault("the header does not end", "a line end_header"));
        };
        let words: Vec<_> = words(text).take(6).collect();
        let mut add = || {
            match words[..] {
                [b"ply"] if line == 1 => {}
                _ if line == 1 => return None,
                [b"format", b"ascii", ..] => encoding = Some(Encoding::Ascii),
                [b"format", b"binary_little_endian", ..] => encoding = Some(Encoding::LittleEndian),
                [b"format", b"binary_big_endian", ..] => encoding = Some(Encoding::BigEndian),
                [b"element", name, count] => {
                    let count = std::str::from_utf8(count).ok()?.parse().ok()?;
                    elements.push(Element { name, count, properties: Vec::new() });
                }
                [b"property", ref rest @ ..] => {
                    let (property, name) = property(rest)?;
                    elements.last_mut()?.properties.push(property);
                    if [b"red" as &[u8], b"r", b"diffuse_red"].contains(&name) {
                        builder.note("the colours of vertices or faces were not read");
                    }
                }
                [b"comment", b"TextureFile", ..] => builder.note("a texture was not read"),
                [] | [b"comment" | b"obj_info" | b"end_header", ..] => {}
                _ => return None,
            }
            Some(())
        };
        add().ok_or_else(|| {
            let found = format!("the header has the line \"{}\"", shown(text));
            source.error(FileLocation::Line(line), found, "a line of the PLY format")
        })?;
        if words.first() == Some(&&b"end_header"[..]) {
            break;
        }
    }
    let is_read = |e: &Element| e.is_vertex() || e.has_corners();
    elements.truncate(elements.iter().rposition(is_read).map_or(0, |last| last + 1));
    let encoding = encoding.ok_or_else(|| source.fault("the header names no format", "ascii"))?;
    // Where lines end with CR, the next byte is the first one of the elements, even if it is LF.
    let (header, mut rest) = source.bytes.split_at(source.bytes.len() - lines.rest.len());
    if header.ends_with(b"\r\n") && !header[..header.len() - 1].contains(&b'\n') {
        rest = &source.bytes[header.len() - 1..];
    }
    Ok((Reader { source, encoding, rest }, elements))
}

/// Parses the words after `property`, and returns the property with its name; `None` if they are
/// wrong.
fn property<'a>(words: &[&'a [u8]]) -> Option<(Property, &'a [u8])> {
    let (length, words) = match words {
        [b"list", length, rest @ ..] => (Some(scalar(length)?), rest),
        all => (None, all),
    };
    let [kind, name, ..] = words else { return None };
    let index = PROPERTIES.iter().position(|names| names.contains(name));
    let index = index.filter(|index| length.is_some() == (*index >= CORNERS));
    Some((Property { index, length, scalar: scalar(kind)? }, name))
}

fn scalar(name: &[u8]) -> Option<Scalar> {
    Some(match name {
        b"char" | b"int8" => (b'i', 1),
        b"uchar" | b"uint8" => (b'u', 1),
        b"short" | b"int16" => (b'i', 2),
        b"ushort" | b"uint16" => (b'u', 2),
        b"int" | b"int32" => (b'i', 4),
        b"uint" | b"uint32" => (b'u', 4),
        b"long" | b"int64" => (b'i', 8),
        b"ulong" | b"uint64" => (b'u', 8),
        b"float" | b"float32" => (b'f', 4),
        b"double" | b"float64" => (b'f', 8),
        _ => return None,
    })
}

/// Encoding of the elements.
#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Reader of the elements after the header.
#[derive(Clone)]
struct Reader<'a> {
    source: &'a FileContents,
    encoding: Encoding,
    /// Bytes that were not read.
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    /// Checks that the header declares the required elements and properties, and that the file is
    /// long enough for the declared elements. Returns the index of the element `vertex`.
    fn check_elements(&self, elements: &[Element]) -> Result<usize, AssetError> {
        let missing =
            |what: &str| Err(self.source.fault(format!("the header names no {what}"), "a mesh"));
        let Some(vertices) = elements.iter().position(Element::is_vertex) else {
            return missing("element vertex");
        };
        if let Some(i) = (0..3).find(|i| !elements[vertices].has(*i)) {
            return missing(&format!("property {} of vertices", ["x", "y", "z"][i]));
        }
        if !elements.iter().any(Element::has_corners) {
            return missing("element face or tristrips with a list vertex_indices");
        }
        let mut least = 0u128;
        for Element { name, count, properties } in elements {
            // In an ASCII file each property needs at least a digit and a separator.
            let bytes = |p: &Property| match self.encoding {
                Encoding::Ascii => 2,
                Encoding::LittleEndian | Encoding::BigEndian => p.length.unwrap_or(p.scalar).1,
            };
            least += properties.iter().map(bytes).sum::<usize>() as u128 * *count as u128;
            if least > self.rest.len() as u128 + 1 {
                let found = format!("the header declares {count} times {}", shown(name));
                let found = found + ", more than the file holds";
                return Err(self.source.fault(found, "as many as there are"));
            }
        }
        Ok(vertices)
    }

    /// Reads all records of `element`, and passes each with its number to `add`. In an ASCII file
    /// each record begins on a new line; words after its last value are ignored.
    fn read(
        &mut self,
        element: &Element,
        mut add: impl FnMut(usize, &Record) -> Result<(), AssetError>,
    ) -> Result<(), AssetError> {
        let mut record = Record::default();
        // A record without properties takes no bytes.
        let count = if element.properties.is_empty() { 0 } else { element.count };
        for n in 0..count {
            record.iter_mut().for_each(Vec::clear);
            for Property { index, length, scalar } in &element.properties {
                let length = length.map_or(Ok(1), |length| self.length(length))?;
                for _ in 0..length {
                    // Values that are not read may be any words.
                    match index {
                        Some(index) => record[*index].push(self.value(*scalar)?),
                        None => drop(self.bytes(scalar.1)?),
                    }
                }
            }
            if self.encoding == Encoding::Ascii {
                let mut lines = Lines::new(self.rest);
                lines.next();
                self.rest = lines.rest;
            }
            add(n, &record)?;
        }
        Ok(())
    }

    fn error(&self, found: impl Into<String>, expected: &str) -> AssetError {
        let place = match self.encoding {
            Encoding::Ascii => self.source.line_of(self.rest),
            Encoding::LittleEndian | Encoding::BigEndian => {
                FileLocation::Byte(self.source.bytes.len() - self.rest.len())
            }
        };
        self.source.error(place, found, expected)
    }

    /// Reads the length of a list, and checks that the file is long enough for it.
    fn length(&mut self, scalar: Scalar) -> Result<usize, AssetError> {
        let length = self.value(scalar)?;
        (0.0..=self.rest.len() as f64).contains(&length).then_some(length as usize).ok_or_else(
            || {
                let found = format!("a list has {length} values, more than the file holds");
                self.error(found, "as many as there are")
            },
        )
    }

    /// Reads a number.
    fn value(&mut self, (kind, size): Scalar) -> Result<f64, AssetError> {
        let bytes = self.bytes(size)?;
        let append = |bits: u64, byte: &u8| bits << 8 | u64::from(*byte);
        let bits = match self.encoding {
            Encoding::Ascii => {
                let found = || format!("\"{}\" is not a number", shown(bytes));
                return number(bytes).ok_or_else(|| self.error(found(), "a number"));
            }
            Encoding::LittleEndian => bytes.iter().rev().fold(0, append),
            Encoding::BigEndian => bytes.iter().fold(0, append),
        };
        let unused = 64 - 8 * size;
        Ok(match (kind, size) {
            (b'f', 4) => f64::from(f32::from_bits(bits as u32)),
            (b'f', _) => f64::from_bits(bits),
            (b'i', _) => ((bits << unused) as i64 >> unused) as f64,
            _ => bits as f64,
        })
    }

    /// Returns the bytes of the next value: `size` bytes, in an ASCII file a word.
    fn bytes(&mut self, size: usize) -> Result<&'a [u8], AssetError> {
        let bytes = match self.encoding {
            Encoding::Ascii => take_word(&mut self.rest),
            Encoding::LittleEndian | Encoding::BigEndian => self.rest.split_off(..size),
        };
        bytes.ok_or_else(|| self.error("the file ends in an element", "a whole file"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    fn read(bytes: &[u8]) -> Result<TriangleMesh, AssetError> {
        parse(&FileContents { path: PathBuf::from("a.ply"), bytes: bytes.to_vec() })
    }

    const HEADER: &str = "ply\nformat ascii 1.0\ncomment x\nelement vertex 4\nproperty float x\n\
                          property double y\nproperty float z\nproperty float s\nproperty float t\n\
                          element face 1\nproperty list uchar int vertex_indices\n\
                          property uchar red\nend_header\n";
    const BODY: &str = "0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n4 0 1 2 3 255\n";

    #[test]
    fn ply_encodings_give_same_mesh() {
        let text = read(&[HEADER, BODY].concat().into_bytes()).unwrap();
        assert_eq!(text.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(text.uvs.as_ref().unwrap()[2], [1.0, 1.0]);
        for big in [false, true] {
            let format = if big { "binary_big_endian" } else { "binary_little_endian" };
            let mut bytes = HEADER.replace("ascii", format).into_bytes();
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
        let changed = |old: &str, new: &str| {
            assert!(HEADER.contains(old) || BODY.contains(old), "{old}");
            [HEADER, BODY].concat().replace(old, new)
        };
        let no_vertex = "ply\nformat ascii 1.0\nelement nothing 4000000000\nend_header\n";
        for (text, message) in [
            (changed("vertex 4", "vertex 9999999999"), ": the header declares 9999999999 times v"),
            (changed("0 1 2 3", "0 1 2 4"), ", face 0 (from 0): the face names vertex 4,"),
            (changed("0 1 2 3", "0 1 2 -3"), ", face 0 (from 0): the face names vertex -3"),
            (changed("1 1 0 1 1", "1 x 0 1 1"), ":16: \"x\" is not a number"),
            (changed("4 0 1", "400 0 1"), ":18: a list has 400 values"),
            (changed(" 255\n", ""), ":18: the file ends"),
            (changed("face 1", "face 0"), ": the mesh has no triangles"),
            (changed("float z", "float w"), ": the header names no property z"),
            (no_vertex.into(), ": the header names no element vertex"),
            ("plx\n".into(), ":1: the header has the line \"plx\""),
            ("ply\nformat ascii 1.0\n".into(), ": the header does not end"),
            ("ply\nformat text 1.0\n".into(), ":2: the header has the line \"format text 1.0\""),
            ("ply\nproperty int x\n".into(), ":2: the header has the line \"property int x\""),
        ] {
            let error = read(text.as_bytes()).unwrap_err().to_string();
            assert!(error.starts_with(&format!("a.ply{message}")), "{error}");
        }
    }

    const SQUARE: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                          property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
                          end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

    /// ASCII files as programs write them: changes of a square that keep its shape.
    #[test]
    fn ply_texts_of_programs_are_read() {
        let with = |property: &str, value: &str| {
            let text = SQUARE.replacen("element face", &format!("{property}\nelement face"), 1);
            text.replace(" 0\n", &format!(" 0 {value}\n"))
        };
        let (head, body) = SQUARE.split_once("0 0 0").unwrap();
        let tabs = format!("{head}\t0 \t0 0{}", body.replace(' ', "\t "));
        let faces = "element face 1\nproperty list uchar int vertex_indices\n";
        let faces_first = SQUARE.replace(faces, "").replace("\n4 0 1 2 3", "");
        let faces = faces.replace("uchar int vertex_indices", "int uint64 vertex_index");
        let faces_first = faces_first.replace("element vertex", &(faces + "element vertex"));
        let strip = |corners: &str| {
            let text = SQUARE.replace("face 1", "tristrips 1").replace("uchar int", "int int");
            text.replace("4 0 1 2 3", corners)
        };
        let camera = "element camera 1\nproperty float f\nelement vertex";
        let edges = "element edge 5\nproperty int a\nend_header";
        let normals = "property float nx\nproperty float ny\nproperty float nz";
        let long = "property int64 id\nproperty uint64 key";
        for (name, text) in [
            ("as it should be", SQUARE.to_string()),
            ("byte order mark", format!("\u{feff}{SQUARE}")),
            ("CRLF", SQUARE.replace('\n', "\r\n")),
            ("CR", SQUARE.replace('\n', "\r")),
            ("blank lines", SQUARE.replace("end_", "\n \nend_").replace("0\n", "0\n\n \t\n")),
            ("tabs and indents", tabs),
            ("a record on several lines", SQUARE.replace("1 1 0", "1\n1\n0")),
            ("words after a record", SQUARE.replace("1 1 0", "1 1 0 7 x")),
            ("numbers of C", SQUARE.replace("\n1 1 0", "\n1. +1e0 -.0").replace("4 0", "4.0 0.")),
            ("NaN in normals", with(normals, "nan -nan(ind) 1.#IND")),
            ("infinity", with("property float quality", "-inf")),
            ("no number", with("property float quality", "none")),
            ("a name with a number sign", with("property float scalar_#2", "1")),
            ("a name with brackets", with("property float scalar_(m)", "1")),
            ("a name with blanks", with("property float scalar field (m)", "1")),
            ("a name that is not ASCII", with("property float \u{f6}", "1")),
            ("a float for an integer", with("property uchar alpha", "255.0")),
            ("64 bits", with(long, "-9223372036854775808 18446744073709551615")),
            ("an unread list", with("property list uchar float weights", "2 0.5 x")),
            ("an empty list", with("property list uchar float weights", "0")),
            ("float64", SQUARE.replace("float", "float64").replace("uchar int", "uint8 int16")),
            ("NaN in texture coordinates", with("property float s\nproperty float t", "nan inf")),
            ("faces first", faces_first.replace("r\n0 0 0", "r\n4 0 1 2 3\n0 0 0")),
            (
                "an element before",
                SQUARE.replace("element vertex", camera).replace("r\n0", "r\n35\n0"),
            ),
            ("a faulty element after", SQUARE.replace("end_header", edges)),
            ("no properties", SQUARE.replace("element face", "element x 4000000000\nelement face")),
            ("a strip", strip("6 0 1 3 2 2 2")),
            ("two strips", strip("7 0 1 2 -1 0 2 3")),
        ] {
            let mesh = read(text.as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(mesh.triangles.len(), 2, "{name}");
            let normal = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|i| glam::Vec3::from(mesh.positions[i as usize]));
                (b - a).cross(c - a).to_array()
            };
            assert!(mesh.triangles.iter().all(|t| normal(t) == [0.0, 0.0, 1.0]), "{name}");
            assert_eq!(mesh.bounds, [[0.0; 3], [1.0, 1.0, 0.0]], "{name}");
        }
        let mut latin = SQUARE.as_bytes().to_vec();
        latin.splice(4..4, *b"comment Gr\xF6\xDFe\nobj_info \xFF\n");
        assert_eq!(read(&latin).unwrap().triangles.len(), 2);
    }

    #[test]
    fn ply_binary_types_are_read() {
        const TYPES: [(&str, usize); 8] = [
            ("char", 1),
            ("uint8", 1),
            ("short", 2),
            ("ushort", 2),
            ("int32", 4),
            ("uint", 4),
            ("int64", 8),
            ("uint64", 8),
        ];
        let integers = TYPES.iter().flat_map(|(name, size)| {
            ["\n", "\r\n", "\r"].map(|end| (*name, *size, end, name.contains('u')))
        });
        for (name, size, end, is_unsigned) in integers {
            for format in ["binary_little_endian", "binary_big_endian"] {
                let head = SQUARE.split_once("end_header").unwrap().0.replace("ascii", format);
                let head =
                    head.replace("float", name).replace("uchar int", &format!("{name} {name}"));
                let mut bytes = format!("{head}end_header\n").replace('\n', end).into_bytes();
                // The first byte of the data looks like the end of a line.
                let least = if is_unsigned { 10 } else { -3 };
                let far = if size == 1 { 10 } else { 0x0A0A };
                let corners = [[far, 10, 10], [far, least, 0], [100, 100, 100], [0, 100, 0]];
                for x in corners.into_iter().flatten().chain([4, 0, 1, 2, 3]) {
                    let number = i64::from(x).to_le_bytes();
                    let mut number = number[..size].to_vec();
                    if format.contains("big") {
                        number.reverse();
                    }
                    bytes.extend(number);
                }
                let mesh = read(&bytes).unwrap_or_else(|e| panic!("{name} {format} {end:?}: {e}"));
                let expected = corners.map(|p| p.map(|x| x as f32));
                assert_eq!(mesh.positions, expected, "{name} {format} {end:?}");
            }
        }
    }

    #[test]
    fn ply_texture_coordinates_of_corners_are_kept() {
        let text = SQUARE.replace("end_header", "property list uchar float texcoord\nend_header");
        let text = text.replace("face 1", "face 3");
        let faces = "4 0 1 2 3 8 0 0 1 0 1 1 0 1\n3 1 2 3 6 0 0 0.5 0 1 1\n3 1 3 0 0\n";
        let mesh = read(text.replace("4 0 1 2 3\n", faces).as_bytes()).unwrap();
        let uvs = mesh.uvs.unwrap();
        let of = |t: &[u32; 3]| t.map(|i| uvs[i as usize]);
        let found: Vec<_> = mesh.triangles.iter().map(of).collect();
        assert_eq!(found[0], [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
        assert_eq!(found[1], [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert_eq!(found[2], [[0.0, 0.0], [0.5, 0.0], [1.0, 1.0]]);
        assert_eq!(found[3], [[0.0; 2]; 3]);
    }

    #[test]
    fn ply_notes_say_what_was_left_out() {
        let color = "property uchar red\nelement face";
        let texture = "comment TextureFile a.png\nelement vertex";
        for (old, new, note) in [
            ("element face", color, "the colours of vertices or faces were not read"),
            ("element vertex", texture, "a texture was not read"),
        ] {
            let text = SQUARE.replace(old, new).replace(" 0\n", " 0 0\n");
            assert_eq!(read(text.as_bytes()).unwrap().notes, [note]);
        }
    }

    #[test]
    fn ply_far_from_origin_keeps_shape() {
        let body =
            "0 1e8 0 0 0\n1 1e8 0 1 0\n1 100000000.125 0 1 1\n0 100000001 0 0 1\n4 0 1 2 3 255\n";
        let mesh = read(&[HEADER, body].concat().into_bytes()).unwrap();
        let y: Vec<f64> = mesh.positions.iter().map(|p| f64::from(p[1]) + mesh.center[1]).collect();
        assert_eq!(y, [1e8, 1e8, 1e8 + 0.125, 1e8 + 1.0]);
    }
}
