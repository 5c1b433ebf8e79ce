//! Triangle meshes from files.

use crate::asset::{CREASE_ANGLE, FileContents, Loaded, Reading, parse_mesh};
use crate::shape::{Shape, ShapeDesc};
use crate::value::{choices, description};
use glam::DAffine3;
use std::sync::{Arc, LazyLock};
use zerkalo_kernel::primitive::{Form, Mesh, MeshForm, MeshNormals};

description! {
    /// Triangles from a file: OBJ (with the colours of its MTL), PLY, STL, glTF or GLB. Placed by
    /// `transform`. The front of a triangle is the side from which its corners are in
    /// counter-clockwise order; the back is lit if the material is two-sided.
    pub struct MeshDesc {
        /// Name of the file, relative to the folder of the scene file. Empty: an icosahedron.
        file: String = "";
        /// Normals used for shading: curved triangles or flat ones.
        normals: Normals = "auto";
        /// Largest angle between two triangles that "auto" shades as one curved surface. If it is
        /// given, normals in the file are not used.
        crease_angle: Option<f64>, or "normals of the file, else 40, in glTF 0", in closed(0.0, 180.0) "degrees";
        loads content: Loaded<Mesh>;
        example "shape.mesh = { file = \"scenes/meshes/knot.ply\", normals = \"auto\", crease_angle = 50.0 }";
    }
}

choices! {
    /// Kind of the shading normals of a mesh.
    pub enum Normals {
        /// those of the file, else smooth with creases at sharp edges; glTF without normals is flat
        Auto = "auto",
        /// normals of the vertices, interpolated: those of the file, else the means of the adjacent
        /// triangles
        Smooth = "smooth",
        /// normal of each triangle, without interpolation
        Flat = "flat",
    }
}

/// Placeholder mesh: an icosahedron of height 1 that stands on the origin.
static PLACEHOLDER: LazyLock<Arc<Mesh>> = LazyLock::new(|| {
    let bytes = include_bytes!("icosahedron.obj").to_vec();
    let mesh = parse_mesh(&FileContents { path: "icosahedron.obj".into(), bytes });
    Arc::new(Mesh::new(mesh.expect("a valid mesh")))
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
        let in_file = mesh.mesh.normals.is_some();
        let normals = match (self.normals, self.crease_angle) {
            (Normals::Flat, _) => MeshNormals::Flat,
            (Normals::Auto, Some(degrees)) => MeshNormals::Creased(degrees),
            (Normals::Auto | Normals::Smooth, _) if in_file => MeshNormals::OfVertices,
            (Normals::Smooth, _) => MeshNormals::Creased(180.0),
            (Normals::Auto, None) if mesh.mesh.is_flat => MeshNormals::Flat,
            (Normals::Auto, None) => MeshNormals::Creased(CREASE_ANGLE),
        };
        Form::Mesh(MeshForm {
            scene_from_mesh: DAffine3::from_translation(mesh.mesh.center.into()),
            normals,
            mesh,
        })
    }
}

impl Shape {
    /// Reads, by `load`, the mesh file that the shape names, unless it is loaded already.
    pub fn resolve(&mut self, load: impl Fn(&str) -> Reading<Mesh>) {
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
    use glam::DVec3;

    #[test]
    fn placeholder_is_icosahedron_on_origin() {
        let mesh = &PLACEHOLDER.mesh;
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (12, 20));
        let form = MeshDesc::default().form();
        let (low, high) = form.bounds().unwrap();
        assert!((low - DVec3::new(-0.5, 0.0, -0.5)).length() < 1e-6, "{low}");
        assert!((high - DVec3::new(0.5, 1.0, 0.5)).length() < 1e-6, "{high}");
        // The faces of an icosahedron meet at 41.8 degrees.
        for (normals, crease_angle, expected) in [
            (Normals::Auto, None, MeshNormals::Creased(40.0)),
            (Normals::Auto, Some(50.0), MeshNormals::Creased(50.0)),
            (Normals::Smooth, Some(50.0), MeshNormals::Creased(180.0)),
            (Normals::Flat, None, MeshNormals::Flat),
        ] {
            let Form::Mesh(form) =
                (MeshDesc { normals, crease_angle, ..Default::default() }).form()
            else {
                panic!("not a mesh");
            };
            assert_eq!(form.normals, expected);
        }
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
