//! Canonical forms. Every shape and transform is reduced to one of them before it is compiled for a
//! lane type.

use crate::bvh::Ray;
use crate::lanes::Vec3;
use crate::primitive::Aggregate;
use crate::primitive::bounding::BoundingSphere;
use crate::primitive::canonical::{Bounds, CanonicalShape, DefaultMapping, HalfSpace, Proxy};
use crate::primitive::conical_frustum::ConicalFrustumForm;
use crate::primitive::convex_polyhedron::ConvexPolyhedronForm;
use crate::primitive::csg_tree::CsgSolid;
use crate::primitive::ellipsoid::EllipsoidForm;
use crate::primitive::mesh_instance::MeshForm;
use crate::primitive::parallelogram::ParallelogramForm;
use crate::primitive::plane::PlaneForm;
use crate::primitive::sphere::SphereForm;
use crate::primitive::torus::TorusForm;
use glam::{DAffine3, DVec3};

macro_rules! forms {
    ($($(#[$doc:meta])+ $kind:ident($form:ident)),+ $(,)?) => {
        /// Geometry in double precision, in the space of the scene.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Form {
            $($(#[$doc])+ $kind($form),)+
        }

        $(
            impl From<$form> for Form {
                fn from(form: $form) -> Self {
                    Self::$kind(form)
                }
            }
        )+

        /// Evaluates one expression for the form of any kind.
        macro_rules! dispatch {
            ($any:expr, $one:ident => $value:expr) => {
                match $any {
                    $(Form::$kind($one) => $value,)+
                }
            };
        }

        impl Form {
            /// Singular and plural by which the inventory counts primitives of this form.
            pub(crate) fn noun(&self) -> (&'static str, &'static str) {
                match self {
                    $(Self::$kind(_) => $form::NOUN,)+
                }
            }
        }
    };
}

// The list of canonical forms: a new primitive is a line here.
forms! {
    /// Sphere.
    Sphere(SphereForm),
    /// Image of the unit sphere.
    Ellipsoid(EllipsoidForm),
    /// Bounded intersection of half-spaces.
    ConvexPolyhedron(ConvexPolyhedronForm),
    /// Image of a circular cylinder, cone or frustum.
    ConicalFrustum(ConicalFrustumForm),
    /// Solids joined, intersected, cut out of each other.
    Csg(CsgSolid),
    /// Image of a triangle mesh.
    Mesh(MeshForm),
    /// Flat parallelogram.
    Parallelogram(ParallelogramForm),
    /// Infinite plane.
    Plane(PlaneForm),
    /// Image of a torus.
    Torus(TorusForm),
}

impl Form {
    /// Image under the invertible affine map `map`. Similarities keep a sphere a sphere; any other
    /// map makes it an ellipsoid. The other forms keep their kind.
    pub fn transformed(self, map: &DAffine3) -> Self {
        dispatch!(self, form => form.transformed(map))
    }

    /// Number of parts that can have a material of their own: 1 but for compounds.
    pub fn parts(&self) -> usize {
        dispatch!(self, form => form.parts())
    }

    /// Axis-parallel box around the form, the smallest but for compounds; `None` if it has no end.
    pub fn bounds(&self) -> Option<Bounds> {
        dispatch!(self, form => form.bounds())
    }

    /// Sphere around the form; its radius is infinite if the form has no end.
    pub fn bounding_sphere(&self) -> BoundingSphere {
        dispatch!(self, form => form.bounding_sphere())
    }

    /// The map from the space in which the form was described, and its box there, if it has such a
    /// space.
    pub(crate) fn oriented_box(&self) -> Option<(DAffine3, Bounds)> {
        dispatch!(self, form => form.oriented_box())
    }

    /// Plane that a flat form lies in; `None` if the form is not flat.
    pub fn plane(&self) -> Option<HalfSpace> {
        dispatch!(self, form => form.plane())
    }

    /// Returns `true` if the form lies in a plane.
    pub fn is_flat(&self) -> bool {
        self.plane().is_some()
    }

    /// Returns `true` if the form fills space.
    pub fn is_solid(&self) -> bool {
        !self.is_flat()
    }

    /// Returns `true` if the outside of the form cannot see itself.
    pub fn is_convex(&self) -> bool {
        dispatch!(self, form => form.is_convex())
    }

    /// Smallest thickness of a solid, or the smaller edge of a flat form.
    pub fn thickness(&self) -> f64 {
        dispatch!(self, form => form.thickness())
    }

    /// Lower bound of the distance of `point` from the surface ([`CanonicalShape::clearance`]).
    pub fn clearance(&self, point: DVec3) -> Option<f64> {
        dispatch!(self, form => form.clearance(point))
    }

    /// Unit normals of the surfaces that pass `point` within `slack`, a list for each solid that
    /// the form is made of; empty if none does.
    pub fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>> {
        dispatch!(self, form => form.normals_at(point, slack))
    }

    /// Smallest t > 0 at which `origin + t direction` lies on the surface; `None` if there is none.
    /// The unit of t is the length of `direction`.
    pub fn cast(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        dispatch!(self, form => form.cast(origin, direction))
    }

    /// Mapping of textures that leave it open.
    pub fn default_mapping(&self) -> DefaultMapping {
        dispatch!(self, form => form.default_mapping())
    }

    /// Proxies for the search for narrow gaps.
    pub fn proxies(&self) -> Vec<Proxy> {
        dispatch!(self, form => form.proxies())
    }

    /// Least and largest value of `axis . p` over the form, or bounds of them; `None` if it has no
    /// end in that direction.
    pub fn extent_along(&self, axis: DVec3) -> Option<(f64, f64)> {
        dispatch!(self, form => form.extent_along(axis))
    }

    /// Corners on which the form can stand.
    pub fn corners(&self) -> Vec<DVec3> {
        dispatch!(self, form => form.corners())
    }

    /// Number of triangles.
    pub(crate) fn triangles(&self) -> usize {
        dispatch!(self, form => form.triangles())
    }

    /// Largest magnitude of a coordinate that the surface is computed from: of a plane its distance
    /// from the origin.
    pub fn max_coordinate(&self) -> f64 {
        match self.bounds() {
            Some((low, high)) => low.abs().max(high.abs()).max_element(),
            None => self.plane().map_or(0.0, |plane| plane.offset.abs()),
        }
    }
}

/// [`CanonicalShape::cast`] by the compiled primitive in double precision.
pub fn cast_compiled(form: Form, origin: DVec3, direction: DVec3) -> Option<f64> {
    let length = direction.length();
    let vector = |v: DVec3| Vec3::<f64>::of(v.to_array());
    let ray = Ray { origin: vector(origin), direction: vector(direction / length) };
    let alone = Aggregate::with_tree(&[form], false);
    let t = alone.closest(&ray, alone.all()).t;
    (t < f64::MAX).then_some(t / length)
}
