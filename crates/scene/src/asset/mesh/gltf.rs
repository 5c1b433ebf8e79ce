//! glTF 2.0 files, text and binary. All primitives are merged into one mesh, with the transforms of
//! their nodes applied. Positions, normals, texture coordinates and base colour factors are read.
//! Cameras, lights, images, animations, skins and morph targets are ignored.
//!
//! The `gltf` library parses and validates the JSON. This module reads the numbers in the buffers
//! itself. The iterators of the library trust the offsets and types in the file; if the file is
//! wrong, they panic or their arithmetic overflows.

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::file::{FileContents, MAX_BYTES};
use crate::asset::mesh::builder::Builder;
use crate::asset::mesh::strip;
use crate::value::truncated;
use base64::Engine;
use glam::{DAffine3, DMat4, DVec3};
use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Mode;
use gltf::{Accessor, Document, Gltf, Node, Primitive, Semantic};
use std::borrow::Cow;
use zerkalo_kernel::primitive::TriangleMesh;

/// Parses a glTF or GLB file.
pub fn parse(source: &FileContents) -> Result<TriangleMesh, AssetError> {
    let Gltf { document, blob } = description(source)?;
    let buffers = buffers(source, &document, blob.as_deref())?;
    let mut builder = Builder::new(source);
    let mut visited = vec![false; document.nodes().count()];
    let mut stack: Vec<(Node, DAffine3)> =
        roots(&document).into_iter().map(|node| (node, DAffine3::IDENTITY)).collect();
    stack.reverse();
    while let Some((node, outer)) = stack.pop() {
        let place = || FileLocation::Part(format!("nodes[{}]", node.index()));
        if std::mem::replace(&mut visited[node.index()], true) {
            let found = "the node has two parents";
            return Err(source.error(place(), found, "a tree of nodes"));
        }
        let matrix = node.transform().matrix().map(|column| column.map(f64::from));
        let map = outer * DAffine3::from_mat4(DMat4::from_cols_array_2d(&matrix));
        if !map.is_finite() {
            return Err(source.error(place(), "the transform is not finite", "finite numbers"));
        }
        for primitive in node.mesh().iter().flat_map(|mesh| mesh.primitives()) {
            Part { source, buffers: &buffers, primitive, map }.add(&mut builder)?;
        }
        let children: Vec<_> = node.children().map(|child| (child, map)).collect();
        stack.extend(children.into_iter().rev());
    }
    builder.finish()
}

/// Parses and validates the JSON document of the file.
fn description(source: &FileContents) -> Result<Gltf, AssetError> {
    // Bytes 8 to 11 of a GLB file are its length. The library subtracts the size of the header from
    // this length without a check for underflow.
    let length = source.bytes.get(8..12).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    if source.bytes.starts_with(b"glTF") && length.is_none_or(|length| length < 12) {
        return Err(source.error(
            FileLocation::Byte(8),
            "the length is below 12",
            "the file's length",
        ));
    }
    let gltf = Gltf::from_slice_without_validation(&source.bytes);
    let gltf = gltf.map_err(|error| library_error(source, &error))?;
    let json = gltf.document.into_json();
    // This loop checks the accessor indices of attributes, because the validation by the library
    // uses these indices before it checks them.
    for (m, mesh) in json.meshes.iter().enumerate() {
        for index in mesh.primitives.iter().flat_map(|p| p.attributes.values()) {
            if index.value() >= json.accessors.len() {
                let found = format!("an attribute names accessor {}", index.value());
                let expected = format!("an accessor below {}, their number", json.accessors.len());
                let place = FileLocation::Part(format!("meshes[{m}]"));
                return Err(source.error(place, found, &expected));
            }
        }
    }
    let document = Document::from_json(json).map_err(|error| library_error(source, &error))?;
    Ok(Gltf { document, blob: gltf.blob })
}

/// Returns the root nodes of the default scene. Without a default scene, returns those of the first
/// scene; without scenes, all nodes without a parent.
fn roots(document: &Document) -> Vec<Node<'_>> {
    if let Some(scene) = document.default_scene().or_else(|| document.scenes().next()) {
        return scene.nodes().collect();
    }
    let mut child = vec![false; document.nodes().count()];
    document.nodes().flat_map(|n| n.children()).for_each(|c| child[c.index()] = true);
    document.nodes().filter(|n| !child[n.index()]).collect()
}

/// Converts an error of the `gltf` library to an error with file and location.
fn library_error(source: &FileContents, error: &gltf::Error) -> AssetError {
    let (place, found) = match error {
        gltf::Error::Deserialize(json) => {
            let text = json.to_string();
            let place = if source.bytes.starts_with(b"glTF") {
                FileLocation::Part("the description".to_string())
            } else {
                FileLocation::Line(json.line())
            };
            (place, text)
        }
        gltf::Error::Validation(faults) => match faults.first() {
            Some((path, fault)) => (FileLocation::Part(path.to_string()), fault.to_string()),
            None => (FileLocation::Whole, "the description is not valid".to_string()),
        },
        other => (FileLocation::Whole, other.to_string()),
    };
    source.error(place, found, "a glTF 2.0 file")
}

