//! glTF 2.0 files, text and binary. All primitives are merged into one mesh, with the transforms of
//! their nodes and the morph weights applied. Positions, normals, texture coordinates and base
//! colour factors are read. Everything else is ignored, even if it is faulty.

mod document;

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::file::{FileContents, MAX_BYTES};
use crate::asset::mesh::builder::Builder;
use crate::asset::mesh::gltf::document::{
    Attributes, Document, Material, Primitive, Sparse, View, whole,
};
use crate::asset::mesh::strip;
use crate::process_memory::missing_memory;
use crate::value::truncated;
use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use glam::{DAffine3, DVec3};
use std::cell::{Cell, OnceCell};
use std::collections::HashSet;
use std::fmt::{Arguments, Display};
use zerkalo_kernel::primitive::TriangleMesh;

/// Parts of the names of extensions that change neither the shape nor the colours that are read. A
/// file that requires one of them is read, with a note.
const OPTIONAL: [&str; 7] =
    ["_materials_", "_texture_", "_lights_", "_xmp", "_animation_", "_features", "_metadata"];

/// Extensions that are applied, or noted or refused where they occur.
const KNOWN: [&str; 5] = [
    "KHR_mesh_quantization",
    "EXT_mesh_gpu_instancing",
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
];

/// Largest number of items of lists and accessors that are read in all, with repetitions: a few for
/// each vertex and triangle of the largest mesh. It bounds the time for files that name the same
/// long lists many times.
const MAX_ITEMS: u64 = 1 << 29;

/// Estimated memory of a JSON object of the description, whatever the length of its text \[bytes\].
const OBJECT_BYTES: u64 = 512;

/// Modes of primitives with triangles.
const TRIANGLES: f64 = 4.0;
const STRIP: f64 = 5.0;
const FAN: f64 = 6.0;

/// Base64 as in data URLs, whose padding some programs leave out.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Parses a glTF or GLB file.
pub fn parse(source: &FileContents) -> Result<TriangleMesh, AssetError> {
    let gltf = Gltf::new(source)?;
    let mut builder = Builder::new(source);
    builder.is_flat = true;
    gltf.check_extensions(&mut builder)?;
    let scene_from_node = gltf.transforms()?;
    for (node, map) in gltf.document.nodes.iter().zip(&scene_from_node) {
        let (Some(map), Some(m)) = (map, node.mesh) else { continue };
        if node.extensions.instances.is_some() {
            builder.note("the instances of a node were not read");
        }
        if node.skin.is_some() {
            builder.note("the joints of a skin were not read");
        }
        let mesh = gltf.part(&gltf.document.meshes, "meshes", m)?;
        let weights = if node.weights.is_empty() { &mesh.weights } else { &node.weights };
        // The joints of a skin place its mesh; its node does not.
        let map = if node.skin.is_some() { DAffine3::IDENTITY } else { *map };
        gltf.count(mesh.primitives.len())?;
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let place = format_args!("meshes[{m}].primitives[{i}]");
            Part { gltf: &gltf, primitive, place, weights }.add(&mut builder, map)?;
        }
    }
    builder.finish()
}

/// glTF file with its description and the bytes of its buffers.
struct Gltf<'a> {
    source: &'a FileContents,
    document: Document,
    /// Binary chunk of a GLB file.
    blob: Option<&'a [u8]>,
    /// Bytes of the buffers that were read so far from other files and data URLs.
    buffers: Vec<OnceCell<Vec<u8>>>,
    /// Number of these bytes.
    bytes_read: Cell<u64>,
    /// Number of items of lists and accessors that were read.
    items_read: Cell<u64>,
}

impl<'a> Gltf<'a> {
    /// Parses the description.
    fn new(source: &'a FileContents) -> Result<Self, AssetError> {
        let is_binary = source.bytes.starts_with(b"glTF");
        let (json, blob) = if is_binary { chunks(source)? } else { (&source.bytes[..], None) };
        let json = json.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(json);
        let objects = json.iter().filter(|byte| **byte == b'{').count();
        if let Some(missing) = missing_memory(objects as u64 * OBJECT_BYTES) {
            let found = format!("the description of {objects} parts {missing}");
            return Err(source.fault(found, "a smaller file, or more free memory"));
        }
        let document: Document = serde_json::from_slice(json).map_err(|error| {
            let place = match is_binary {
                true => FileLocation::Part("the description".to_string()),
                false => FileLocation::Line(error.line()),
            };
            source.error(place, error.to_string(), "a glTF 2.0 file")
        })?;
        let version = &document.asset.version;
        if !version.starts_with("2.") {
            let found = format!("the version is \"{}\"", truncated(version));
            let place = FileLocation::Part("asset.version".to_string());
            return Err(source.error(place, found, "a glTF 2.0 file"));
        }
        let buffers = document.buffers.iter().map(|_| OnceCell::new()).collect();
        let (bytes_read, items_read) = (Cell::new(0), Cell::new(0));
        Ok(Self { source, document, blob, buffers, bytes_read, items_read })
    }

