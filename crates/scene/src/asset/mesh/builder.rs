//! Builder of meshes. The parser of a file format adds vertices and triangles to it. The builder
//! then checks them, and removes triangles without area and all but one of equal triangles.

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::file::FileContents;
use crate::asset::mesh::{MAX_TRIANGLES, MAX_VERTICES, polygon};
use crate::process_memory::missing_memory;
use glam::DVec3;
use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet, TryReserveError};
use zerkalo_kernel::primitive::TriangleMesh;

/// Largest absolute value of a mesh coordinate.
pub const MAX_COORDINATE: f64 = 1e9;

/// Smallest valid extent of a mesh (length of the longest side of its bounding box). Products of
/// three coordinates of this magnitude are not subnormal in single precision.
const MIN_EXTENT: f64 = 1e-9;

/// Largest ratio of a mesh's largest absolute coordinate to its extent for which the positions are
/// stored relative to the origin. Above it, they are stored relative to the centre of the mesh. At
/// this ratio, single precision resolves the mesh with four bits less than if it were centred at
/// the origin.
const MAX_OFFSET: f64 = 16.0;

/// Mesh under construction, to which the parser of a file format adds vertices and triangles.
pub struct Builder<'a> {
    source: &'a FileContents,
    positions: Vec<[f64; 3]>,
    /// Normals of the vertices, in order. The list may be shorter than `positions`. The zero vector
    /// means that the file has no normal for the vertex.
    normals: Vec<[f32; 3]>,
    /// `true` if triangles without normals are flat by the rules of the format.
    pub is_flat: bool,
    /// Texture coordinates of the vertices, in order. The list may be shorter than `positions`; the
    /// other vertices have no texture coordinates.
    uvs: Vec<[f32; 2]>,
    /// Copies of vertices, by vertex and bits of the texture coordinates.
    with_uvs: HashMap<(u32, [u32; 2]), u32>,
    triangles: Vec<[u32; 3]>,
    colors: Vec<[f32; 3]>,
    /// Index in `colors` of each colour, by its bits.
    color_indices: HashMap<[u32; 3], u16>,
    /// Index in `colors` of the colour of each triangle; 0 for triangles added before the first
    /// call of [`Builder::color`].
    color_of: Vec<u16>,
    /// Index in `colors` of the colour of the triangles added next.
    color: u16,
    /// Notes for the user, and how often each occurred.
    notes: Vec<(String, usize)>,
}

/// Largest number of different notes. Further ones are ignored.
const MAX_NOTES: usize = 32;

/// Memory of a vertex in bytes: position in both precisions, normal and texture coordinates.
const VERTEX_BYTES: u64 = 56;
/// Memory of a triangle in bytes: corners, colour and the counters of equal triangles.
const TRIANGLE_BYTES: u64 = 32;

/// Memory \[bytes\] that is allocated without a check.
const UNCHECKED_BYTES: u64 = 1 << 20;

impl<'a> Builder<'a> {
    /// Creates a builder without vertices. `source` is the mesh file, which error messages name.
    pub fn new(source: &'a FileContents) -> Self {
        Self {
            source,
            positions: Vec::new(),
            normals: Vec::new(),
            is_flat: false,
            uvs: Vec::new(),
            with_uvs: HashMap::new(),
            triangles: Vec::new(),
            colors: Vec::new(),
            color_indices: HashMap::new(),
            color_of: Vec::new(),
            color: 0,
            notes: Vec::new(),
        }
    }

    /// Reserves memory for the given numbers of further vertices and triangles. The caller must
    /// check before that the file is long enough for them.
    pub fn reserve(&mut self, vertices: usize, triangles: usize) -> Result<(), AssetError> {
        self.check_limits(vertices, triangles)?;
        // New capacity of a list that must grow; the old list exists beside the new one.
        let grown = |[length, more, capacity]: [usize; 3]| match length + more {
            needed if needed <= capacity => 0,
            needed => needed.max(2 * capacity) as u64,
        };
        let grown_vertices = grown([self.positions.len(), vertices, self.positions.capacity()]);
        let grown_triangles = grown([self.triangles.len(), triangles, self.triangles.capacity()]);
        let bytes = VERTEX_BYTES * grown_vertices + TRIANGLE_BYTES * grown_triangles;
        if bytes > UNCHECKED_BYTES
            && let Some(missing) = missing_memory(bytes)
        {
            let found = format!("the mesh of {} vertices or more {missing}", self.positions.len());
            return Err(self.source.fault(found, "a smaller mesh, or more free memory"));
        }
        let reserved = self.positions.try_reserve(vertices);
        let reserved = reserved.and_then(|()| self.triangles.try_reserve(triangles));
        self.allocated(reserved)
    }