/// Returns the bytes of all glTF buffers: from the binary chunk `blob` of a GLB file, from data
/// URLs, or from files in the folder of `source`.
fn buffers<'a>(
    source: &FileContents,
    document: &Document,
    blob: Option<&'a [u8]>,
) -> Result<Vec<Cow<'a, [u8]>>, AssetError> {
    let mut all = Vec::new();
    let mut total = 0;
    for buffer in document.buffers() {
        let place = || FileLocation::Part(format!("buffers[{}]", buffer.index()));
        let wrong = |found: String, expected: &str| Err(source.error(place(), found, expected));
        let bytes: Cow<[u8]> = match buffer.source() {
            gltf::buffer::Source::Bin => match blob {
                Some(blob) => Cow::Borrowed(blob),
                None => return wrong("the buffer has no data".to_string(), "a uri or a BIN chunk"),
            },
            gltf::buffer::Source::Uri(uri) => match uri.strip_prefix("data:") {
                Some(data) => {
                    let text = data.split_once(";base64,").map(|(_, text)| text);
                    let engine = base64::engine::general_purpose::STANDARD;
                    match text.map(|text| engine.decode(text)) {
                        Some(Ok(bytes)) => Cow::Owned(bytes),
                        _ => return wrong("the data is not base64".to_string(), "base64"),
                    }
                }
                None => {
                    // Of the percent-encoded characters only spaces are decoded, because other ones
                    // are rare in file names.
                    let Some(path) = source.resolve_relative(&uri.replace("%20", " ")) else {
                        return wrong(
                            format!("uri is \"{}\"", truncated(uri)),
                            "a relative path without \"..\", to a file in the same folder or below",
                        );
                    };
                    Cow::Owned(FileContents::read(&path, MAX_BYTES - total)?.bytes)
                }
            },
        };
        if bytes.len() < buffer.length() {
            let found = format!("the buffer has {} bytes", bytes.len());
            return wrong(found, &format!("at least {}, its byteLength", buffer.length()));
        }
        if let Cow::Owned(bytes) = &bytes {
            total += bytes.len() as u64;
        }
        all.push(bytes);
    }
    Ok(all)
}

/// Returns the triangles of a list, strip or fan with `corners` corners, each as the indices of its
/// three corners. The sense of rotation is reversed if the part is `mirrored`.
fn faces(mode: Mode, corners: usize, mirrored: bool) -> impl ExactSizeIterator<Item = [usize; 3]> {
    let count = if mode == Mode::Triangles { corners / 3 } else { corners.saturating_sub(2) };
    (0..count).map(move |i| {
        let [a, b, c] = match mode {
            Mode::TriangleStrip => strip(i),
            Mode::TriangleFan => [0, i + 1, i + 2],
            _ => [3 * i, 3 * i + 1, 3 * i + 2],
        };
        if mirrored { [a, c, b] } else { [a, b, c] }
    })
}

/// Part of a glTF scene: a primitive (a piece of a mesh) with the transform of its node.
struct Part<'a> {
    source: &'a FileContents,
    buffers: &'a [Cow<'a, [u8]>],
    primitive: Primitive<'a>,
    map: DAffine3,
}