    fn error(&self, place: impl Display, found: impl Into<String>, expected: &str) -> AssetError {
        self.source.error(FileLocation::Part(place.to_string()), found, expected)
    }

    /// Counts items that are read; fails if they exceed [`MAX_ITEMS`].
    fn count(&self, items: usize) -> Result<(), AssetError> {
        self.items_read.set(self.items_read.get().saturating_add(items as u64));
        let message = "the scene has more than 2^29 numbers and parts";
        let is_allowed = self.items_read.get() <= MAX_ITEMS;
        is_allowed.then_some(()).ok_or_else(|| self.source.fault(message, "a smaller scene"))
    }

    /// Returns the element `index` of the list `name`.
    fn part<'b, T>(&self, list: &'b [T], name: &str, index: f64) -> Result<&'b T, AssetError> {
        list.get(whole(index)).ok_or_else(|| {
            let expected = format!("one of the {} elements of that list", list.len());
            let found = "the file names this part, which it lacks";
            self.error(format_args!("{name}[{index}]"), found, &expected)
        })
    }

    /// Refuses files that require an extension that may change what is read.
    fn check_extensions(&self, builder: &mut Builder) -> Result<(), AssetError> {
        for name in &self.document.extensions_required {
            let shown = truncated(name);
            if OPTIONAL.iter().any(|part| name.contains(part)) {
                builder.note(format!("the extension {shown} was not applied"));
            } else if !KNOWN.contains(&name.as_str()) {
                let found = format!("the file requires the extension \"{shown}\"");
                return Err(self.error("extensionsRequired", found, "a file without it"));
            }
        }
        Ok(())
    }

    /// Returns the transform of each node of the scene; `None` for other nodes. The scene is the
    /// default one, or else the first one; without scenes it has all nodes.
    fn transforms(&self) -> Result<Vec<Option<DAffine3>>, AssetError> {
        let Document { nodes, scene, scenes, .. } = &self.document;
        let roots = match scene.or(scenes.first().map(|_| 0.0)) {
            Some(scene) => self.part(scenes, "scenes", scene)?.nodes.clone(),
            None => {
                let children = nodes.iter().flat_map(|node| &node.children);
                let children: HashSet<_> = children.map(|child| whole(*child)).collect();
                (0..nodes.len()).filter(|i| !children.contains(i)).map(|i| i as f64).collect()
            }
        };
        let mut scene_from_node = vec![None; nodes.len()];
        let mut stack: Vec<_> = roots.into_iter().map(|root| (root, DAffine3::IDENTITY)).collect();
        while let Some((index, outer)) = stack.pop() {
            let node = self.part(nodes, "nodes", index)?;
            let error =
                |found, expected| Err(self.error(format_args!("nodes[{index}]"), found, expected));
            let map = outer * node.map();
            if !map.is_finite() {
                return error("the transform is not finite", "finite numbers");
            }
            if scene_from_node[whole(index)].replace(map).is_some() {
                return error("the node has two parents", "a tree of nodes");
            }
            stack.extend(node.children.iter().map(|child| (*child, map)));
        }
        Ok(scene_from_node)
    }

    /// Returns the attribute `name`; empty if the file lacks it.
    fn attribute<const N: usize>(
        &self,
        attributes: &Attributes,
        name: &str,
    ) -> Result<Vec<[f64; N]>, AssetError> {
        attributes.get(name).map_or(Ok(Vec::new()), |accessor| self.numbers(*accessor))
    }

    /// Returns the elements of an accessor of vectors of `N` numbers.
    fn numbers<const N: usize>(&self, index: f64) -> Result<Vec<[f64; N]>, AssetError> {
        let accessor = self.part(&self.document.accessors, "accessors", index)?;
        let error =
            |found, expected| Err(self.error(format_args!("accessors[{index}]"), found, expected));
        let kind = ["SCALAR", "VEC2", "VEC3"][N - 1];
        if accessor.kind != kind {
            return error(format!("the type is \"{}\"", truncated(&accessor.kind)), kind);
        }
        let (count, component_type) = (whole(accessor.count), accessor.component_type);
        self.count(count)?;
        let bytes = self.source.bytes.len() as u64 + self.bytes_read.get();
        let mut all: Vec<[f64; N]> = match accessor.buffer_view {
            Some(buffer_view) => {
                let byte_offset = accessor.byte_offset;
                self.items(&View { buffer_view, byte_offset, component_type }, count)?
            }
            // All elements are 0. There are as many as in other accessors, which have data.
            None if count.saturating_mul(N) as u64 <= bytes => vec![[0.0; N]; count],
            None => return error(format!("there are {count} items without data"), "a bufferView"),
        };
        if let Some(Sparse { count, indices, values }) = &accessor.sparse {
            self.count(whole(*count))?;
            let indices = self.items::<1>(indices, whole(*count))?;
            let values = self.items(&View { component_type, ..*values }, whole(*count))?;
            for ([index], value) in indices.into_iter().zip(values) {
                let Some(element) = all.get_mut(whole(index)) else {
                    return error(format!("a sparse index is {index}"), "an index of the accessor");
                };
                *element = value;
            }
        }
        if accessor.normalized
            && let Some(Component { one, .. }) = Component::of(component_type)
        {
            all.as_flattened_mut().iter_mut().for_each(|x| *x = (*x / one).max(-1.0));
        }
        Ok(all)
    }

    /// Returns `count` items of `N` components in a buffer view. Checks that they lie in the view
    /// and in its buffer.
    fn items<const N: usize>(&self, at: &View, count: usize) -> Result<Vec<[f64; N]>, AssetError> {
        let view = self.part(&self.document.buffer_views, "bufferViews", at.buffer_view)?;
        let error = |found: String, expected| {
            self.error(format_args!("bufferViews[{}]", at.buffer_view), found, expected)
        };
        if view.extensions.meshopt.is_some() {
            let found = "the data is compressed (EXT_meshopt_compression)".to_string();
            return Err(error(found, "a file without compression"));
        }
        let Some(Component { size, value, .. }) = Component::of(at.component_type) else {
            let found = format!("a componentType is {}", at.component_type);
            return Err(error(found, "5120 to 5123, 5125 or 5126"));
        };
        let stride = view.byte_stride.map_or(N * size, whole);
        let buffer = self.buffer(view.buffer)?;
        let bytes = || {
            let [begin, length, offset] =
                [view.byte_offset, view.byte_length, at.byte_offset].map(whole);
            let view = buffer.get(begin..begin.checked_add(length)?)?;
            let items = count.checked_sub(1)?.checked_mul(stride)?.checked_add(N * size)?;
            view.get(offset..offset.checked_add(items)?).filter(|_| stride >= N * size)
        };
        let bytes = bytes().ok_or_else(|| {
            let found = format!("{count} items of {} bytes do not lie in their buffer", N * size);
            error(found, "a range inside its bufferView and buffer, with at least one item")
        })?;
        let component = |bytes: &[u8]| {
            let mut word = [0; 4];
            word[..size].copy_from_slice(bytes);
            value(u32::from_le_bytes(word))
        };
        let item =
            |bytes: &[u8]| std::array::from_fn(|k| component(&bytes[k * size..(k + 1) * size]));
        Ok(bytes.chunks(stride).map(item).collect())
    }

    /// Returns the bytes of a buffer: the binary chunk, a data URL, or a file in the folder of the
    /// glTF file.
    fn buffer(&self, index: f64) -> Result<&[u8], AssetError> {
        let buffer = self.part(&self.document.buffers, "buffers", index)?;
        let error =
            |found: &str, expected| self.error(format_args!("buffers[{index}]"), found, expected);
        let Some(uri) = &buffer.uri else {
            return self
                .blob
                .ok_or_else(|| error("the buffer has no data", "a uri or a BIN chunk"));
        };
        let cell = &self.buffers[whole(index)];
        if let Some(bytes) = cell.get() {
            return Ok(bytes);
        }
        let bytes = if let Some(data) = uri.strip_prefix("data:") {
            let text = data.split_once(";base64,").map(|(_, text)| unescaped(text));
            let bytes = text.and_then(|text| BASE64.decode(text).ok());
            bytes.ok_or_else(|| error("the data is not base64", "base64"))?
        } else {
            let name = unescaped(uri);
            let path = self.source.resolve_relative(&String::from_utf8_lossy(&name));
            let path = path.ok_or_else(|| {
                let expected =
                    "a relative path without \"..\", to a file in the same folder or below";
                error(&format!("uri is \"{}\"", truncated(uri)), expected)
            })?;
            FileContents::read(&path, MAX_BYTES.saturating_sub(self.bytes_read.get()))?.bytes
        };
        self.bytes_read.set(self.bytes_read.get() + bytes.len() as u64);
        Ok(cell.get_or_init(|| bytes))
    }
}

