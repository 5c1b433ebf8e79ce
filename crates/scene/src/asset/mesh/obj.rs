//! Wavefront OBJ files, with the diffuse colours of their MTL files.
//!
//! The `tobj` library parses the file. Before this, a first pass counts the vertices and checks the
//! indices of faces, because the library reports no line numbers and computes with indices before
//! it checks them.

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::file::FileContents;
use crate::asset::mesh::builder::Builder;
use crate::value::truncated;
use std::cell::RefCell;
use std::io::{BufRead, Read};
use std::path::{Path, PathBuf};
use tobj::{LoadError, LoadOptions, MTLLoadResult};
use zerkalo_kernel::primitive::TriangleMesh;

/// Largest size of an MTL file in bytes: 16 MiB.
const MAX_MTL_BYTES: u64 = 16 << 20;

/// Largest number of MTL files that are read for one OBJ file. Further MTL files are ignored.
const MAX_MTL_FILES: usize = 64;

/// Linear colour of triangles without a diffuse colour, in an OBJ file with materials.
const UNCOLORED: [f32; 3] = [1.0; 3];

/// Parses an OBJ file.
pub fn parse(source: &FileContents) -> Result<TriangleMesh, AssetError> {
    let mut builder = Builder::new(source);
    builder.check_limits(check_faces(source)?, 0)?;
    let libraries = RefCell::new(Libraries::default());
    let options = LoadOptions {
        single_index: true,
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
    };
    let mut lines = Lines { rest: &source.bytes, line: 0, current: b"" };
    let load = |path: &Path| libraries.borrow_mut().load(source, path);
    let loaded = tobj::load_obj_buf(&mut lines, &options, load);
    let (models, materials) = loaded.map_err(|error| {
        let place = FileLocation::Line(lines.line);
        source.error(place, describe(error), "a line of the OBJ format")
    })?;
    let libraries = libraries.into_inner();
    if let Some(error) = libraries.error {
        return Err(error);
    }
    libraries.notes.into_iter().for_each(|note| builder.note(note));
    let materials = materials.unwrap_or_default();
    for model in models {
        let mesh = model.mesh;
        if !materials.is_empty() {
            let diffuse = mesh.material_id.and_then(|i| materials.get(i)?.diffuse);
            builder.color(diffuse.map_or(UNCOLORED, |c| c.map(|x| x as f32)))?;
        }
        let base = builder.vertices();
        let vertices = mesh.positions.len() / 3;
        builder.reserve(vertices, mesh.indices.len() / 3)?;
        // If only some corners of a model have normals, the list of normals is shorter than that of
        // the vertices, and the library does not report which corners they belong to. Such a list
        // is ignored. The same holds for texture coordinates.
        let normals = (mesh.normals.len() == mesh.positions.len()).then_some(&mesh.normals);
        let uvs = (mesh.texcoords.len() == 2 * vertices).then_some(&mesh.texcoords);
        for (i, p) in mesh.positions.chunks_exact(3).enumerate() {
            builder.vertex([p[0], p[1], p[2]]);
            if let Some(n) = normals {
                builder.normal([n[3 * i] as f32, n[3 * i + 1] as f32, n[3 * i + 2] as f32]);
            }
            if let Some(uv) = uvs {
                builder.uv([uv[2 * i] as f32, uv[2 * i + 1] as f32]);
            }
        }
        for t in mesh.indices.chunks_exact(3) {
            let corners = [t[0], t[1], t[2]].map(|i| i + base as u32);
            builder.triangle(corners, || FileLocation::Part(truncated(&model.name)))?;
        }
    }
    builder.finish().map_err(|error| locate_vertex(source, error))
}

/// Returns a phrase that describes an error of the OBJ parser library.
fn describe(error: LoadError) -> &'static str {
    match error {
        LoadError::ReadError => "this is not UTF-8 text",
        LoadError::PositionParseError => "this vertex is not three numbers",
        LoadError::ScalingByZeroError => "this vertex has the weight 0",
        LoadError::NormalParseError => "this normal is not three numbers",
        LoadError::TexcoordParseError => "these texture coordinates are not two numbers",
        LoadError::FaceParseError => "this face is not a list of indices",
        LoadError::InvalidPolygon => "a face above has fewer than three corners",
        LoadError::MaterialParseError => "usemtl names no material",
        LoadError::FaceVertexOutOfBounds => "a face above names a vertex that comes only below",
        LoadError::FaceTexCoordOutOfBounds => {
            "a face above names texture coordinates that come only below"
        }
        LoadError::FaceNormalOutOfBounds => "a face above names a normal that comes only below",
        _ => "this line cannot be read",
    }
}