    /// Converts the result of an allocation.
    pub fn allocated(&self, result: Result<(), TryReserveError>) -> Result<(), AssetError> {
        let found = "there is no memory for more vertices and triangles";
        result.map_err(|_| self.source.fault(found, "a smaller mesh, or more free memory"))
    }

    /// Fails if the mesh, with `vertices` and `triangles` added to those it has, exceeds its limits.
    fn check_limits(&self, vertices: usize, triangles: usize) -> Result<(), AssetError> {
        let checks = [
            (self.positions.len().saturating_add(vertices), MAX_VERTICES, "vertices"),
            (self.triangles.len().saturating_add(triangles), MAX_TRIANGLES, "triangles"),
        ];
        for (count, max, noun) in checks {
            if count > max {
                let found = format!("the mesh has {count} {noun}");
                let expected = format!("at most {max}");
                return Err(self.source.fault(found, &expected));
            }
        }
        Ok(())
    }

    /// Records a note for the user about a part of the file that was omitted or replaced.
    /// Repetitions are counted.
    pub fn note(&mut self, note: impl Into<String>) {
        self.note_times(note.into(), 1);
    }

    fn note_times(&mut self, note: String, times: usize) {
        if let Some((_, count)) = self.notes.iter_mut().find(|(known, _)| *known == note) {
            *count += times;
        } else if times > 0 && self.notes.len() < MAX_NOTES {
            self.notes.push((note, times));
        }
    }

    /// Returns the number of vertices added so far.
    pub fn vertices(&self) -> usize {
        self.positions.len()
    }

    /// Adds a vertex, and returns its index. This method does not check the number of vertices;
    /// [`Builder::finish`] fails if there are more than [`MAX_VERTICES`].
    pub fn vertex(
        &mut self,
        position: [f64; 3],
        normal: Option<[f32; 3]>,
        uv: Option<[f32; 2]>,
    ) -> u32 {
        let index = self.positions.len();
        self.positions.push(position);
        if let Some(normal) = normal {
            self.normals.resize(index, [0.0; 3]);
            self.normals.push(normal);
        }
        if let Some(uv) = uv {
            self.uvs.resize(index, [0.0; 2]);
            self.uvs.push(uv);
        }
        index as u32
    }

    /// Returns a vertex like `vertex`, but with the texture coordinates `uv`.
    pub fn with_uv(&mut self, vertex: u32, uv: [f32; 2]) -> Result<u32, AssetError> {
        let key = (vertex, uv.map(f32::to_bits));
        if let Some(known) = self.with_uvs.get(&key) {
            return Ok(*known);
        }
        self.reserve(1, 0)?;
        let reserved = self.with_uvs.try_reserve(1);
        self.allocated(reserved)?;
        let i = vertex as usize;
        let copy = self.vertex(self.positions[i], self.normals.get(i).copied(), Some(uv));
        self.with_uvs.insert(key, copy);
        Ok(copy)
    }

    /// Returns `true` if [`Builder::color`] was called.
    pub fn has_colors(&self) -> bool {
        !self.colors.is_empty()
    }

    /// Sets the linear base colour of the triangles added from now on. Triangles added before the
    /// first call are white.
    pub fn color(&mut self, color: [f32; 3]) -> Result<(), AssetError> {
        let is_late = self.colors.is_empty() && !self.triangles.is_empty();
        for color in is_late.then_some([1.0; 3]).into_iter().chain([color]) {
            let next = u16::try_from(self.colors.len());
            self.color = match self.color_indices.entry(color.map(f32::to_bits)) {
                Entry::Occupied(known) => *known.get(),
                Entry::Vacant(entry) => {
                    let found = "the mesh has more than 65536 different colours";
                    let next = next.map_err(|_| self.source.fault(found, "at most 65536"))?;
                    self.colors.push(color);
                    *entry.insert(next)
                }
            };
        }
        Ok(())
    }

    /// Adds a triangle of three vertices.
    pub fn triangle(&mut self, corners: [u32; 3]) -> Result<(), AssetError> {
        self.reserve(0, 1)?;
        self.triangles.push(corners);
        self.color_of.push(self.color);
        Ok(())
    }

    /// Returns the vertex that `number` names, counted from the vertex `first`.
    pub fn index(
        &self,
        number: f64,
        first: usize,
        place: impl Fn() -> FileLocation,
    ) -> Result<u32, AssetError> {
        let count = self.positions.len() - first;
        if (0.0..count as f64).contains(&number) {
            return Ok((first + number as usize) as u32);
        }
        let found = format!("the face names vertex {number}, counted from 0");
        let expected = format!("a vertex below {count}, their number");
        Err(self.source.error(place(), found, &expected))
    }