/// Type of the numbers of an accessor.
struct Component {
    /// Size in bytes.
    size: usize,
    /// Number that stands for 1 if the accessor is normalised.
    one: f64,
    /// Returns the number with the given bits.
    value: fn(u32) -> f64,
}

impl Component {
    fn of(code: f64) -> Option<Self> {
        let (size, one, value): (_, _, fn(u32) -> f64) = match code as u32 {
            5120 => (1, 127.0, |bits| (bits as i8).into()),
            5121 => (1, 255.0, f64::from),
            5122 => (2, 32767.0, |bits| (bits as i16).into()),
            5123 => (2, 65535.0, f64::from),
            5125 => (4, 4_294_967_295.0, f64::from),
            5126 => (4, 1.0, |bits| f32::from_bits(bits).into()),
            _ => return None,
        };
        Some(Self { size, one, value })
    }
}

/// Returns the JSON chunk of a GLB file and its binary chunk, which it may lack.
fn chunks(source: &FileContents) -> Result<(&[u8], Option<&[u8]>), AssetError> {
    let word = |at: usize| source.bytes.get(at..)?.first_chunk().map(|b| u32::from_le_bytes(*b));
    // A chunk begins with its length and its name.
    let chunk = |at: usize, name: &[u8]| {
        let rest = source.bytes.get(at + 4..)?.strip_prefix(name)?;
        rest.get(..word(at)? as usize)
    };
    let json = chunk(12, b"JSON").filter(|_| word(4) == Some(2)).ok_or_else(|| {
        let found = "the version is not 2, or the chunk JSON is not complete";
        source.error(FileLocation::Byte(4), found, "a GLB file of version 2")
    })?;
    Ok((json, chunk(20 + json.len(), b"BIN\0")))
}

