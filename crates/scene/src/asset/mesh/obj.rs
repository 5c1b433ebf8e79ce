//! Wavefront OBJ files with the diffuse colours of their MTL files (material libraries). Points,
//! lines, free-form surfaces, textures and the colours of vertices are not read.

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::file::FileContents;
use crate::asset::mesh::builder::{Builder, MAX_COORDINATE};
use crate::asset::text::{Lines, numbers, shown, take_word, words};
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use zerkalo_kernel::primitive::TriangleMesh;

/// Largest size of an MTL file in bytes: 16 MiB.
const MAX_MTL_BYTES: u64 = 16 << 20;

/// Largest number of MTL files that are read for one OBJ file. Further MTL files are ignored.
const MAX_MTL_FILES: usize = 64;

/// Linear colour of triangles without a diffuse colour, in an OBJ file with materials.
const UNCOLORED: [f32; 3] = [1.0; 3];

/// Parses an OBJ file.
pub fn parse(source: &FileContents) -> Result<TriangleMesh, AssetError> {
    let mut parser = Parser {
        source,
        line: 0,
        builder: Builder::new(source),
        positions: Vec::new(),
        uvs: Vec::new(),
        normals: Vec::new(),
        vertices: HashMap::new(),
        libraries: HashSet::new(),
        colors: HashMap::new(),
        color: UNCOLORED,
        has_unknown_material: false,
    };
    for (line, text) in LogicalLines(Lines::new(&source.bytes)) {
        parser.line = line;
        parser.parse_line(&text)?;
    }
    if parser.has_unknown_material && !parser.colors.is_empty() {
        parser.builder.note("a material that no library before it defines is white");
    }
    parser.builder.finish()
}

/// Indices of the position, the texture coordinates and the normal of a vertex.
type Corner = (usize, Option<usize>, Option<usize>);

/// Parser of one OBJ file, with what it has read so far.
struct Parser<'a> {
    source: &'a FileContents,
    /// Number of the present line, counted from 1.
    line: usize,
    builder: Builder<'a>,
    positions: Vec<[f64; 3]>,
    uvs: Vec<[f64; 2]>,
    normals: Vec<[f64; 3]>,
    /// Index in the mesh of each vertex.
    vertices: HashMap<Corner, u32>,
    /// MTL files that have been read.
    libraries: HashSet<PathBuf>,
    /// Diffuse colours of the materials, by name.
    colors: HashMap<Vec<u8>, [f32; 3]>,
    /// Colour of the present material.
    color: [f32; 3],
    has_unknown_material: bool,
}

/// Lines of a text, each with the number of its first line in the file. A line that ends with `\`
/// continues on the next one; a comment does not, because it may end with a path of Windows.
struct LogicalLines<'a>(Lines<'a>);

impl<'a> Iterator for LogicalLines<'a> {
    type Item = (usize, Cow<'a, [u8]>);

    fn next(&mut self) -> Option<Self::Item> {
        let (number, line) = self.0.next()?;
        let is_comment = line.trim_ascii_start().starts_with(b"#");
        let mut line = Cow::Borrowed(line);
        while !is_comment && let Some(start) = line.trim_ascii_end().strip_suffix(b"\\") {
            let length = start.len();
            let joined = line.to_mut();
            joined.truncate(length);
            joined.push(b' ');
            joined.extend(self.0.next().unwrap_or_default().1);
        }
        Some((number, line))
    }
}

impl Parser<'_> {
    /// Parses a line and adds its content. Lines with unknown keywords are ignored.
    fn parse_line(&mut self, mut line: &[u8]) -> Result<(), AssetError> {
        let keyword = take_word(&mut line).unwrap_or_default();
        let rest = line.trim_ascii();
        let values = without_comment(rest);
        match keyword {
            b"v" => {
                let position: Option<[f64; 3]> = numbers(words(values));
                let position = position.ok_or_else(|| self.wrong("vertex is not three numbers"))?;
                // A fourth number is a weight, which only free-form surfaces use.
                if words(values).count() > 4 {
                    self.builder.note("a colour of a vertex was not read");
                }
                if !position.iter().all(|x| x.abs() <= MAX_COORDINATE) {
                    let [x, y, z] = position;
                    let found = format!("a vertex lies at [{x}, {y}, {z}]");
                    return Err(self.error(found, "coordinates from -1e9 to 1e9"));
                }
                self.positions.push(position);
            }
            b"vt" => {
                // The second coordinate is 0 where it is not stated.
                let uv = numbers(words(values).chain([&b"0"[..]]));
                self.uvs.push(uv.ok_or_else(|| self.wrong("texture coordinate is not numbers"))?);
            }
            b"vn" => {
                let normal = numbers(words(values));
                self.normals.push(normal.ok_or_else(|| self.wrong("normal is not three numbers"))?);
            }
            b"f" | b"fo" => self.add_face(values)?,
            b"l" | b"p" => self.builder.note("points and lines were left out"),
            b"curv" | b"surf" => self.builder.note("curves and free-form surfaces were left out"),
            b"usemtl" => {
                let color = [rest, values].into_iter().find_map(|name| self.colors.get(name));
                self.has_unknown_material |= color.is_none() && !values.is_empty();
                self.color = *color.unwrap_or(&UNCOLORED);
            }
            b"mtllib" => self.read_libraries(rest),
            _ => {}
        }
        Ok(())
    }

