//! Forms of emissive objects as surfaces from which light is sampled.

use glam::DVec3;
use zerkalo_kernel::primitive::{
    CanonicalShape, ConvexPolyhedronForm, Form, MeshForm, ParallelogramForm,
};
use zerkalo_scene::light::EmissiveSurface;
use zerkalo_scene::value::{sort_by_number, total_order};

/// Largest number of triangles of a mesh from which light is sampled. A triangle takes 56 bytes in
/// single precision.
const MAX_TRIANGLES: usize = 1 << 16;

/// Returns the surface from which light of the object `form` is sampled; `None` if its points
/// cannot be sampled.
pub(crate) fn surface_of(form: &Form) -> Option<EmissiveSurface> {
    match form {
        Form::Sphere(sphere) => {
            Some(EmissiveSurface::Sphere { center: sphere.center, radius: sphere.radius })
        }
        Form::Parallelogram(form) => Some(surface_of_parallelogram(form)),
        Form::ConvexPolyhedron(form) => {
            Some(EmissiveSurface::ConvexTriangles(triangles_of_polyhedron(form)))
        }
        Form::Mesh(mesh) => (form.triangles() <= MAX_TRIANGLES)
            .then(|| EmissiveSurface::Triangles(triangles_of_mesh(mesh, 1).collect())),
        Form::Ellipsoid(_)
        | Form::ConicalFrustum(_)
        | Form::Csg(_)
        | Form::Plane(_)
        | Form::Torus(_) => None,
    }
}

fn surface_of_parallelogram(form: &ParallelogramForm) -> EmissiveSurface {
    let ParallelogramForm { corner, u, v } = *form;
    let size = [u.length(), v.length()];
    let far = corner + u + v;
    if u.dot(v).abs() > 1e-12 * size[0] * size[1] {
        return EmissiveSurface::Triangles(form.halves().to_vec());
    }
    let (right, up) = (u / size[0], v / size[1]);
    EmissiveSurface::Rectangle {
        center: 0.5 * (corner + far),
        axes: [right, up, right.cross(up)],
        size,
    }
}

/// Returns the faces of a polyhedron as triangles, counter-clockwise as seen from outside.
pub(crate) fn triangles_of_polyhedron(form: &ConvexPolyhedronForm) -> Vec<[DVec3; 3]> {
    let slack = 1e-6 * form.thickness();
    let mut triangles = Vec::new();
    for face in &form.faces {
        let is_on_face = |corner: &&DVec3| face.height(**corner).abs() <= slack;
        let mut corners: Vec<DVec3> = form.corners.iter().filter(is_on_face).copied().collect();
        if corners.len() < 3 {
            continue;
        }
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let (right, up) = face.normal.any_orthonormal_pair();
        let side = right.cross(up).dot(face.normal).signum();
        let angle = |corner: &DVec3| {
            let from_middle = *corner - middle;
            (side * from_middle.dot(up)).atan2(from_middle.dot(right))
        };
        sort_by_number(&mut corners, |corner| total_order(angle(corner)));
        triangles.extend(corners[1..].windows(2).map(|pair| [corners[0], pair[0], pair[1]]));
    }
    triangles
}

/// Returns triangles of the mesh in scene coordinates, counter-clockwise as seen from their front:
/// all if `step` is 1, otherwise each `step`-th.
pub(crate) fn triangles_of_mesh(
    form: &MeshForm,
    step: usize,
) -> impl Iterator<Item = [DVec3; 3]> + '_ {
    let mesh = &form.mesh.mesh;
    let mirrored = form.scene_from_mesh.matrix3.determinant() < 0.0;
    let corner = |i: u32| {
        let position = mesh.positions[i as usize].map(f64::from);
        form.scene_from_mesh.transform_point3(DVec3::from(position))
    };
    let in_order = move |&[a, b, c]: &[u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
    mesh.triangles.iter().step_by(step).map(move |triangle| in_order(triangle).map(corner))
}
