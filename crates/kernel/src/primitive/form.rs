//! Canonical forms: the few kinds of geometry to which every shape with its transform is reduced.

use crate::bvh::Ray;
use crate::lanes::{SimdFloat, Vec3};
use crate::primitive::Aggregate;
use crate::primitive::canonical::CanonicalShape;
use crate::primitive::conical_frustum::ConicalFrustumForm;
use crate::primitive::convex_polyhedron::ConvexPolyhedronForm;
use crate::primitive::csg::CsgSolid;
use crate::primitive::ellipsoid::EllipsoidForm;
use crate::primitive::mesh::instance::MeshForm;
use crate::primitive::parallelogram::ParallelogramForm;
use crate::primitive::plane::PlaneForm;
use crate::primitive::sphere::SphereForm;
use crate::primitive::torus::TorusForm;
use glam::{DAffine3, DVec3};

/// Declares an enum of canonical forms that dereferences to `dyn CanonicalShape`.
macro_rules! form_enum {
    ($(#[$meta:meta])* pub enum $name:ident { $($(#[$doc:meta])* $kind:ident($form:ident),)+ }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq)]
        pub enum $name {
            $($(#[$doc])* $kind($form),)+
        }

        $(
            impl From<$form> for $name {
                fn from(form: $form) -> Self {
                    Self::$kind(form)
                }
            }
        )+

        impl std::ops::Deref for $name {
            type Target = dyn CanonicalShape;

            fn deref(&self) -> &Self::Target {
                match self {
                    $(Self::$kind(form) => form,)+
                }
            }
        }

        impl $name {
            /// Returns the image of the geometry under the invertible affine map `map`.
            pub fn transformed(self, map: &DAffine3) -> Self {
                match self {
                    $(Self::$kind(form) => form.transformed(map).into(),)+
                }
            }
        }
    };
}
pub(in crate::primitive) use form_enum;

macro_rules! forms {
    ($($(#[$doc:meta])+ $kind:ident($form:ident, $noun:literal, $nouns:literal, convex: $convex:literal),)+) => {
        form_enum! {
            /// Canonical form: the geometry of one object in double precision and scene
            /// coordinates. Each variant is a kind of primitive.
            pub enum Form {
                $($(#[$doc])+ $kind($form),)+
            }
        }

        impl Form {
            /// Returns the noun for primitives of this kind, singular and plural.
            pub fn noun(&self) -> (&'static str, &'static str) {
                match self {
                    $(Self::$kind(_) => ($noun, $nouns),)+
                }
            }

            /// Returns `true` if no ray that leaves the surface outwards hits the object again.
            pub fn is_convex(&self) -> bool {
                match self {
                    $(Self::$kind(_) => $convex,)+
                }
            }
        }
    };
}

// Kinds of primitives, each with its noun in the inventory of a scene, singular and plural. A new
// kind needs a line here.
forms! {
    /// Sphere, given by centre and radius.
    Sphere(SphereForm, "sphere", "spheres", convex: true),
    /// Image of the unit sphere under an affine map.
    Ellipsoid(EllipsoidForm, "ellipsoid", "ellipsoids", convex: true),
    /// Convex polyhedron: a bounded intersection of half-spaces.
    ConvexPolyhedron(ConvexPolyhedronForm, "convex solid", "convex solids", convex: true),
    /// Image of a circular cylinder, cone or frustum under an affine map.
    ConicalFrustum(ConicalFrustumForm, "tapered cylinder", "tapered cylinders", convex: true),
    /// Compound of solids: union, intersection or difference.
    Csg(CsgSolid, "compound", "compounds", convex: false),
    /// Image of a triangle mesh under an affine map.
    Mesh(MeshForm, "mesh", "meshes", convex: false),
    /// Flat parallelogram, such as a rectangle.
    Parallelogram(ParallelogramForm, "rectangle", "rectangles", convex: true),
    /// Infinite plane, given by normal and offset.
    Plane(PlaneForm, "plane", "planes", convex: true),
    /// Image of a torus under an affine map.
    Torus(TorusForm, "torus", "tori", convex: false),
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

    /// Returns the smallest t > 0 at which `origin + t direction` is on the surface; `None` if
    /// there is none. The unit of t is the length of `direction`.
    pub fn cast(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let length = direction.length();
        Some(self.hit(origin, direction / length)?.0 / length)
    }

    /// Returns the distance of the closest hit of a ray with the unit direction `direction`, and
    /// the unit normal there; `None` for a miss.
    pub fn hit(&self, origin: DVec3, direction: DVec3) -> Option<(f64, DVec3)> {
        let vector = |v: DVec3| Vec3::<f64>::of(v.to_array());
        let ray = Ray { origin: vector(origin), direction: vector(direction) };
        let alone = Aggregate::with_bvh(std::slice::from_ref(self), false);
        let hit = alone.closest(&ray, alone.all());
        if hit.t >= f64::MAX {
            return None;
        }
        let normal = alone.surface(hit.primitive.id_lane(0), hit.triangle, ray.at(hit.t)).normal;
        Some((hit.t, DVec3::new(normal.x, normal.y, normal.z)))
    }
}