impl<'a> Part<'a> {
    /// Adds vertices, colour and triangles of this part to `builder`. Leaves out points and lines.
    fn add(&self, builder: &mut Builder) -> Result<(), AssetError> {
        let mode = self.primitive.mode();
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            builder.note("points and lines were left out");
            return Ok(());
        }
        let Some(positions) = self.primitive.get(&Semantic::Positions) else {
            builder.note("a part without positions was left out");
            return Ok(());
        };
        let vertices = positions.count();
        let positions = self.slice(&positions, Dimensions::Vec3)?;
        let normals = self.primitive.get(&Semantic::Normals);
        let normals = normals.map(|a| self.slice(&a, Dimensions::Vec3));
        let normals = normals.transpose()?;
        let uvs = self.primitive.get(&Semantic::TexCoords(0));
        let uvs = uvs.map(|a| self.slice(&a, Dimensions::Vec2)).transpose()?;
        self.add_color(builder)?;
        let indices = self.primitive.indices();
        let indices = indices.map(|a| self.slice(&a, Dimensions::Scalar));
        let indices = indices.transpose()?;
        let corners = indices.as_ref().map_or(vertices, |s| s.count);
        let linear = self.map.matrix3;
        let faces = faces(mode, corners, linear.determinant() < 0.0);
        builder.reserve(vertices, faces.len())?;
        let base = builder.vertices();
        let normal_map = linear.inverse().transpose();
        for i in 0..vertices {
            let position = self.map.transform_point3(DVec3::from_array(positions.numbers(i)));
            let normal = normals.filter(|normals| i < normals.count).map(|normals| {
                let normal = normal_map * DVec3::from_array(normals.numbers(i));
                normal.normalize_or_zero().as_vec3().to_array()
            });
            let uv = uvs.filter(|uvs| i < uvs.count).map(|uvs| {
                let [u, v] = uvs.numbers(i).map(|x| (x / uvs.largest()) as f32);
                // The texture coordinate v points downwards in glTF, and upwards in
                // [`TriangleMesh::uvs`].
                [u, 1.0 - v]
            });
            builder.vertex(position.to_array(), normal, uv);
        }
        let place =
            || FileLocation::Part(format!("meshes[..].primitives[{}]", self.primitive.index()));
        let corner = |i: usize| match &indices {
            Some(slice) => slice.numbers::<1>(i)[0],
            None => i as f64,
        };
        for [a, b, c] in faces {
            let index = |i| builder.index(corner(i), base, place);
            builder.triangle([index(a)?, index(b)?, index(c)?])?;
        }
        Ok(())
    }

    /// Makes the base colour of this part the colour of the triangles that are added next.
    fn add_color(&self, builder: &mut Builder) -> Result<(), AssetError> {
        let [r, g, b, _] = self.primitive.material().pbr_metallic_roughness().base_color_factor();
        if ![r, g, b].iter().all(|x| (0.0..=1e6).contains(x)) {
            let found = "a base colour is not a colour";
            return Err(self.source.fault(found, "numbers of at least 0"));
        }
        // Triangles without a stored colour are white.
        if [r, g, b] != [1.0; 3] || builder.has_colors() {
            builder.color([r, g, b])?;
        }
        Ok(())
    }

    /// Returns the elements of `accessor`, a glTF list. Checks that the elements have `dimensions`
    /// (such as a vector of three) and components of a type that is read, and that all elements are
    /// inside their buffer.
    fn slice(
        &self,
        accessor: &Accessor<'a>,
        dimensions: Dimensions,
    ) -> Result<Slice<'a>, AssetError> {
        let place = || FileLocation::Part(format!("accessors[{}]", accessor.index()));
        let wrong =
            |found: String, expected: &str| Err(self.source.error(place(), found, expected));
        let (found, kind) = (accessor.dimensions(), accessor.data_type());
        let (kinds, expected): (&[DataType], _) = match dimensions {
            Dimensions::Scalar => {
                (&[DataType::U8, DataType::U16, DataType::U32], "unsigned integers")
            }
            Dimensions::Vec2 => (&[DataType::U8, DataType::U16, DataType::F32], "pairs of numbers"),
            _ => (&[DataType::F32], "triples of 32-bit floats"),
        };
        if found != dimensions || !kinds.contains(&kind) {
            return wrong(format!("the data is {found:?} of {kind:?}"), expected);
        }
        if accessor.sparse().is_some() {
            return wrong("the accessor is sparse".to_string(), "one that is not");
        }
        let Some(view) = accessor.view() else {
            return wrong("the accessor names no bufferView".to_string(), "one that does");
        };
        let size = kind.size() * dimensions.multiplicity();
        let stride = view.stride().unwrap_or(size);
        let count = accessor.count();
        let bytes = self.buffers.get(view.buffer().index()).and_then(|buffer| {
            let end = view.offset().checked_add(view.length())?;
            let view = buffer.get(view.offset()..end)?;
            let items = count.checked_sub(1)?.checked_mul(stride)?.checked_add(size)?;
            view.get(accessor.offset()..accessor.offset().checked_add(items)?)
        });
        match bytes {
            Some(bytes) if stride >= size => Ok(Slice { bytes, stride, kind, count }),
            _ => wrong(
                format!("{count} items of {size} bytes do not lie in their buffer"),
                "a range inside its bufferView and buffer, with at least one item",
            ),
        }
    }
}

/// Elements of a glTF accessor: `count` of `size` bytes each, which begin every `stride` bytes.
/// [`Part::slice`] has checked that they are inside the accessor's buffer.
#[derive(Clone, Copy)]
struct Slice<'a> {
    bytes: &'a [u8],
    stride: usize,
    kind: DataType,
    count: usize,
}

impl Slice<'_> {
    /// Returns the numbers of element `i`.
    fn numbers<const N: usize>(&self, i: usize) -> [f64; N] {
        let size = self.kind.size();
        std::array::from_fn(|k| match self.bytes[i * self.stride + k * size..][..size] {
            [a] => a.into(),
            [a, b] => u16::from_le_bytes([a, b]).into(),
            [a, b, c, d] if self.kind == DataType::U32 => u32::from_le_bytes([a, b, c, d]).into(),
            [a, b, c, d] => f32::from_le_bytes([a, b, c, d]).into(),
            _ => f64::NAN,
        })
    }

    /// Returns the stored number that means the texture coordinate 1: 255 or 65535 for integers, 1
    /// for floats.
    fn largest(&self) -> f64 {
        match self.kind {
            DataType::U8 => 255.0,
            DataType::U16 => 65535.0,
            _ => 1.0,
        }
    }
}