/// Returns `text` with its percent-encoded bytes decoded (RFC 3986).
fn unescaped(text: &str) -> Vec<u8> {
    let mut out = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((first, after)) = rest.split_first() {
        let digit = |i: usize| char::from(*after.get(i)?).to_digit(16);
        let code = digit(0).zip(digit(1)).filter(|_| *first == b'%');
        out.push(code.map_or(*first, |(high, low)| (16 * high + low) as u8));
        rest = if code.is_some() { &after[2..] } else { after };
    }
    out
}

/// Returns the triangles of a list, strip or fan with `corners` corners, each as the indices of its
/// three corners. The sense of rotation is reversed if the part is `mirrored`.
fn faces(mode: f64, corners: usize, mirrored: bool) -> impl ExactSizeIterator<Item = [usize; 3]> {
    let count = if mode == TRIANGLES { corners / 3 } else { corners.saturating_sub(2) };
    (0..count).map(move |i| {
        let [a, b, c] = match mode {
            STRIP => strip(i),
            FAN => [0, i + 1, i + 2],
            _ => [3 * i, 3 * i + 1, 3 * i + 2],
        };
        if mirrored { [a, c, b] } else { [a, b, c] }
    })
}

/// Part of a glTF scene: a primitive (a piece of a mesh) with the morph weights of its node.
struct Part<'a, 'b> {
    gltf: &'a Gltf<'b>,
    primitive: &'a Primitive,
    place: Arguments<'a>,
    weights: &'a [f64],
}

impl Part<'_, '_> {
    /// Adds vertices, colour and triangles of this part, placed by `map`. Leaves out points and
    /// lines.
    fn add(&self, builder: &mut Builder, map: DAffine3) -> Result<(), AssetError> {
        let Primitive { attributes, extensions, mode, indices, .. } = self.primitive;
        if extensions.draco.is_some() {
            let found = "the data is compressed (KHR_draco_mesh_compression)";
            return Err(self.gltf.error(self.place, found, "a file without compression"));
        }
        let mode = mode.unwrap_or(TRIANGLES);
        if ![TRIANGLES, STRIP, FAN].contains(&mode) {
            builder.note("points and lines were left out");
            return Ok(());
        }
        let positions = self.morphed("POSITION")?;
        let normals = self.morphed("NORMAL")?;
        if positions.is_empty() {
            builder.note("a part without positions was left out");
            return Ok(());
        }
        let uvs = self.gltf.attribute::<2>(attributes, "TEXCOORD_0")?;
        self.add_color(builder)?;
        let normal_map = map.matrix3.inverse().transpose();
        let is_mirrored = map.matrix3.determinant() < 0.0;
        builder.reserve(positions.len(), 0)?;
        let base = builder.vertices();
        for (i, position) in positions.into_iter().enumerate() {
            let normal = normals.get(i).map(|normal| {
                let normal = normal_map * DVec3::from(*normal);
                normal.normalize_or_zero().as_vec3().to_array()
            });
            // The texture coordinate v points downwards in glTF, and upwards in
            // [`TriangleMesh::uvs`].
            let uv = uvs.get(i).map(|[u, v]| [*u as f32, 1.0 - *v as f32]);
            builder.vertex(map.transform_point3(position.into()).to_array(), normal, uv);
        }
        let place = || FileLocation::Part(self.place.to_string());
        let corners: Vec<u32> = match indices {
            Some(accessor) => {
                let numbers = self.gltf.numbers::<1>(*accessor)?.into_iter();
                numbers.map(|[n]| builder.index(n, base, place)).collect::<Result<_, _>>()?
            }
            None => (base as u32..builder.vertices() as u32).collect(),
        };
        let faces = faces(mode, corners.len(), is_mirrored);
        builder.reserve(0, faces.len())?;
        faces.into_iter().try_for_each(|face| builder.triangle(face.map(|i| corners[i])))
    }

    /// Returns the attribute `name` with the sum of its morph targets, each with its weight.
    fn morphed(&self, name: &str) -> Result<Vec<[f64; 3]>, AssetError> {
        let mut values = self.gltf.attribute::<3>(&self.primitive.attributes, name)?;
        let targets = self.primitive.targets.iter().zip(self.weights);
        for (target, weight) in targets.filter(|(_, weight)| **weight != 0.0) {
            let shifts = self.gltf.attribute::<3>(target, name)?;
            for (value, shift) in values.as_flattened_mut().iter_mut().zip(shifts.as_flattened()) {
                *value += weight * shift;
            }
        }
        Ok(values)
    }

