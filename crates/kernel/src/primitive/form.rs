//! Canonical forms: the few kinds of geometry to which every shape with its transform is reduced,
//! before it is compiled for a SIMD type.

use crate::bvh::Ray;
use crate::lanes::Vec3;
use crate::primitive::Aggregate;
use crate::primitive::canonical::CanonicalShape;
use crate::primitive::conical_frustum::ConicalFrustumForm;
use crate::primitive::convex_polyhedron::ConvexPolyhedronForm;
use crate::primitive::csg_tree::CsgSolid;
use crate::primitive::ellipsoid::EllipsoidForm;
use crate::primitive::mesh::instance::MeshForm;
use crate::primitive::parallelogram::ParallelogramForm;
use crate::primitive::plane::PlaneForm;
use crate::primitive::sphere::SphereForm;
use crate::primitive::torus::TorusForm;
use glam::{DAffine3, DVec3};
use std::ops::Deref;

macro_rules! forms {
    ($($(#[$doc:meta])+ $kind:ident($form:ident, $noun:literal, $nouns:literal)),+ $(,)?) => {
        /// Canonical form: the geometry of one object in double precision and scene coordinates.
        /// Each variant is a kind of primitive.
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

        impl Deref for Form {
            type Target = dyn CanonicalShape;

            /// Returns the geometry that the variant holds. Properties that every kind of geometry
            /// has, such as the bounds, can therefore be read from the form itself.
            fn deref(&self) -> &Self::Target {
                match self {
                    $(Self::$kind(form) => form,)+
                }
            }
        }

        impl Form {
            /// Returns the noun for primitives of this kind in the scene's inventory: singular and
            /// plural.
            pub(crate) fn noun(&self) -> (&'static str, &'static str) {
                match self {
                    $(Self::$kind(_) => ($noun, $nouns),)+
                }
            }

            /// Returns the image of the geometry under the invertible affine map `map`. A
            /// similarity maps a sphere to a sphere, any other map to an ellipsoid. The image of
            /// any other form has the same variant.
            pub fn transformed(self, map: &DAffine3) -> Self {
                match self {
                    $(Self::$kind(form) => form.transformed(map),)+
                }
            }
        }
    };
}

// List of the canonical forms. A new kind of primitive needs a line here: its variant, its type,
// and the noun for such primitives in the inventory of a scene, singular and plural.
forms! {
    /// Sphere, given by centre and radius.
    Sphere(SphereForm, "sphere", "spheres"),
    /// Image of the unit sphere under an affine map.
    Ellipsoid(EllipsoidForm, "ellipsoid", "ellipsoids"),
    /// Convex polyhedron: a bounded intersection of half-spaces.
    ConvexPolyhedron(ConvexPolyhedronForm, "convex solid", "convex solids"),
    /// Image of a circular cylinder, cone or frustum under an affine map.
    ConicalFrustum(ConicalFrustumForm, "tapered cylinder", "tapered cylinders"),
    /// Compound of solids: union, intersection or difference.
    Csg(CsgSolid, "compound", "compounds"),
    /// Image of a triangle mesh under an affine map.
    Mesh(MeshForm, "mesh", "meshes"),
    /// Flat parallelogram, such as a rectangle.
    Parallelogram(ParallelogramForm, "rectangle", "rectangles"),
    /// Infinite plane, given by normal and offset.
    Plane(PlaneForm, "plane", "planes"),
    /// Image of a torus under an affine map.
    Torus(TorusForm, "torus", "tori"),
}

impl Form {
    /// Returns `true` if the geometry lies in a plane.
    pub fn is_flat(&self) -> bool {
        self.plane().is_some()
    }

    /// Returns `true` if the geometry does not lie in a plane.
    pub fn is_solid(&self) -> bool {
        !self.is_flat()
    }

    /// Returns the largest magnitude of a coordinate of the bounding box. For an infinite plane it
    /// is the distance of the plane from the origin.
    pub fn max_coordinate(&self) -> f64 {
        match self.bounds() {
            Some((low, high)) => low.abs().max(high.abs()).max_element(),
            None => self.plane().map_or(0.0, |plane| plane.offset.abs()),
        }
    }
}

/// Implements [`CanonicalShape::cast`] for `form`: compiles it in double precision and intersects
/// the ray with it.
pub fn cast_compiled(form: Form, origin: DVec3, direction: DVec3) -> Option<f64> {
    let length = direction.length();
    let vector = |v: DVec3| Vec3::<f64>::of(v.to_array());
    let ray = Ray { origin: vector(origin), direction: vector(direction / length) };
    let alone = Aggregate::with_tree(&[form], false);
    let t = alone.closest(&ray, alone.all()).t;
    (t < f64::MAX).then_some(t / length)
}
