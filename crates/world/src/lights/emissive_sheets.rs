//! Flat emissive objects (emissive sheets) that lie on opaque surfaces, such as a panel on the
//! ceiling of a room.
//!
//! Rounding would decide which of two coincident surfaces a ray hits, and points sampled on the
//! emissive sheet could be behind the opaque surface. Compilation therefore moves the sheet off the
//! surface by a few rounding errors. The picture is the limit of a vanishing gap, both for rays
//! that hit the sheet and for points sampled on it.
//!
//! The sheet moves to the side on which it is visible. A one-sided sheet moves to its front. A
//! two-sided sheet on a solid moves outside, or inside if the eye is inside the solid. A
//! two-sided sheet on an open surface, which has no inside, moves to the side of the eye.

use crate::compile::RecenteredGeometry;
use crate::integrator::coincident_surfaces::touching_pairs;
use crate::lights::emissive_forms::{triangles_of_mesh, triangles_of_polyhedron};
use crate::lights::emitters::CONTACT_LIFTS;
use crate::lights::on_surfaces::WRITTEN;
use glam::{DAffine3, DVec3};
use std::collections::HashMap;
use zerkalo_kernel::primitive::{BoundingSphere, Form, HalfSpace};

/// Distance between an emissive sheet and the surface off which it is moved. The unit is the height
/// of sampled points above the sheet. The surface then covers no points (see [`CONTACT_LIFTS`]).
const GAP_LIFTS: f64 = CONTACT_LIFTS + 2.0;

/// Number of test points for contact along each side of a triangle.
const POINTS_PER_SIDE: u32 = 12;

/// Largest number of triangles of a form for which several points of each triangle are tested. For
/// more triangles, one point of each is tested.
const MAX_DETAILED: usize = 12;

/// Largest number of triangles of a mesh that are tested.
const MAX_POINTS: usize = 1024;

/// Smallest cosine of the angle between normals that count as parallel.
const MIN_COSINE: f64 = 0.999_999;

/// Sides on which an object emits light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Emits {
    Nothing,
    Front,
    BothSides,
}

/// Moves emissive sheets off the opaque surfaces on which they lie. `emits` and `transmits`
/// describe each object. `lift` is the height of sampled points above emissive surfaces. Returns
/// `None` if no sheet is moved.
pub(crate) fn move_off_surfaces(
    geometry: &RecenteredGeometry,
    (emits, transmits): (&[Emits], &[bool]),
    eye: DVec3,
    lift: f64,
) -> Option<RecenteredGeometry> {
    let forms = &geometry.forms[..];
    let sheet = |object: usize| {
        let shines = emits[object] != Emits::Nothing && !transmits[object];
        shines.then(|| Sheet::new(&forms[object], lift))?
    };
    let sheets: Vec<Option<Sheet>> = (0..forms.len()).map(sheet).collect();
    if sheets.iter().all(Option::is_none) {
        return None;
    }
    let written = WRITTEN * geometry.extent;
    let reach = (CONTACT_LIFTS * lift).max(written);
    let may_lie_on = |object: usize, carrier: usize| {
        let sheet = sheets[object].as_ref().filter(|_| emits[carrier] == Emits::Nothing);
        sheet.is_some_and(|sheet| may_carry(&forms[carrier], sheet, reach))
    };
    let wanted = |a: usize, b: usize| may_lie_on(a, b) || may_lie_on(b, a);
    let mut contacts: HashMap<usize, Vec<Contact>> = HashMap::new();
    let mut fixed = vec![false; forms.len()];
    for (a, b) in touching_pairs(forms, wanted, reach) {
        let (object, carrier) = if sheets[a].is_some() { (a, b) } else { (b, a) };
        let Some(sheet) = &sheets[object] else { continue };
        let Some(contact) = sheet.contact(&forms[carrier], eye, reach) else { continue };
        // A sheet in the plane of a transparent surface is not moved: paths cross both in a fixed
        // order (see `coincident_surfaces`).
        fixed[object] |= transmits[carrier];
        contacts.entry(object).or_default().push(contact);
    }
    let mut moved: Option<Vec<Form>> = None;
    for (object, contacts) in contacts {
        let Some(sheet) = sheets[object].as_ref().filter(|_| !fixed[object]) else { continue };
        let plane = sheet.plane;
        let side = if emits[object] == Emits::Front && sheet.has_front {
            1.0
        } else if contacts.iter().all(|contact| contact.side == contacts[0].side) {
            contacts[0].side
        } else if plane.height(eye) >= 0.0 {
            // The sheet is between two surfaces, one on each side. It moves to the side of the eye.
            1.0
        } else {
            -1.0
        };
        let shift = |contact: &Contact| {
            let is_exact = contact.height.abs() <= CONTACT_LIFTS * lift;
            let gap = if is_exact { GAP_LIFTS * lift } else { 2.0 * written };
            gap - side * contact.height
        };
        let shift = contacts.iter().map(shift).fold(0.0, f64::max);
        let by = DAffine3::from_translation(plane.normal * (side * shift));
        moved.get_or_insert_with(|| forms.to_vec())[object] =
            forms[object].clone().transformed(&by);
    }
    let RecenteredGeometry { origin, extent, ref objects, .. } = *geometry;
    moved.map(|forms| RecenteredGeometry { origin, forms, extent, objects: objects.clone() })
}