    /// Makes the base colour of this part the colour of the triangles that are added next. Notes
    /// other colours.
    fn add_color(&self, builder: &mut Builder) -> Result<(), AssetError> {
        if self.primitive.attributes.contains_key("COLOR_0") {
            builder.note("the colours of the vertices of a part were not read");
        }
        let material = match self.primitive.material {
            Some(index) => self.gltf.part(&self.gltf.document.materials, "materials", index)?,
            None => &Material::default(),
        };
        let surface = &material.pbr_metallic_roughness;
        if surface.base_color_texture.is_some() {
            builder.note("the base colour texture of a part was not read");
        }
        let [r, g, b, _] = surface.base_color_factor.unwrap_or([1.0; 4]);
        if ![r, g, b].iter().all(|x| (0.0..=1e6).contains(x)) {
            let found = "a base colour is not a colour";
            return Err(self.gltf.error(self.place, found, "numbers of at least 0"));
        }
        // Triangles without a stored colour are white.
        if [r, g, b] != [1.0; 3] || builder.has_colors() {
            builder.color([r, g, b])?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};
    use std::path::{Path, PathBuf};

    /// Bytes of a buffer, with accessors of its parts.
    #[derive(Default)]
    struct Parts {
        bytes: Vec<u8>,
        views: Vec<Value>,
        accessors: Vec<Value>,
    }

    impl Parts {
        /// Adds a view of `numbers` in the type `component`. Items begin on multiples of four bytes.
        fn view(&mut self, component: u32, items: &[&[f64]]) -> usize {
            let begin = self.bytes.len();
            for item in items {
                for x in *item {
                    match component {
                        5120 => self.bytes.extend((*x as i8).to_le_bytes()),
                        5121 => self.bytes.extend((*x as u8).to_le_bytes()),
                        5122 => self.bytes.extend((*x as i16).to_le_bytes()),
                        5123 => self.bytes.extend((*x as u16).to_le_bytes()),
                        5125 => self.bytes.extend((*x as u32).to_le_bytes()),
                        _ => self.bytes.extend((*x as f32).to_le_bytes()),
                    }
                }
                self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
            }
            let length = self.bytes.len() - begin;
            self.views.push(json!({"buffer": 0, "byteOffset": begin, "byteLength": length,
                                   "byteStride": length / items.len()}));
            self.views.len() - 1
        }

        fn accessor(&mut self, component: u32, items: &[&[f64]]) -> usize {
            let kind = ["SCALAR", "VEC2", "VEC3"][items[0].len() - 1];
            let view = self.view(component, items);
            self.accessors.push(json!({"bufferView": view, "componentType": component,
                                       "count": items.len(), "type": kind}));
            self.accessors.len() - 1
        }

        /// Returns a file with a node, its mesh and one primitive.
        fn file(&self, attributes: Value) -> Value {
            let data = BASE64.encode(&self.bytes);
            json!({
                "asset": {"version": "2.0"},
                "buffers": [{"byteLength": self.bytes.len(), "uri": format!("data:x/y;base64,{data}")}],
                "bufferViews": self.views,
                "accessors": self.accessors,
                "meshes": [{"primitives": [{"attributes": attributes, "mode": 6}]}],
                "nodes": [{"mesh": 0}],
                "scenes": [{"nodes": [0]}],
            })
        }
    }

    const SQUARE: [&[f64]; 4] = [&[0., 0., 0.], &[1., 0., 0.], &[1., 1., 0.], &[0., 1., 0.]];

    fn square() -> (Parts, Value) {
        let mut parts = Parts::default();
        parts.accessor(5126, &SQUARE);
        let file = parts.file(json!({"POSITION": 0}));
        (parts, file)
    }

    fn read_in(folder: &Path, file: &Value) -> Result<TriangleMesh, AssetError> {
        parse(&FileContents { path: folder.join("a.gltf"), bytes: file.to_string().into() })
    }

    fn read(file: &Value) -> TriangleMesh {
        read_in(Path::new("/nowhere"), file).unwrap_or_else(|e| panic!("{e}"))
    }

    fn refused(file: &Value) -> String {
        read_in(Path::new("/nowhere"), file).unwrap_err().to_string()
    }

    #[test]
    fn gltf_component_types_are_read() {
        let unscaled = [5120, 5121, 5122, 5123, 5125, 5126].map(|component| (component, 1.0));
        let normalized = [(5120, 127.0), (5121, 255.0), (5122, 32767.0), (5123, 65535.0)];
        for (component, one) in unscaled.into_iter().chain(normalized) {
            let scaled = SQUARE.map(|item| item.iter().map(|x| x * one).collect::<Vec<_>>());
            let flat = scaled.each_ref().map(|item| &item[..2]);
            let mut parts = Parts::default();
            parts.accessor(component, &scaled.each_ref().map(Vec::as_slice));
            parts.accessor(component, &flat);
            parts.accessor(component, &[&[0.0, 0.0, one] as &[f64]; 4]);
            parts.accessors.iter_mut().for_each(|a| a["normalized"] = json!(one > 1.0));
            let mut file = parts.file(json!({"POSITION": 0, "TEXCOORD_0": 1, "NORMAL": 2}));
            file["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
            let mesh = read(&file);
            assert_eq!(mesh.bounds, [[0.0; 3], [1.0, 1.0, 0.0]], "{component} {one}");
            assert_eq!(mesh.uvs.unwrap()[2], [1.0, 0.0], "{component} {one}");
            assert_eq!(mesh.normals.unwrap(), [[0.0, 0.0, 1.0]; 4], "{component} {one}");
        }
        for component in [5121, 5123, 5125] {
            let (mut parts, _) = square();
            let indices: [&[f64]; 6] = [&[0.0], &[1.0], &[2.0], &[0.0], &[2.0], &[3.0]];
            parts.accessor(component, &indices);
            let mut file = parts.file(json!({"POSITION": 0}));
            file["meshes"][0]["primitives"][0]["indices"] = json!(1.0);
            file["meshes"][0]["primitives"][0]["mode"] = json!(4);
            assert_eq!(read(&file).triangles, [[0, 1, 2], [0, 2, 3]], "{component}");
        }
        // The least integer of a signed type is -1, too.
        let mut parts = Parts::default();
        parts.accessor(5120, &[&[-128., -127., 0.], &[127., -127., 0.], &[0., 127., 0.]]);
        parts.accessors[0]["normalized"] = json!(true);
        assert_eq!(read(&parts.file(json!({"POSITION": 0}))).bounds[0], [-1.0, -1.0, 0.0]);
    }

    #[test]
    fn gltf_sparse_accessors_are_read() {
        for component in [5121, 5123, 5125] {
            let mut parts = Parts::default();
            parts.accessor(5126, &[SQUARE[0], &[9.0; 3], SQUARE[2], &[9.0; 3]]);
            let indices = parts.view(component, &[&[1.0], &[3.0]]);
            let values = parts.view(5126, &[SQUARE[1], SQUARE[3]]);
            let sparse = json!({"count": 2, "values": {"bufferView": values},
                                "indices": {"bufferView": indices, "componentType": component}});
            parts.accessors[0]["sparse"] = sparse;
            let mut file = parts.file(json!({"POSITION": 0}));
            assert_eq!(read(&file).bounds, [[0.0; 3], [1.0, 1.0, 0.0]], "{component}");
            // Without a view, the other elements are 0.
            file["accessors"][0].as_object_mut().unwrap().remove("bufferView");
            file["meshes"][0]["primitives"][0]["mode"] = json!(5);
            let mesh = read(&file);
            assert_eq!(mesh.positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3], [0.0, 1.0, 0.0]]);
            file["accessors"][0]["count"] = json!(3);
            assert!(refused(&file).contains("a sparse index is 3"), "{}", refused(&file));
            file["accessors"][0]["count"] = json!(5e8);
            assert!(refused(&file).contains("500000000 items without data"), "{}", refused(&file));
        }
    }

