//! Wavefront OBJ files, with the diffuse colours of their MTL files.

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::file::FileContents;
use crate::asset::mesh::builder::{Builder, MAX_COORDINATE};
use crate::value::truncated;
use std::collections::HashMap;
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
        libraries: Vec::new(),
        colors: HashMap::new(),
        material: None,
    };
    for line in source.bytes.split(|byte| *byte == b'\n') {
        parser.line += 1;
        parser.parse_line(&String::from_utf8_lossy(line))?;
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
    /// Index in the mesh of each vertex of the present object, group and material.
    vertices: HashMap<Corner, u32>,
    /// MTL files that have been read.
    libraries: Vec<PathBuf>,
    /// Diffuse colours of the materials, by name.
    colors: HashMap<String, [f32; 3]>,
    /// Name of the present material; `None` if no MTL file that has been read defines it.
    material: Option<String>,
}

impl Parser<'_> {
    /// Parses a line and adds its content. Lines with unknown keywords are ignored.
    fn parse_line(&mut self, line: &str) -> Result<(), AssetError> {
        let (keyword, rest) = keyword(line);
        match keyword {
            "v" => {
                let position = position(rest);
                let position = position.ok_or_else(|| self.wrong("vertex is not three numbers"))?;
                if !position.iter().all(|x| x.abs() <= MAX_COORDINATE) {
                    let [x, y, z] = position;
                    let found = format!("a vertex lies at [{x}, {y}, {z}]");
                    return Err(self.error(found, "coordinates from -1e9 to 1e9"));
                }
                self.positions.push(position);
            }
            "vt" => {
                let wrong = || self.wrong("texture coordinate is not two numbers");
                self.uvs.push(numbers(rest).ok_or_else(wrong)?);
            }
            "vn" => {
                let wrong = || self.wrong("normal is not three numbers");
                self.normals.push(numbers(rest).ok_or_else(wrong)?);
            }
            "f" => self.add_face(rest)?,
            "o" | "g" => self.vertices.clear(),
            "usemtl" => {
                let material = self.colors.contains_key(rest).then(|| rest.to_string());
                if material != self.material {
                    self.vertices.clear();
                }
                self.material = material;
            }
            "mtllib" => self.read_library(rest)?,
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
    fn add_face(&mut self, words: &str) -> Result<(), AssetError> {
        if !self.colors.is_empty() {
            let color = self.material.as_ref().and_then(|name| self.colors.get(name));
            self.builder.color(*color.unwrap_or(&UNCOLORED))?;
        }
        let mut corners = Vec::new();
        for word in words.split_whitespace() {
            let mut indices = word.split('/');
            let mut next = |what, count| self.index(indices.next().unwrap_or(""), what, count);
            let position = next("vertex", self.positions.len())?;
            let uv = next("texture coordinate", self.uvs.len())?;
            let normal = next("normal", self.normals.len())?;
            let position = position.ok_or_else(|| self.wrong("face is not a list of indices"))?;
            corners.push(self.vertex((position, uv, normal)));
        }
        self.builder.polygon(&corners, || FileLocation::Line(self.line))
    }

    /// Parses the index of one of the `count` entries of the kind `what` so far: from 1, or from -1
    /// backwards. Returns the index from 0. Returns `None` if `word` is empty, or if there are no
    /// texture coordinates or normals to which it could refer.
    fn index(&self, word: &str, what: &str, count: usize) -> Result<Option<usize>, AssetError> {
        if word.is_empty() || count == 0 && what != "vertex" {
            return Ok(None);
        }
        let index: i64 = word.parse().map_err(|_| self.wrong("face is not a list of indices"))?;
        let from_0 = if index > 0 { index - 1 } else { index.saturating_add(count as i64) };
        match usize::try_from(from_0).ok().filter(|i| *i < count) {
            Some(index) => Ok(Some(index)),
            None => {
                let found = format!("the face names {what} {index}");
                let expected = format!("a {what} above: 1 to {count}, or -{count} to -1 backwards");
                Err(self.error(found, &expected))
            }
        }
    }

    /// Returns the index of the vertex `corner` in the mesh. Adds the vertex if it is new.
    fn vertex(&mut self, corner: Corner) -> u32 {
        *self.vertices.entry(corner).or_insert_with(|| {
            let (position, uv, normal) = corner;
            let normal = normal.map(|i| self.normals[i].map(|x| x as f32));
            let uv = uv.map(|i| self.uvs[i].map(|x| x as f32));
            self.builder.vertex(self.positions[position], normal, uv)
        })
    }

    /// Reads the diffuse colours of the MTL file `name`. Records a note if the file cannot be read.
    /// Fails if the name could lead out of the folder of the OBJ file.
    fn read_library(&mut self, name: &str) -> Result<(), AssetError> {
        let Some(path) = self.source.resolve_relative(name) else {
            return Err(self.error(
                format!("mtllib names \"{}\"", truncated(name)),
                "a relative path without \"..\", to a file in the same folder or below",
            ));
        };
        if self.libraries.contains(&path) || self.libraries.len() >= MAX_MTL_FILES {
            return Ok(());
        }
        match FileContents::read(&path, MAX_MTL_BYTES) {
            Ok(library) => self.add_colors(&String::from_utf8_lossy(&library.bytes)),
            Err(error) => self.builder.note(format!("no colours: {}", error.what())),
        }
        self.libraries.push(path);
        Ok(())
    }

    /// Adds the diffuse colours (`Kd`) in the MTL text `library`. Invalid colours are ignored.
    fn add_colors(&mut self, library: &str) {
        let mut name = "";
        for line in library.lines() {
            match keyword(line) {
                ("newmtl", new) => {
                    name = new;
                    self.colors.insert(name.to_string(), UNCOLORED);
                }
                ("Kd", words) => {
                    let grey = || numbers(words).map(|[grey]| [grey; 3]);
                    let color: Option<[f64; 3]> = numbers(words).or_else(grey);
                    let color = color.filter(|c| c.iter().all(|x| (0.0..=1e6).contains(x)));
                    if let (Some(color), Some(known)) = (color, self.colors.get_mut(name)) {
                        *known = color.map(|x| x as f32);
                    }
                }
                _ => {}
            }
        }
    }
}

/// Returns the first word of a line, and the rest without the spaces around it.
fn keyword(line: &str) -> (&str, &str) {
    let line = line.trim();
    let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    (keyword, rest.trim())
}

/// Parses the first `N` words as numbers; `None` if there are fewer words or one is not a number.
fn numbers<const N: usize>(words: &str) -> Option<[f64; N]> {
    let numbers = words.split_whitespace().take(N).map(|word| word.parse().ok());
    numbers.collect::<Option<Vec<_>>>()?.try_into().ok()
}

/// Parses three coordinates. If exactly one more number follows, it is the weight of the vertex, by
/// which they are divided. If several follow, they are a colour, which is ignored.
fn position(words: &str) -> Option<[f64; 3]> {
    let position: [f64; 3] = numbers(words)?;
    let weight = match words.split_whitespace().count() {
        4 => numbers::<4>(words)?[3],
        _ => 1.0,
    };
    (weight != 0.0).then(|| position.map(|x| x / weight))
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