/// Returns the lines of a text with their numbers, counted from 1.
fn numbered(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    bytes.split(|b| *b == b'\n').zip(1..).map(|(line, n)| (n, line))
}

/// Returns the words of a line, separated by ASCII whitespace.
fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty())
}

/// Checks that every index of a face in an OBJ file is valid, and that the number of triangles is
/// within the limit. Returns the number of vertices.
fn check_faces(source: &FileContents) -> Result<usize, AssetError> {
    let list = |line: &[u8]| match words(line).next() {
        Some(b"v") => Some(0),
        Some(b"vt") => Some(1),
        Some(b"vn") => Some(2),
        _ => None,
    };
    let mut totals = [0usize; 3];
    for (_, line) in numbered(&source.bytes) {
        if let Some(list) = list(line) {
            totals[list] += 1;
        }
    }
    let mut so_far = [0usize; 3];
    let mut triangles = 0usize;
    let builder = Builder::new(source);
    for (n, line) in numbered(&source.bytes) {
        if let Some(list) = list(line) {
            so_far[list] += 1;
        }
        let mut words = words(line);
        if !matches!(words.next(), Some(b"f" | b"l")) {
            continue;
        }
        let mut corners = 0usize;
        for word in words {
            corners += 1;
            for (list, index) in word.split(|b| *b == b'/').take(3).enumerate() {
                let index = std::str::from_utf8(index).ok().and_then(|i| i.parse::<i128>().ok());
                // Two cases need no check here. The library itself reports a word that is not a
                // number. It ignores an index into an empty list of texture coordinates or normals.
                let Some(index) = index.filter(|_| list == 0 || totals[list] > 0) else { continue };
                let (from, to) = (-(so_far[list] as i128), totals[list] as i128);
                if index == 0 || index < from || index > to {
                    let what = ["vertex", "texture coordinate", "normal"][list];
                    let found = format!("the face names {what} {index}");
                    let expected = match to {
                        0 => format!("a {what} that the file has; it has none"),
                        _ => format!(
                            "a {what} from 1 to {to}, or from {from} to -1 counted backwards"
                        ),
                    };
                    return Err(source.error(FileLocation::Line(n), found, &expected));
                }
            }
        }
        triangles += corners.saturating_sub(2);
        builder.check_limits(0, triangles)?;
    }
    Ok(totals[0])
}

/// Adds the line number to an error about the coordinates of a vertex in an OBJ file.
fn locate_vertex(source: &FileContents, error: AssetError) -> AssetError {
    let bad = |line: &[u8]| {
        let mut words = words(line);
        words.next() == Some(b"v")
            && words.take(3).any(|w| {
                let x = std::str::from_utf8(w).ok().and_then(|w| w.parse::<f64>().ok());
                x.is_some_and(|x| !(-1e9..=1e9).contains(&x))
            })
    };
    let part = matches!(error.place, FileLocation::Part(_));
    match numbered(&source.bytes).find(|(_, line)| part && bad(line)) {
        Some((n, _)) => AssetError { place: FileLocation::Line(n), ..error },
        None => error,
    }
}

/// Reader of an OBJ file that passes one line at a time to the parser library and counts the lines.
/// It removes vertex colours at the end of lines, because the library requires that either all
/// vertices have colours or none.
struct Lines<'a> {
    rest: &'a [u8],
    line: usize,
    current: &'a [u8],
}

impl Read for Lines<'_> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let n = self.fill_buf()?.read(out)?;
        self.consume(n);
        Ok(n)
    }
}

impl BufRead for Lines<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        if self.current.is_empty() && !self.rest.is_empty() {
            let end = self.rest.iter().position(|b| *b == b'\n');
            let (line, rest) = self.rest.split_at(end.map_or(self.rest.len(), |e| e + 1));
            self.rest = rest;
            self.line += 1;
            // The colour at the end of the line is removed together with the newline. `consume`
            // then passes the newline separately.
            let colored = words(line).next() == Some(b"v") && words(line).count() > 5;
            self.current = if colored { without_color(line) } else { line };
        }
        Ok(self.current)
    }

    fn consume(&mut self, n: usize) {
        let cut = self.current.len() == n && self.current.last().is_some_and(|b| *b != b'\n');
        self.current = &self.current[n..];
        if cut && !self.rest.is_empty() {
            self.current = b"\n";
        }
    }
}