    #[test]
    fn gltf_parts_that_are_not_read_may_be_faulty() {
        let (_, file) = square();
        let expected = read(&file);
        for (pointer, value) in [
            ("/meshes/0/primitives/0/attributes/_FEATURE_ID_0", json!(77)),
            ("/meshes/0/primitives/0/attributes/TANGENT", json!(99)),
            ("/textures", json!([{"sampler": 5}])),
            ("/images", json!([{"uri": "../../secret.png"}])),
            ("/animations", json!([{"channels": [{"target": {}}], "samplers": []}])),
            ("/cameras", json!([{"type": "none"}])),
            ("/extensions", json!({"KHR_lights_punctual": {"lights": 3}})),
            ("/nodes/0/camera", json!(9)),
            ("/nodes/0/extras", json!({"a": [1]})),
            ("/materials", json!([{"alphaMode": "?", "normalTexture": {"index": 9}}])),
            ("/skins", json!([{"joints": [8]}])),
            ("/scene", json!(0.0)),
            ("/extensionsUsed", json!(["VENDOR_unknown"])),
        ] {
            let mut changed = file.clone();
            let (parent, key) = pointer.rsplit_once('/').unwrap();
            changed.pointer_mut(parent).unwrap()[key] = value;
            assert_eq!(read(&changed), expected, "{pointer}");
        }
        let mut changed = file.clone();
        for (list, part) in [
            ("accessors", json!({"bufferView": 9, "type": "VEC7"})),
            ("bufferViews", json!({"buffer": 7, "byteOffset": -1})),
            ("buffers", json!({"uri": "/missing.bin"})),
            ("meshes", json!({"primitives": [{"attributes": {"POSITION": 9}}]})),
        ] {
            changed[list].as_array_mut().unwrap().push(part);
        }
        assert_eq!(read(&changed), expected);
        let names = "KHR_materials_unlit KHR_texture_transform KHR_materials_variants \
                     KHR_texture_basisu EXT_texture_webp KHR_lights_punctual KHR_xmp_json_ld \
                     EXT_structural_metadata";
        for name in names.split(' ') {
            let mut changed = file.clone();
            changed["extensionsRequired"] = json!([name]);
            assert_eq!(read(&changed).notes, [format!("the extension {name} was not applied")]);
        }
    }