    fn error(&self, found: String, expected: &str) -> AssetError {
        self.source.error(FileLocation::Line(self.line), found, expected)
    }

    fn wrong(&self, found: &str) -> AssetError {
        self.error(format!("this {found}"), "a line of the OBJ format")
    }

    /// Adds a polygon. Each word names a corner by one to three indices: `1`, `1/2`, `1//3` or
    /// `1/2/3`.
    fn add_face(&mut self, values: &[u8]) -> Result<(), AssetError> {
        if !self.colors.is_empty() {
            self.builder.color(self.color)?;
        }
        let mut corners = Vec::new();
        for word in words(values) {
            let mut indices = word.split(|byte| *byte == b'/');
            let mut next = |what, count| self.index(indices.next().unwrap_or(b""), what, count);
            let position = next("vertex", self.positions.len())?;
            let uv = next("texture coordinate", self.uvs.len())?;
            let normal = next("normal", self.normals.len())?;
            let position = position.ok_or_else(|| self.wrong("face is not a list of indices"))?;
            corners.push(self.vertex((position, uv, normal))?);
        }
        self.builder.polygon(&corners)
    }

    /// Parses the index of one of the `count` entries of the kind `what` so far: from 1, or from -1
    /// backwards. Returns the index from 0. Returns `None` if `word` is empty, or if there are no
    /// texture coordinates or normals to which it could refer.
    fn index(&self, word: &[u8], what: &str, count: usize) -> Result<Option<usize>, AssetError> {
        if word.is_empty() || count == 0 && what != "vertex" {
            return Ok(None);
        }
        let index = std::str::from_utf8(word).ok().and_then(|word| word.parse::<i64>().ok());
        let index = index.ok_or_else(|| self.wrong("face is not a list of indices"))?;
        let from_0 = if index > 0 { index - 1 } else { index.saturating_add(count as i64) };
        let found = usize::try_from(from_0).ok().filter(|i| *i < count);
        found.map(Some).ok_or_else(|| {
            let expected = format!("a {what} above: 1 to {count}, or -{count} to -1 backwards");
            self.error(format!("the face names {what} {index}"), &expected)
        })
    }

    /// Returns the index of the vertex `corner` in the mesh. Adds the vertex if it is new.
    fn vertex(&mut self, corner: Corner) -> Result<u32, AssetError> {
        self.builder.reserve(1, 0)?;
        self.builder.allocated(self.vertices.try_reserve(1))?;
        Ok(*self.vertices.entry(corner).or_insert_with(|| {
            let (position, uv, normal) = corner;
            let normal = normal.map(|i| self.normals[i].map(|x| x as f32));
            let uv = uv.map(|i| self.uvs[i].map(|x| x as f32));
            self.builder.vertex(self.positions[position], normal, uv)
        }))
    }