/// Flat emissive object.
struct Sheet<'a> {
    form: &'a Form,
    /// Plane that contains the sheet, with its normal on the front.
    plane: HalfSpace,
    /// `true` if all parts of the sheet have their fronts on the same side.
    has_front: bool,
    ball: BoundingSphere,
}

impl<'a> Sheet<'a> {
    /// Creates the sheet of an object; `None` if `form` is not flat. Corners of a mesh may be up to
    /// `lift` away from a common plane.
    fn new(form: &'a Form, lift: f64) -> Option<Self> {
        let ball = form.bounding_sphere();
        if let Some(plane) = form.plane() {
            return Some(Self { form, plane, has_front: true, ball });
        }
        let Form::Mesh(mesh) = form else { return None };
        let triangles = || triangles_of_mesh(mesh, 1);
        let normal_of = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
        let larger = |a: DVec3, b: DVec3| if a.length() >= b.length() { a } else { b };
        let normal = triangles().map(normal_of).reduce(larger)?.normalize();
        let plane = HalfSpace { normal, offset: normal.dot(triangles().next()?[0]) };
        let is_on = |corner: DVec3| plane.height(corner).abs() <= lift;
        let has_front = triangles().all(|triangle| normal_of(triangle).dot(normal) >= 0.0);
        let is_flat = triangles().flatten().all(is_on);
        is_flat.then_some(Self { form, plane, has_front, ball })
    }

    /// Returns the contact of the sheet with the object `carrier`; `None` if no tested point of the
    /// sheet is within `reach` of the object.
    fn contact(&self, carrier: &Form, eye: DVec3, reach: f64) -> Option<Contact> {
        let normal = self.plane.normal;
        for point in points_on(self.form).into_iter().chain(points_on(carrier)) {
            let from_plane = self.plane.height(point);
            if from_plane.abs() > reach {
                continue;
            }
            // The probe runs through the point along the normal of the sheet.
            let point = point - normal * from_plane;
            let start = point + normal * (2.0 * reach);
            let probe = |form: &Form| {
                let (t, outward) = form.hit(start, -normal)?;
                let height = t - 2.0 * reach;
                let is_on = height.abs() <= reach && outward.dot(normal).abs() >= MIN_COSINE;
                is_on.then_some((height, outward))
            };
            let Some((height, outward)) = probe(self.form).and_then(|_| probe(carrier)) else {
                continue;
            };
            // The first surface of the object on the way from the eye to the point shows whether
            // the eye is inside the object.
            let sight = (point - eye).normalize_or(-normal);
            let is_inside = carrier.hit(eye, sight).is_some_and(|(_, n)| n.dot(sight) > 0.0);
            let shows = if is_inside { -outward } else { outward };
            return Some(Contact { side: normal.dot(shows).signum(), height });
        }
        None
    }
}

/// Contact of an emissive sheet with a surface on which it lies.
struct Contact {
    /// Side on which the sheet is visible: 1 for the front, -1 for the back.
    side: f64,
    /// Height of the sheet above the surface along the sheet's normal; negative below.
    height: f64,
}

/// Returns `true` if the form `carrier` may have a flat face in the plane of `sheet`. The two
/// planes may be up to `reach` apart.
fn may_carry(carrier: &Form, sheet: &Sheet, reach: f64) -> bool {
    let is_parallel = |normal: DVec3| normal.dot(sheet.plane.normal).abs() >= MIN_COSINE;
    // Angles with a cosine above `MIN_COSINE` displace the sheet's edge by 0.2 % of its radius at
    // most.
    let room = reach + 2e-3 * sheet.ball.radius;
    let is_face =
        |face: &HalfSpace| is_parallel(face.normal) && face.height(sheet.ball.center).abs() <= room;
    match carrier {
        Form::Sphere(_) | Form::Ellipsoid(_) | Form::Torus(_) => false,
        Form::ConvexPolyhedron(form) => form.faces.iter().any(is_face),
        Form::Parallelogram(_) | Form::Plane(_) => carrier.plane().as_ref().is_some_and(is_face),
        Form::ConicalFrustum(_) | Form::Csg(_) | Form::Mesh(_) => true,
    }
}

/// Returns points inside the faces of a form; none for forms that are not made of triangles.
fn points_on(form: &Form) -> Vec<DVec3> {
    let triangles = match form {
        Form::Parallelogram(form) => form.halves().to_vec(),
        Form::ConvexPolyhedron(form) => triangles_of_polyhedron(form),
        Form::Mesh(mesh) => {
            triangles_of_mesh(mesh, form.triangles().div_ceil(MAX_POINTS).max(1)).collect()
        }
        Form::Sphere(_)
        | Form::Ellipsoid(_)
        | Form::ConicalFrustum(_)
        | Form::Csg(_)
        | Form::Plane(_)
        | Form::Torus(_) => Vec::new(),
    };
    let per_side = if triangles.len() <= MAX_DETAILED { POINTS_PER_SIDE } else { 1 };
    let points_on_triangle = |&[a, b, c]: &[DVec3; 3]| {
        let weight = move |i: u32| (f64::from(i) + 1.0 / 3.0) / f64::from(per_side);
        let pairs = (0..per_side).flat_map(move |i| (0..per_side - i).map(move |j| (i, j)));
        pairs.map(move |(i, j)| a + (b - a) * weight(i) + (c - a) * weight(j))
    };
    triangles.iter().flat_map(points_on_triangle).collect()
}