    #[test]
    fn gltf_buffer_names_are_percent_encoded() {
        let folder = tempfile::tempdir().unwrap();
        let (parts, mut file) = square();
        for (uri, name) in [
            ("m%C3%BC.bin", "m\u{fc}.bin"),
            ("a%281%29.bin", "a(1).bin"),
            ("a%23b%3F%26%2B.bin", "a#b?&+.bin"),
            ("100%.bin", "100%.bin"),
            ("a b%20c.bin", "a b c.bin"),
            ("x%2Fa.bin", "x/a.bin"),
        ] {
            std::fs::create_dir_all(folder.path().join("x")).unwrap();
            std::fs::write(folder.path().join(name), &parts.bytes).unwrap();
            file["buffers"][0]["uri"] = json!(uri);
            let mesh = read_in(folder.path(), &file).unwrap_or_else(|e| panic!("{uri}: {e}"));
            assert_eq!(mesh.triangles.len(), 2);
        }
        for uri in
            ["..%2Fa.bin", "%2E%2E/a.bin", "%2Fetc%2Fpasswd", "x%2F..%2F..%2Fa", "http%3A//a"]
        {
            file["buffers"][0]["uri"] = json!(uri);
            let error = read_in(folder.path(), &file).unwrap_err();
            assert!(error.expected.contains("in the same folder"), "{error}");
        }
        let data = BASE64.encode(&parts.bytes).replace('=', "").replace('A', "%41");
        file["buffers"][0]["uri"] = json!(format!("data:;base64,{data}"));
        assert_eq!(read(&file).triangles.len(), 2);
    }

    #[test]
    fn gltf_errors_and_notes_name_the_part() {
        let (_, file) = square();
        let draco = json!({"KHR_draco_mesh_compression": {"bufferView": 0}});
        let is_draco = "[0].primitives[0]: the data is compressed (KHR_draco_mesh_compression)";
        let is_meshopt = "bufferViews[0]: the data is compressed (EXT_meshopt_compression)";
        let is_vec2 = "accessors[0]: the type is \"VEC2\". Expected VEC3";
        for (pointer, value, words) in [
            ("/asset/version", json!("1.0"), "asset.version: the version is"),
            ("/extensionsRequired", json!(["VENDOR_x"]), "requires the extension \"VENDOR_x\""),
            ("/bufferViews/0/extensions", json!({"EXT_meshopt_compression": {}}), is_meshopt),
            ("/bufferViews/0/extensions", json!({"KHR_meshopt_compression": {}}), is_meshopt),
            ("/meshes/0/primitives/0/extensions", draco, is_draco),
            ("/meshes/0/primitives/0/attributes/POSITION", json!(7), "accessors[7]: the file"),
            ("/meshes/0/primitives/0/indices", json!(-1), "accessors[-1]"),
            ("/nodes/0/mesh", json!(1), "meshes[1]"),
            ("/nodes/0/mesh", json!("x"), "invalid type"),
            ("/nodes/0/children", json!([0]), "two parents"),
            ("/nodes/0/scale", json!([1e300, 1e300, 1]), "a vertex lies at"),
            ("/scenes/0/nodes", json!([4]), "nodes[4]"),
            ("/accessors/0/type", json!("VEC2"), is_vec2),
            ("/accessors/0/componentType", json!(5130), "a componentType is 5130"),
            ("/accessors/0/count", json!(1e6), "do not lie in their buffer"),
            ("/accessors/0/count", json!(1e15), "more than 2^29 numbers"),
            ("/accessors/0/count", json!(0), "do not lie in their buffer"),
            ("/accessors/0/byteOffset", json!(1.5), "do not lie in their buffer"),
            ("/bufferViews/0/byteStride", json!(2), "do not lie in their buffer"),
            ("/bufferViews/0/byteLength", json!(-4), "do not lie in their buffer"),
            ("/buffers/0/uri", json!("data:x;base64,A"), "not base64"),
            ("/buffers/0", json!({}), "no data"),
            ("/meshes/0/primitives/0/attributes", json!({}), "no triangles"),
        ] {
            let mut changed = file.clone();
            let (parent, key) = pointer.rsplit_once('/').unwrap();
            let parent = changed.pointer_mut(parent).unwrap();
            match parent.as_array_mut() {
                Some(list) => list[key.parse::<usize>().unwrap()] = value,
                None => parent[key] = value,
            }
            let error = match read_in(Path::new("/nowhere"), &changed) {
                Err(error) => error.to_string(),
                Ok(mesh) => format!("accepted: {mesh:?}"),
            };
            assert!(error.contains(words), "{pointer}: {error}");
        }
        let mut file = file;
        file["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(0);
        file["meshes"][0]["primitives"][0]["material"] = json!(0);
        let texture = json!({"baseColorTexture": {"index": 0}, "baseColorFactor": [0.5, 0, 0, 1]});
        file["materials"] = json!([{"pbrMetallicRoughness": texture}]);
        file["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": 9}});
        file["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
        let copy = file["meshes"][0]["primitives"][0].clone();
        file["meshes"][0]["primitives"].as_array_mut().unwrap().push(copy);
        file["meshes"][0]["primitives"].as_array_mut().unwrap().push(json!({"mode": 1}));
        let mesh = read(&file);
        assert_eq!(mesh.color(0), Some([0.5, 0.0, 0.0]));
        assert_eq!(
            mesh.notes,
            [
                "the instances of a node were not read",
                "the colours of the vertices of a part were not read (2 times)",
                "the base colour texture of a part was not read (2 times)",
                "points and lines were left out",
                "a triangle that equals another one was left out (2 times)"
            ]
        );
    }