    /// Adds a polygon of any shape in a plane as triangles.
    pub fn polygon(&mut self, corners: &[u32]) -> Result<(), AssetError> {
        if corners.len() < 3 {
            self.note("a face of fewer than three corners was left out");
            return Ok(());
        }
        let is_long = corners.len() > polygon::MAX_CORNERS;
        let position = |i: &u32| DVec3::from(self.positions[*i as usize]);
        let division = match corners.len() == 3 || is_long {
            true => None,
            false => polygon::divide(&corners.iter().map(position).collect::<Vec<_>>()),
        };
        if is_long || division.as_ref().is_some_and(|division| !division.is_exact) {
            self.note("a polygon whose outline crosses itself or is too long is uncertain");
        }
        match division {
            Some(division) => division
                .triangles
                .into_iter()
                .try_for_each(|triangle| self.triangle(triangle.map(|i| corners[i]))),
            None => corners[1..]
                .windows(2)
                .try_for_each(|pair| self.triangle([corners[0], pair[0], pair[1]])),
        }
    }

    /// Checks the mesh and returns it as a [`TriangleMesh`], without the triangles whose area is 0
    /// or that equal another one.
    pub fn finish(mut self) -> Result<TriangleMesh, AssetError> {
        self.check_limits(0, 0)?;
        let source = self.source;
        if self.triangles.is_empty() {
            return Err(source.fault("the mesh has no triangles", "at least one"));
        }
        self.coordinates()?;
        let center = self.center().to_array();
        let mut positions: Vec<[f32; 3]> = self
            .positions
            .drain(..)
            .map(|p| std::array::from_fn(|i| (p[i] - center[i]) as f32))
            .collect();
        self.positions = Vec::new();
        self.drop_flat(&positions)?;
        self.drop_equal(&positions);
        let corners = self.triangles.iter().flatten().map(|i| positions[*i as usize]);
        let [low, high] = bounds(corners.map(|p| p.map(f64::from)));
        let extent = (high - low).max_element();
        if extent < MIN_EXTENT {
            let found = format!("the mesh is {extent:e} large");
            return Err(source.fault(found, "a size from 1e-9 to 1e9"));
        }
        let mut uvs = self.checked_uvs(positions.len());
        let normals = self.unit_normals(&mut positions, &mut uvs);
        self.triangles.shrink_to_fit();
        let color_of = if self.colors.len() > 1 { self.color_of } else { Vec::new() };
        Ok(TriangleMesh {
            positions,
            center,
            triangles: self.triangles,
            normals,
            is_flat: self.is_flat,
            uvs,
            colors: self.colors,
            color_of,
            bounds: [low, high].map(|corner| corner.as_vec3().to_array()),
            notes: self.notes.into_iter().map(counted).collect(),
        })
    }

    /// Checks that all coordinates are finite and within ±[`MAX_COORDINATE`].
    fn coordinates(&self) -> Result<(), AssetError> {
        let bad = |p: &[f64; 3]| p.iter().any(|x| !(-MAX_COORDINATE..=MAX_COORDINATE).contains(x));
        let Some(i) = self.positions.iter().position(bad) else { return Ok(()) };
        let [x, y, z] = self.positions[i];
        let place = FileLocation::Part(format!("vertex {i} (from 0)"));
        let found = format!("a vertex lies at [{x}, {y}, {z}]");
        Err(self.source.error(place, found, "coordinates from -1e9 to 1e9"))
    }

    /// Returns the point that is subtracted from all positions before they are converted to single
    /// precision. This point is the centre of the bounding box if the mesh is far from the origin
    /// relative to its size, otherwise the origin.
    fn center(&self) -> DVec3 {
        let [low, high] = bounds(self.positions.iter().copied());
        let max_coordinate = low.abs().max(high.abs()).max_element();
        let is_far = max_coordinate > MAX_OFFSET * (high - low).max_element();
        if is_far { 0.5 * (low + high) } else { DVec3::ZERO }
    }

    /// Removes triangles whose area is 0.
    fn drop_flat(&mut self, positions: &[[f32; 3]]) -> Result<(), AssetError> {
        let before = self.triangles.len();
        let has_area = |t: &[u32; 3]| {
            let p = t.map(|i| DVec3::from(positions[i as usize].map(f64::from)));
            (p[1] - p[0]).cross(p[2] - p[0]) != DVec3::ZERO
        };
        let keep = self.triangles.iter().map(has_area).collect();
        self.retain(keep, "a triangle without area was left out");
        if self.triangles.is_empty() {
            let found = format!("none of the {before} triangles has an area");
            return Err(self.source.fault(found, "at least one that has"));
        }
        Ok(())
    }