/// Returns the beginning of an OBJ line, up to and including its fourth word. For a vertex these
/// words are `v` and three coordinates.
fn without_color(line: &[u8]) -> &[u8] {
    let fourth = words(line).nth(3).unwrap_or_default();
    let end = fourth.as_ptr() as usize - line.as_ptr() as usize + fourth.len();
    &line[..end]
}

/// Results of loading the MTL files of an OBJ file: the paths of the files loaded so far, notes for
/// the user, and the first error.
#[derive(Default)]
struct Libraries {
    seen: Vec<PathBuf>,
    notes: Vec<String>,
    error: Option<AssetError>,
}

impl Libraries {
    /// Returns the materials of the MTL file `name`, which the OBJ file `source` names. Returns no
    /// materials in four cases:
    ///
    /// - `name` leads out of the folder; this is recorded as an error
    /// - the file cannot be read; this is recorded as a note
    /// - the file was loaded before
    /// - [`MAX_MTL_FILES`] other files were loaded before
    fn load(&mut self, source: &FileContents, name: &Path) -> MTLLoadResult {
        let nothing = || tobj::load_mtl_buf(&mut &b""[..]);
        let name = name.to_string_lossy();
        let Some(path) = source.resolve_relative(&name) else {
            let error = source.fault(
                format!("mtllib names \"{}\"", truncated(&name)),
                "a relative path without \"..\", to a file in the same folder or below",
            );
            self.error.get_or_insert(error);
            return nothing();
        };
        if self.seen.contains(&path) || self.seen.len() >= MAX_MTL_FILES {
            return nothing();
        }
        self.seen.push(path.clone());
        match FileContents::read(&path, MAX_MTL_BYTES) {
            Ok(library) => tobj::load_mtl_buf(&mut diffuse_colors(&library.bytes).as_bytes()),
            Err(error) => {
                self.notes.push(format!("no colours: {}", error.what()));
                nothing()
            }
        }
    }
}

/// Returns the content of an MTL file reduced to the names and diffuse colours of materials, with
/// three finite numbers per colour. The parser library panics on some of the other lines, which are
/// not used.
fn diffuse_colors(bytes: &[u8]) -> String {
    let mut out = String::new();
    for (_, line) in numbered(bytes) {
        let line = String::from_utf8_lossy(line);
        let mut words = line.split_whitespace();
        match words.next() {
            Some("newmtl") if words.next().is_some() => {
                out += line.trim();
                out.push('\n');
            }
            Some("Kd") => {
                let numbers: Vec<f64> = words
                    .map_while(|w| w.parse().ok())
                    .filter(|x: &f64| (0.0..=1e6).contains(x))
                    .take(3)
                    .collect();
                let color = match numbers[..] {
                    [r, g, b] => [r, g, b],
                    [grey] => [grey; 3],
                    _ => continue,
                };
                out += &format!("Kd {} {} {}\n", color[0], color[1], color[2]);
            }
            _ => {}
        }
    }
    out
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
        for (text, words) in [
            ("", "no triangles"),
            ("f 1 2 2\n", "has an area"),
            ("mtllib ../x.mtl\nf 1 2 3\n", "mtllib"),
        ] {
            let error = read(&format!("{v}{text}")).unwrap_err();
            assert!(error.found.contains(words), "{text} {error}");
        }
        let notes = read(&format!("mtllib x.mtl\n{v}f 1 2 3\n")).unwrap().notes;
        assert!(notes[0].contains("x.mtl: there is no such file"), "{notes:?}");
    }

    #[test]
    fn obj_colors_come_from_mtl() {
        let folder = tempfile::tempdir().unwrap();
        let mtl = "newmtl red thing\nKd 1 0 0\nKs 1\nnewmtl grey\nKd 0.5\nnewmtl odd\nKd a b c\n";
        std::fs::write(folder.path().join("c.mtl"), mtl).unwrap();
        let text = "mtllib c.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red thing\nf 1 2 3\n\
                    usemtl grey\nf 1 3 2\nusemtl odd\nf 2 3 1\nusemtl none\nf 2 1 3\n";
        let path = folder.path().join("a.obj");
        let mesh = parse(&FileContents { path, bytes: text.into() }).unwrap();
        let colors: Vec<_> = (0..4).map(|i| mesh.color(i).unwrap()).collect();
        assert_eq!(colors, [[1.0, 0.0, 0.0], [0.5; 3], UNCOLORED, UNCOLORED]);
        assert_eq!(mesh.notes, [] as [String; 0]);
    }
}