    #[test]
    fn gltf_morph_weights_are_applied_and_skins_noted() {
        let (mut parts, _) = square();
        let shift = parts.accessor(5126, &SQUARE);
        let mut file = parts.file(json!({"POSITION": 0}));
        file["nodes"][0]["translation"] = json!([0, 7, 0]);
        assert_eq!(read(&file).bounds, [[0.0, 7.0, 0.0], [1.0, 8.0, 0.0]]);
        let mut with_skin = file.clone();
        with_skin["nodes"][0]["skin"] = json!(0);
        let mesh = read(&with_skin);
        assert_eq!(mesh.bounds, [[0.0; 3], [1.0, 1.0, 0.0]]);
        assert_eq!(mesh.notes, ["the joints of a skin were not read"]);
        file["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": shift}]);
        for (list, weight, size) in
            [("meshes", 0.0, 1.0), ("meshes", 0.5, 1.5), ("nodes", 1.0, 2.0)]
        {
            file[list][0]["weights"] = json!([weight]);
            assert_eq!(read(&file).bounds, [[0.0, 7.0, 0.0], [size, 7.0 + size, 0.0]], "{list}");
        }
    }

    #[test]
    fn gltf_parts_without_normals_are_flat() {
        let (mut parts, file) = square();
        assert!(read(&file).is_flat && read(&file).normals.is_none());
        // Two triangles that share a side, bent there, and a part with normals.
        let bent = parts.accessor(
            5126,
            &[&[0., 0., 2.] as &[f64], &[1., 0., 2.], &[1., 1., 2.], &[0., 1., 3.]],
        );
        let normals = parts.accessor(5126, &[&[1.0, 0.0, 0.0] as &[f64]; 4]);
        let mut file = parts.file(json!({"POSITION": bent, "TEXCOORD_1": 99}));
        let with_normals = json!({"attributes": {"POSITION": 0, "NORMAL": normals}, "mode": 6});
        file["meshes"][0]["primitives"].as_array_mut().unwrap().push(with_normals);
        let mesh = read(&file);
        assert_eq!(mesh.notes, [] as [String; 0]);
        let found = mesh.normals.as_ref().unwrap();
        let of = |t: usize| mesh.triangles[t].map(|i| found[i as usize]);
        assert_eq!(of(0), [[0.0, 0.0, 1.0]; 3]);
        assert!(of(1).iter().all(|n| *n == of(1)[0] && n[2] < 0.8), "{:?}", of(1));
        assert_eq!([of(2), of(3)], [[[1.0, 0.0, 0.0]; 3]; 2]);
    }

    #[test]
    fn gltf_binary_files_are_read() {
        let (parts, mut file) = square();
        file["buffers"][0].as_object_mut().unwrap().remove("uri");
        let chunk =
            |name: &[u8], data: &[u8]| [&(data.len() as u32).to_le_bytes(), name, data].concat();
        let json = file.to_string().into_bytes();
        let glb =
            [b"glTF\x02\0\0\0\0\0\0\0", &chunk(b"JSON", &json)[..], &chunk(b"BIN\0", &parts.bytes)]
                .concat();
        let read = |bytes: &[u8]| {
            parse(&FileContents { path: PathBuf::from("a.glb"), bytes: bytes.to_vec() })
        };
        assert_eq!(read(&glb).unwrap().triangles.len(), 2);
        assert!(read(&glb[..glb.len() - 1]).unwrap_err().found.contains("no data"));
        for end in [0, 4, 11, 19, 40] {
            assert!(read(&glb[..end]).is_err());
        }
        let mut old = glb;
        old[4] = 1;
        assert!(read(&old).unwrap_err().found.contains("version"));
    }
}
