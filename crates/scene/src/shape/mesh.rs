//! Triangle meshes from files.

use crate::asset::{AssetError, Loaded};
use crate::shape::{Shape, ShapeDesc};
use crate::value::{choices, description};
use glam::{DAffine3, DVec3};
use std::sync::{Arc, LazyLock};
use zerkalo_kernel::primitive::{Form, Mesh, MeshForm, TriangleMesh};

description! {
    /// Triangles from a file: OBJ (with the colours of its MTL), PLY, STL, glTF or GLB. Placed by
    /// `transform`. The front of a triangle is the side from which its corners are in
    /// counter-clockwise order; the back is lit if the material is two-sided.
    pub struct MeshDesc {
        /// Name of the file, relative to the folder of the scene file. Empty: an icosahedron.
        file: String = "";
        /// Normals used for shading: curved triangles or flat ones.
        normals: Normals = "smooth";
        loads content: Loaded<Mesh>;
        example "shape.mesh = { file = \"scenes/meshes/knot.ply\", normals = \"smooth\" }";
    }
}

choices! {
    /// Kind of the shading normals of a mesh.
    pub enum Normals {
        /// normals of the vertices, interpolated: those of the file, else the means of the adjacent
        /// triangles
        Smooth = "smooth",
        /// normal of each triangle, without interpolation
        Flat = "flat",
    }
}

/// Placeholder mesh: an icosahedron of height 1 that stands on the origin.
static PLACEHOLDER: LazyLock<Arc<Mesh>> = LazyLock::new(|| {
    let golden = 0.5 * (1.0 + 5.0f64.sqrt());
    let mut corners = Vec::new();
    for axis in 0..3 {
        for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
            let mut corner = [0.0; 3];
            (corner[axis], corner[(axis + 1) % 3]) = (a, b);
            corners.push(DVec3::from(corner));
        }
    }
    // The edges have the squared length 4; all other squared distances of corners are above 10.
    let near = |a: usize, b: usize| corners[a].distance_squared(corners[b]) < 4.1;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in (a + 1..12).filter(|b| near(a, *b)) {
            for c in (b + 1..12).filter(|c| near(a, *c) && near(b, *c)) {
                let [p, q, r] = [a, b, c].map(|i| corners[i]);
                let outward = (q - p).cross(r - p).dot(p) > 0.0;
                triangles.push(if outward { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
            }
        }
    }
    let place = |corner: &DVec3| *corner * (0.5 / golden) + DVec3::Y * 0.5;
    let positions: Vec<_> =
        corners.iter().map(|corner| place(corner).to_array().map(|x| x as f32)).collect();
    let bound = |pick: fn(f32, f32) -> f32| {
        [0, 1, 2].map(|axis| positions.iter().map(|p| p[axis]).fold(positions[0][axis], pick))
    };
    Arc::new(Mesh::new(TriangleMesh {
        bounds: [bound(f32::min), bound(f32::max)],
        positions,
        center: [0.0; 3],
        triangles,
        normals: None,
        uvs: None,
        colors: Vec::new(),
        color_of: Vec::new(),
        notes: Vec::new(),
    }))
});

impl MeshDesc {
    /// Returns the mesh of the file, or the placeholder if no mesh was read.
    fn mesh(&self) -> &Arc<Mesh> {
        self.content.content().unwrap_or(&PLACEHOLDER)
    }
}

impl ShapeDesc for MeshDesc {
    fn form(&self) -> Form {
        let mesh = self.mesh().clone();
        Form::Mesh(MeshForm {
            scene_from_mesh: DAffine3::from_translation(mesh.mesh.center.into()),
            smooth: self.normals == Normals::Smooth,
            mesh,
        })
    }
}

impl Shape {
    /// Reads, by `load`, the mesh file that the shape names, unless it is loaded already.
    pub fn resolve(&mut self, load: impl Fn(&str) -> Result<Arc<Mesh>, AssetError>) {
        if let Self::MeshDesc(mesh) = self {
            mesh.content.resolve(&mesh.file, load);
        }
    }

    /// Returns the mesh file that the shape names; `None` if the shape is not a mesh or names no
    /// file.
    pub fn file(&self) -> Option<&str> {
        let Self::MeshDesc(mesh) = self else { return None };
        Some(mesh.file.as_str()).filter(|file| !file.is_empty())
    }

    /// Returns the mesh that was read from the file; `None` if there is only a placeholder.
    pub fn mesh(&self) -> Option<&Arc<Mesh>> {
        let Self::MeshDesc(mesh) = self else { return None };
        mesh.content.content()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placeholder_is_icosahedron_on_origin() {
        let mesh = &PLACEHOLDER.mesh;
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (12, 20));
        let form = MeshDesc::default().form();
        let (low, high) = form.bounds().unwrap();
        assert!((low - DVec3::new(-0.5, 0.0, -0.5)).length() < 1e-6, "{low}");
        assert!((high - DVec3::new(0.5, 1.0, 0.5)).length() < 1e-6, "{high}");
        // All corners are at the same distance from the centre, and all fronts face outwards.
        let point =
            |i: u32| DVec3::from(mesh.positions[i as usize].map(f64::from)) - DVec3::Y * 0.5;
        for t in &mesh.triangles {
            let [a, b, c] = t.map(point);
            assert!((b - a).cross(c - a).dot(a) > 0.0);
            assert!((a.length() - point(0).length()).abs() < 1e-6);
        }
    }
}