    /// Reads the MTL files that `names` states: one file whose name may have blanks, or several.
    fn read_libraries(&mut self, names: &[u8]) {
        let names = names.strip_prefix(b"\"").unwrap_or(names);
        let names = names.strip_suffix(b"\"").unwrap_or(names);
        let path = |name: &[u8]| self.source.resolve_relative(&String::from_utf8_lossy(name));
        let is_file = |name: &[u8]| path(name).is_some_and(|path| path.is_file());
        let several: Vec<_> = words(names).take(MAX_MTL_FILES).collect();
        let is_one = is_file(names) || !several.iter().any(|name| is_file(name));
        let names = if is_one { vec![names] } else { several };
        for name in names {
            match path(name) {
                _ if name.is_empty() => {}
                Some(path) if self.libraries.len() < MAX_MTL_FILES => self.read_library(path),
                Some(_) => {}
                None => {
                    let note =
                        format!("no colours: \"{}\" is not in the mesh's folder", shown(name));
                    self.builder.note(note);
                }
            }
        }
    }

    /// Reads the diffuse colours (`Kd`) of the MTL file at `path`, unless it has been read.
    fn read_library(&mut self, path: PathBuf) {
        if !self.libraries.insert(path.clone()) {
            return;
        }
        let library = match FileContents::read(&path, MAX_MTL_BYTES) {
            Ok(library) => library,
            Err(error) => return self.builder.note(format!("no colours: {}", error.what())),
        };
        let mut before_first = UNCOLORED;
        let mut present = &mut before_first;
        for (_, line) in LogicalLines(Lines::new(&library.bytes)) {
            let mut values = &line[..];
            match take_word(&mut values).unwrap_or_default() {
                b"newmtl" => {
                    present = self.colors.entry(values.trim_ascii().to_vec()).or_default();
                    *present = UNCOLORED;
                }
                b"Kd" => {
                    let grey = || numbers(words(values)).map(|[grey]| [grey; 3]);
                    let color: Option<[f64; 3]> = numbers(words(values)).or_else(grey);
                    match color.filter(|c| c.iter().all(|x| (0.0..=1e6).contains(x))) {
                        Some(color) => *present = color.map(|x| x as f32),
                        None => self.builder.note("a colour of a material cannot be read"),
                    }
                }
                b"map_Kd" => self.builder.note("a texture of a material was not read"),
                _ => {}
            }
        }
    }
}

