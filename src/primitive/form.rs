//! Canonical forms: the kinds of geometry that are compiled for a lane type. Every shape with its
//! transform is reduced to one of them first.

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
        /// Geometry of one object in double precision and scene coordinates. Each variant is a kind
        /// of primitive.
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

        /// Evaluates one expression for the form of any variant.
        macro_rules! dispatch {
            ($any:expr, $one:ident => $value:expr) => {
                match $any {
                    $(Form::$kind($one) => $value,)+
                }
            };
        }

        impl Form {
            /// Noun for such primitives in the scene's inventory, singular and plural.
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
    /// Compound of solids: union, intersection or difference.
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
    /// Returns the image under the invertible affine map `map`. A similarity maps a sphere to a
    /// sphere, any other map to an ellipsoid. All other forms keep their kind.
    pub fn transformed(self, map: &DAffine3) -> Self {
        dispatch!(self, form => form.transformed(map))
    }

    /// Number of parts that can have a material of their own; 1 except for compounds.
    pub fn parts(&self) -> usize {
        dispatch!(self, form => form.parts())
    }

    /// Axis-parallel bounding box; `None` if the form has no finite bounds. It is the smallest one,
    /// except for compounds.
    pub fn bounds(&self) -> Option<Bounds> {
        dispatch!(self, form => form.bounds())
    }

    /// Bounding sphere; its radius is infinite if the form has no finite bounds.
    pub fn bounding_sphere(&self) -> BoundingSphere {
        dispatch!(self, form => form.bounding_sphere())
    }

    /// Bounding box in the form's own space, with the map from this space to the scene; `None` if
    /// the form has no space of its own.
    pub(crate) fn oriented_box(&self) -> Option<(DAffine3, Bounds)> {
        dispatch!(self, form => form.oriented_box())
    }

    /// Plane that contains the form; `None` if the form is not flat.
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

    /// Returns `true` if no ray that leaves the form's outside hits the form again.
    pub fn is_convex(&self) -> bool {
        dispatch!(self, form => form.is_convex())
    }

    /// Smallest thickness of a solid, or shorter edge of a flat form.
    pub fn thickness(&self) -> f64 {
        dispatch!(self, form => form.thickness())
    }

    /// Lower bound of the distance between `point` and the surface; see
    /// [`CanonicalShape::clearance`].
    pub fn clearance(&self, point: DVec3) -> Option<f64> {
        dispatch!(self, form => form.clearance(point))
    }

    /// Unit normals of the surfaces within the distance `slack` of `point`, one list for each solid
    /// that the form consists of. Empty if there are none.
    pub fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>> {
        dispatch!(self, form => form.normals_at(point, slack))
    }

    /// Smallest t > 0 at which `origin + t direction` is on the surface; `None` if there is none.
    /// The unit of t is the length of `direction`.
    pub fn cast(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        dispatch!(self, form => form.cast(origin, direction))
    }

    /// Default mapping of textures to the form, used if a material does not choose one.
    pub fn default_mapping(&self) -> DefaultMapping {
        dispatch!(self, form => form.default_mapping())
    }

    /// Proxies in the search for narrow gaps.
    pub fn proxies(&self) -> Vec<Proxy> {
        dispatch!(self, form => form.proxies())
    }

    /// Smallest and largest value of `axis . p` over the points p of the form, or bounds of both;
    /// `None` if the form is unbounded along the axis.
    pub fn extent_along(&self, axis: DVec3) -> Option<(f64, f64)> {
        dispatch!(self, form => form.extent_along(axis))
    }

    /// Corners on which the form can stand when it is snapped to the ground.
    pub fn corners(&self) -> Vec<DVec3> {
        dispatch!(self, form => form.corners())
    }

    /// Number of triangles; 0 except for meshes.
    pub(crate) fn triangles(&self) -> usize {
        dispatch!(self, form => form.triangles())
    }

    /// Largest magnitude of the coordinates from which the surface is computed. For a plane it is
    /// the distance from the origin.
    pub fn max_coordinate(&self) -> f64 {
        match self.bounds() {
            Some((low, high)) => low.abs().max(high.abs()).max_element(),
            None => self.plane().map_or(0.0, |plane| plane.offset.abs()),
        }
    }
}

/// Implements [`CanonicalShape::cast`] with the compiled primitive in double precision.
pub fn cast_compiled(form: Form, origin: DVec3, direction: DVec3) -> Option<f64> {
    let length = direction.length();
    let vector = |v: DVec3| Vec3::<f64>::of(v.to_array());
    let ray = Ray { origin: vector(origin), direction: vector(direction / length) };
    let alone = Aggregate::with_tree(&[form], false);
    let t = alone.closest(&ray, alone.all()).t;
    (t < f64::MAX).then_some(t / length)
}