    /// Removes triangles whose corners are those of an earlier one, in the same sense of rotation.
    /// No hierarchy can divide equal triangles: each ray would test them all.
    fn drop_equal(&mut self, positions: &[[f32; 3]]) {
        let corners = |t: &[u32; 3]| {
            // Negative zeros equal positive ones.
            let mut corners = t.map(|i| positions[i as usize].map(|x| (x + 0.0).to_bits()));
            let least = (0..3).min_by_key(|i| corners[*i]).unwrap_or(0);
            corners.rotate_left(least);
            corners
        };
        let hash = |corners: &[[u32; 3]; 3]| {
            corners.as_flattened().iter().fold(0, |hash: u64, bits| {
                (hash.rotate_left(5) ^ u64::from(*bits)).wrapping_mul(0x9e37_79b9_7f4a_7c15)
            })
        };
        // Most meshes have no equal triangles. Only those of hashes that occur twice are compared.
        let slots = 8 * self.triangles.len().next_power_of_two();
        let slot = |t: &[u32; 3]| (hash(&corners(t)) >> (64 - slots.ilog2())) as usize;
        let mut count = vec![0_u8; slots];
        for slot in self.triangles.iter().map(slot) {
            count[slot] = count[slot].saturating_add(1);
        }
        let mut first = HashSet::new();
        let keep = |t: &[u32; 3]| count[slot(t)] == 1 || first.insert(corners(t));
        let keep = self.triangles.iter().map(keep).collect();
        self.retain(keep, "a triangle that equals another one was left out");
    }

    /// Keeps the triangles for which `keep` has `true`, and notes the number of the others.
    fn retain(&mut self, keep: Vec<bool>, note: &str) {
        let dropped = keep.iter().filter(|keep| !**keep).count();
        if dropped > 0 {
            let [mut of_triangle, mut of_color] = [keep.iter(), keep.iter()];
            self.triangles.retain(|_| of_triangle.next() == Some(&true));
            self.color_of.retain(|_| of_color.next() == Some(&true));
            self.note_times(note.to_string(), dropped);
        }
    }

    /// Returns a unit normal for each vertex; `None` if no vertex has a normal in the file. Corners
    /// of triangles that have no normal become vertices with the normal of their triangle.
    fn unit_normals(
        &mut self,
        positions: &mut Vec<[f32; 3]>,
        uvs: &mut Option<Vec<[f32; 2]>>,
    ) -> Option<Vec<[f32; 3]>> {
        const MISSING: [f32; 3] = [0.0; 3];
        let unit = |v: DVec3| v.normalize_or_zero().as_vec3().to_array();
        let normals = std::mem::take(&mut self.normals);
        let normals = normals.into_iter().map(|n| unit(DVec3::from(n.map(f64::from))));
        let mut normals: Vec<_> = normals.collect();
        let vertices = positions.len();
        normals.resize(vertices, MISSING);
        if normals.iter().all(|n| *n == MISSING) {
            return None;
        }
        for triangle in &mut self.triangles {
            let [a, b, c] = triangle.map(|i| DVec3::from(positions[i as usize].map(f64::from)));
            for vertex in triangle {
                let i = *vertex as usize;
                if normals[i] != MISSING {
                    continue;
                }
                *vertex = positions.len() as u32;
                positions.push(positions[i]);
                normals.push(unit((b - a).cross(c - a)));
                uvs.iter_mut().for_each(|uvs| uvs.push(uvs[i]));
            }
        }
        if !self.is_flat {
            let computed = normals.len() - vertices;
            self.note_times("a normal that is missing was computed".to_string(), computed);
        }
        Some(normals)
    }

    /// Returns the texture coordinates of the vertices. Vertices without texture coordinates, or
    /// with infinite ones or NaN, get zero. Returns `None` if no vertex has any.
    fn checked_uvs(&mut self, vertices: usize) -> Option<Vec<[f32; 2]>> {
        let mut uvs = std::mem::take(&mut self.uvs);
        if uvs.is_empty() {
            return None;
        }
        let unknown = uvs.iter_mut().filter(|uv| !uv.iter().all(|x| x.is_finite()));
        let unknown = unknown.map(|uv| *uv = [0.0; 2]).count();
        let note = "texture coordinates that are no numbers were replaced by 0".to_string();
        self.note_times(note, unknown);
        uvs.resize(vertices, [0.0; 2]);
        Some(uvs)
    }
}

/// Returns a note with the number of its occurrences.
fn counted((note, count): (String, usize)) -> String {
    if count == 1 { note } else { format!("{note} ({count} times)") }
}

/// Returns the lowest and the highest corner of the bounding box.
fn bounds(positions: impl Iterator<Item = [f64; 3]>) -> [DVec3; 2] {
    positions
        .map(DVec3::from_array)
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
}