/// Returns the text before a comment, which begins with `#` at the beginning or after a blank.
fn without_comment(text: &[u8]) -> &[u8] {
    let is_comment = |i: &usize| text[*i] == b'#' && (*i == 0 || text[i - 1].is_ascii_whitespace());
    text[..(0..text.len()).find(is_comment).unwrap_or(text.len())].trim_ascii_end()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<TriangleMesh, AssetError> {
        parse(&FileContents {
            path: PathBuf::from("/nowhere/a.obj"),
            bytes: text.as_bytes().to_vec(),
        })
    }

    #[test]
    fn obj_polygons_become_triangles_and_lines_are_ignored() {
        let text = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\r\nv 1 1 0\nv 0 1 0 1.0\nvt 0 0\nvt 1 1\n\
                    l 1 2\nf 1/1 2/1 3/2 -1/2\n";
        let mesh = read(text).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.positions[2], [1.0, 1.0, 0.0]);
        assert_eq!(mesh.uvs.unwrap()[3], [1.0, 1.0]);
        assert_eq!(mesh.bounds, [[0.0; 3], [1.0, 1.0, 0.0]]);
    }

    #[test]
    fn obj_errors_have_line_numbers() {
        let v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        for (text, line, words) in [
            ("f 1 2 4\n", 4, "vertex 4"),
            ("f 1 2 0\n", 4, "vertex 0"),
            ("f -4 1 2\n", 4, "vertex -4"),
            ("f 1 2 9223372036854775807\n", 4, "vertex 9223372036854775807"),
            ("vt 0 0\nf 1/-9223372036854775807 2/1 3/1\n", 5, "texture coordinate"),
            ("f 1 2 x\n", 4, "not a list"),
            ("v 1 2\nf 1 2 3\n", 4, "three numbers"),
            ("v 1 nan 3\nf 1 2 3 4\n", 4, "NaN"),
            ("v 1 1e300 3\nf 1 2 3 4\n", 4, "a vertex lies at"),
        ] {
            let error = read(&format!("{v}{text}")).unwrap_err();
            assert_eq!(error.place, FileLocation::Line(line), "{text} {error}");
            assert!(error.found.contains(words), "{text} {error}");
        }
        for (text, words) in
            [("", "no triangles"), ("f 1 2 2\n", "has an area"), ("l 1 2 3\np 1\n", "no triangles")]
        {
            let error = read(&format!("{v}{text}")).unwrap_err();
            assert!(error.found.contains(words), "{text} {error}");
        }
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    /// Files with words and blanks as programs write them. Each has one square.
    #[test]
    fn obj_texts_of_programs_are_read() {
        let whole = format!("{SQUARE}f 1 2 3 4\n");
        for (name, text) in [
            ("byte order mark", format!("\u{feff}{whole}")),
            ("CRLF", whole.replace('\n', "\r\n")),
            ("CR", whole.replace('\n', "\r")),
            ("tabs", whole.replace(' ', "\t")),
            ("indents and blanks at the end", whole.replace('\n', "  \n \t")),
            ("a continued face", whole.replace("2 3", "2 \\\n  3")),
            ("a continued face without blanks", whole.replace("2 3", "2\\\n3")),
            ("a continued face, CRLF", whole.replace("2 3", "2\\\r\n3")),
            ("a face continued twice", whole.replace("2 3", "\\\n2 \\ \n3")),
            ("a continued vertex", whole.replace("v 0 0 0", "v 0 \\\n0 0")),
            ("a path in a comment", format!("# C:\\scenes\\\n{whole}")),
            ("comments", whole.replace('\n', " # 1 2 3\n")),
            ("comment without a blank", whole.replace('\n', " #1\n")),
            ("no material name", format!("usemtl\nusemtl \nmtllib\nmtllib \"\"\no\ng\n{whole}")),
            ("an empty face", format!("{whole}f\nf \n")),
            ("faces without surface", format!("{whole}f 1 2\nf 3\n")),
            ("the old keyword of a face", whole.replace("f ", "fo ")),
            ("lines", format!("{whole}l 1 2 3 4\np 1\ncurv 0 1 1 2\n")),
            ("one texture coordinate", format!("vt 0.5\n{SQUARE}f 1/1 2/1 3/1 4/1\n")),
            ("three texture coordinates", format!("vt 0 0 0\n{SQUARE}f 1/1 2/ 3// 4/1/\n")),
            ("NaN in coordinates", format!("vt nan -nan(ind)\n{SQUARE}f 1/1 2/1 3/1 4/1\n")),
            ("NaN in a normal", format!("vn -1.#IND 0 nan\n{SQUARE}f 1//1 2//1 3//1 4//1\n")),
            ("numbers of C", whole.replace("v 1 1 0", "v 1. +1E0 -.0")),
            ("an index from the end", whole.replace("1 2 3 4", "-4 2 -2 -1")),
        ] {
            let mesh = read(&text).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(mesh.triangles.len(), 2, "{name}");
            assert_eq!(mesh.bounds, [[0.0; 3], [1.0, 1.0, 0.0]], "{name}");
            assert_eq!(mesh.positions[0], [0.0; 3], "{name}");
        }
        // The last file has the time of its length, not of its square.
        let long = whole.replace("2 3", &format!("2 {}3", "\\\n".repeat(200_000)));
        assert_eq!(read(&long).unwrap().triangles.len(), 2);
    }

    #[test]
    fn obj_notes_say_what_was_left_out() {
        for (text, note) in [
            ("mtllib x.mtl\n", "no colours: /nowhere/x.mtl: there is no such file"),
            ("mtllib ../x.mtl\n", "no colours: \"../x.mtl\" is not in the mesh's folder"),
            ("f 1 2\nf 1\n", "a face of fewer than three corners was left out (2 times)"),
            ("f 1 1 2\n", "a triangle without area was left out"),
            ("f 1 2 3\nf 3 1 2\n", "a triangle that equals another one was left out (2 times)"),
            ("vn 0 0 1\nf 3//1 2//1 1//1\n", "a normal that is missing was computed (6 times)"),
            (
                "v 0 1.5 0\nf 1 3 2 5\n",
                "a polygon whose outline crosses itself or is too long is uncertain",
            ),
            ("v 2 2 2 1 0 0\n", "a colour of a vertex was not read"),
            ("v 2 2 2 1 0 0 1\n", "a colour of a vertex was not read"),
            ("l 1 2 3\np 1\n", "points and lines were left out (2 times)"),
            ("surf 0 1 0 1 1\n", "curves and free-form surfaces were left out"),
        ] {
            let notes = read(&format!("{SQUARE}f 1 2 3 4\n{text}")).unwrap().notes;
            assert_eq!(notes[0], note);
        }
    }

    #[test]
    fn obj_polygons_may_be_concave() {
        let text = "v 0 0 0\nv 2 1 0\nv 0 2 0\nv 0.6 1 0\nf 1 2 3 4\n";
        let mesh = read(text).unwrap();
        let doubled_area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| glam::Vec3::from(mesh.positions[i as usize]));
            (b - a).cross(c - a).z
        };
        let areas: Vec<f32> = mesh.triangles.iter().map(doubled_area).collect();
        assert!(areas.iter().all(|area| *area > 0.0), "{areas:?}");
        assert!((areas.iter().sum::<f32>() - 2.8).abs() < 1e-6, "{areas:?}");
    }

    #[test]
    fn obj_colors_come_from_mtl() {
        let folder = tempfile::tempdir().unwrap();
        let mtl = "newmtl red thing\nKd 1 0 0\nKs 1\nnewmtl grey\nKd 0.5\nnewmtl odd\nKd a b c\n";
        std::fs::write(folder.path().join("c.mtl"), mtl).unwrap();
        let text = "mtllib c.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl red thing\nf 1 2 3\n\
                    usemtl grey\nf 1 3 2\nusemtl odd\nf 1 2 4\nusemtl none\nf 1 4 2\n";
        let path = folder.path().join("a.obj");
        let mesh = parse(&FileContents { path, bytes: text.into() }).unwrap();
        let colors: Vec<_> = (0..4).map(|i| mesh.color(i).unwrap()).collect();
        assert_eq!(colors, [[1.0, 0.0, 0.0], [0.5; 3], UNCOLORED, UNCOLORED]);
        let unknown = "a material that no library before it defines is white";
        assert_eq!(mesh.notes, ["a colour of a material cannot be read", unknown]);
    }

    /// Libraries and names of materials as programs write them. The square is always red.
    #[test]
    fn obj_materials_of_programs_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let write =
            |name: &str, text: &[u8]| std::fs::write(folder.path().join(name), text).unwrap();
        let red = b"newmtl red\nKd 1 0 0\nmap_Kd a.png\n";
        write("a.mtl", red);
        write("a b.mtl", red);
        write("other.mtl", b"newmtl x\nKd 0 0 1\n");
        write("mark.mtl", &[b"\xEF\xBB\xBF" as &[u8], red].concat());
        write("latin.mtl", b"newmtl r\xF6t\nKd 1 0 0\n");
        write("blanks.mtl", b"\t newmtl \tred \r\n\tKd\t1 \\\r\n 0 0 # red\r");
        write("sign.mtl", b"newmtl red #2\nKd 1 0 0\n");
        for (library, material) in [
            ("a.mtl", b"usemtl red" as &[u8]),
            ("a.mtl", b"  usemtl\tred  \r"),
            ("a.mtl", b"usemtl red # the first"),
            ("a.mtl", b"usemtl \\\nred"),
            ("a.mtl # colours", b"usemtl red"),
            ("\"a b.mtl\"", b"usemtl red"),
            ("a b.mtl", b"usemtl red"),
            ("other.mtl a.mtl", b"usemtl red"),
            ("missing.mtl\ta.mtl", b"usemtl red"),
            (".\\a.mtl", b"usemtl red"),
            ("mark.mtl", b"usemtl red"),
            ("latin.mtl", b"usemtl r\xF6t"),
            ("blanks.mtl", b"usemtl red"),
            ("sign.mtl", b"usemtl red #2"),
        ] {
            let text = [b"mtllib " as &[u8], library.as_bytes(), b"\n", material, b"\n"].concat();
            let bytes = [&text[..], SQUARE.as_bytes(), b"f 1 2 3 4\n"].concat();
            let mesh = parse(&FileContents { path: folder.path().join("a.obj"), bytes }).unwrap();
            assert_eq!(mesh.color(0), Some([1.0, 0.0, 0.0]), "{}", String::from_utf8_lossy(&text));
            let has_texture = mesh.notes.contains(&"a texture of a material was not read".into());
            assert_eq!(has_texture, !["latin.mtl", "blanks.mtl", "sign.mtl"].contains(&library));
        }
    }
}
