//! Mirror images of emitters, towards which diffuse bounces are sampled.
//!
//! Rays of diffuse bounces find emitters in mirrors by chance alone, because no point of an emitter
//! is sampled through a mirror. Some bounces therefore go to the images that flat mirrors show.
//! Directions have a mixture of two densities, that of the cosine and that of the images, and are
//! weighted by the whole mixture. An image that is hidden, or blurred by the lobe of its mirror,
//! changes the noise alone, because these rays are traced like all others.

use crate::integrator::direct_lighting::cosine_pdf;
use glam::DVec3;
use zerkalo_kernel::lanes::{Float, Frame, Mask, SimdFloat, Vec3};
use zerkalo_kernel::primitive::{BoundingSphere, Form};
use zerkalo_kernel::sampling::warp::{cone, cone_pdf, cosine_hemisphere};
use zerkalo_scene::material::{Lobe, Material};
use zerkalo_scene::value::{sort_by_number, total_order};

/// Largest number of images of a scene. The brightest ones stay.
const MAX_IMAGES: usize = 8;

/// Smallest brightness of an image, as a fraction of that of the brightest one.
const MIN_BRIGHTNESS: f64 = 0.1;

/// Fraction of the bounces that go to images, at points that may see one.
const SHARE: f64 = 0.3;

/// Radius of an infinite mirror.
const EVERYWHERE: f64 = 1e15;

/// Flat face of a mirror.
pub(crate) struct MirrorFace {
    /// Unit normal on the side that reflects.
    pub normal: DVec3,
    pub ball: BoundingSphere,
    /// Reflection coefficient.
    strength: f64,
    /// Tangent of the angle by which the lobe spreads reflected rays.
    spread: f64,
}

impl MirrorFace {
    /// Returns the flat faces of `form`, whose material is `material`, that show images.
    pub fn all_of(form: &Form, material: &Material) -> Vec<Self> {
        if material.reflection == 0.0 || material.transmission > 0.0 {
            return Vec::new();
        }
        let spread = match material.lobe {
            Lobe::Mirror => 0.0,
            Lobe::Cone | Lobe::Square => material.roughness,
            Lobe::Beckmann | Lobe::Ggx => 2.0 * material.microfacet_alpha(),
        };
        let face = |normal, corners: &[DVec3]| {
            let center = corners.iter().sum::<DVec3>() / corners.len() as f64;
            let radius = corners.iter().map(|p| p.distance(center)).fold(0.0, f64::max);
            let ball = BoundingSphere { center, radius };
            Self { normal, ball, strength: material.reflection, spread }
        };
        let (faces, open) = match form {
            Form::Parallelogram(form) => {
                let (corner, u, v) = (form.corner, form.u, form.v);
                let corners = [corner, corner + u, corner + v, corner + u + v];
                (vec![face(u.cross(v).normalize_or_zero(), &corners)], true)
            }
            Form::Plane(plane) => {
                let mut face = face(plane.normal, &[plane.normal * plane.offset]);
                face.ball.radius = EVERYWHERE;
                (vec![face], true)
            }
            Form::ConvexPolyhedron(form) => {
                let size = form.corners.iter().fold(0.0, |size: f64, p| size.max(p.length()));
                let faces = form.faces.iter().map(|half_space| {
                    let on_face = |p: &&DVec3| half_space.height(**p).abs() <= 1e-6 * size;
                    let corners: Vec<DVec3> =
                        form.corners.iter().filter(on_face).copied().collect();
                    face(half_space.normal, &corners)
                });
                (faces.collect(), false)
            }
            Form::Sphere(_)
            | Form::Ellipsoid(_)
            | Form::ConicalFrustum(_)
            | Form::Csg(_)
            | Form::Mesh(_)
            | Form::Torus(_) => (Vec::new(), false),
        };
        let backs = faces.iter().filter(|_| open && material.two_sided);
        let backs: Vec<Self> = backs.map(|face| Self { normal: -face.normal, ..*face }).collect();
        faces.into_iter().chain(backs).collect()
    }
}

impl MirrorFace {
    /// Returns `true` if the face reflects each ray into one direction.
    pub fn is_clear(&self) -> bool {
        self.spread == 0.0
    }
}

/// Image of an emitter that a flat mirror shows.
struct MirrorImage<S> {
    /// Unit normal of the mirror.
    normal: [S; 3],
    /// Centre and radius of a sphere around the mirror.
    mirror: ([S; 3], S),
    /// Centre and radius of a sphere around the image and the blur of the mirror's lobe.
    image: ([S; 3], S),
    /// Height of the emitter above the plane of the mirror.
    height: S,
    /// Normal of the image of a flat emitter with one side; zero for others.
    front: [S; 3],
    /// Radiance, averaged over the blur.
    brightness: f64,
}

/// Direction of an image from a point that may see it.
#[derive(Clone, Copy)]
struct Seen<L> {
    /// Weight in the choice among images; 0 if the point cannot see the image.
    weight: L,
    axis: Vec3<L>,
    one_minus_cos: L,
}

impl<S: Float> MirrorImage<S> {
    /// Returns the image of an emitter in the bounding sphere `ball`, whose only side has the normal
    /// `front`. Returns `None` if the emitter is behind the mirror.
    fn new(face: &MirrorFace, ball: &BoundingSphere, front: Option<DVec3>) -> Option<Self> {
        let MirrorFace { normal, ball: mirror, strength, spread } = face;
        let height = (ball.center - mirror.center).dot(*normal);
        if !(height > 0.0 && ball.radius > 0.0) {
            return None;
        }
        let radius = ball.radius + spread * height;
        let vector = |v: DVec3| v.to_array().map(S::from_f64);
        let front = front.map_or(DVec3::ZERO, |n| n - 2.0 * n.dot(*normal) * *normal);
        Some(Self {
            normal: vector(*normal),
            mirror: (vector(mirror.center), S::from_f64(mirror.radius)),
            image: (vector(ball.center - 2.0 * height * *normal), S::from_f64(radius)),
            height: S::from_f64(height),
            front: vector(front),
            brightness: strength * (ball.radius / radius).powi(2),
        })
    }

    /// Returns the image as seen from `point` on a surface with the normal `normal`.
    #[inline(always)]
    fn seen<L: SimdFloat<Scalar = S>>(&self, point: Vec3<L>, normal: Vec3<L>) -> Seen<L> {
        let (zero, one) = (L::zero(), L::one());
        let (center, radius) = (Vec3::splat(self.mirror.0), L::splat(self.mirror.1));
        let to_image = Vec3::splat(self.image.0) - point;
        let image_radius = L::splat(self.image.1);
        let distance2 = to_image.length_squared();
        let inverse = one / distance2.sqrt();
        let height = (point - center).dot(Vec3::splat(self.normal));
        // The line to the centre of the image meets the plane of the mirror in this fraction of it.
        let fraction = height / (height + L::splat(self.height));
        let reach = image_radius.mul_add(fraction, radius);
        let from_center = to_image.mul_add(fraction, point) - center;
        let rise = to_image.dot(normal) + image_radius;
        let visible = height.gt(zero)
            & from_center.length_squared().le(reach * reach)
            & rise.gt(zero)
            & distance2.gt(image_radius * image_radius * L::from_f64(1.5))
            & to_image.dot(Vec3::splat(self.front)).le(zero);
        let sin2 = image_radius * image_radius / distance2;
        let one_minus_cos = sin2 / ((one - sin2).max(zero).sqrt() + one);
        let weight = rise * inverse * one_minus_cos * L::from_f64(self.brightness);
        Seen { weight: weight.masked(visible), axis: to_image * inverse, one_minus_cos }
    }
}

/// Images of emitters in the flat mirrors of a scene.
pub(crate) struct MirrorImages<S> {
    images: Vec<MirrorImage<S>>,
}

impl<S: Float> MirrorImages<S> {
    /// Compiles the images of `emitters` in `faces`. Each emitter has a bounding sphere, and the
    /// normal of its only side if it is flat. Returns `None` if there are no images.
    pub fn new(faces: &[MirrorFace], emitters: &[(BoundingSphere, Option<DVec3>)]) -> Option<Self> {
        let images = faces.iter().flat_map(|face| {
            emitters.iter().filter_map(|(ball, front)| MirrorImage::new(face, ball, *front))
        });
        let mut images: Vec<MirrorImage<S>> = images.collect();
        sort_by_number(&mut images, |image| total_order(-image.brightness));
        let least = images.first().map_or(0.0, |image| MIN_BRIGHTNESS * image.brightness);
        images.retain(|image| image.brightness >= least);
        images.truncate(MAX_IMAGES);
        (!images.is_empty()).then_some(Self { images })
    }

    /// Samples directions of diffuse bounces from `point` on a surface with the normal `normal`.
    /// Returns them, and the density of the cosine divided by that with which they were sampled.
    #[inline(never)]
    pub fn sample_bounce<L: SimdFloat<Scalar = S>>(
        &self,
        point: Vec3<L>,
        normal: Vec3<L>,
        u: L,
        v: L,
    ) -> (Vec3<L>, L) {
        let (zero, one) = (L::zero(), L::one());
        let nothing = Seen { weight: zero, axis: normal, one_minus_cos: zero };
        let mut seen = [nothing; MAX_IMAGES];
        let mut sum = zero;
        for (seen, image) in seen.iter_mut().zip(&self.images) {
            *seen = image.seen(point, normal);
            sum += seen.weight;
        }
        let seen = &seen[..self.images.len()];
        let any = sum.gt(zero);
        let share = L::from_f64(SHARE).masked(any);
        let to_image = u.lt(share);
        let rest = L::select(any, (u - share) / (one - share), u);
        let mut direction = Frame::around(normal).to_world(cosine_hemisphere(rest.max(zero), v));
        if to_image.any() {
            let position = u / L::select(any, share, one) * sum;
            let (mut before, mut chosen, mut number) = (zero, nothing, zero);
            for seen in seen {
                // The last image that begins before the position.
                let begins = seen.weight.gt(zero) & before.le(position);
                let inside = (position - before) / L::select(begins, seen.weight, one);
                number = L::select(begins, inside, number);
                chosen.axis = Vec3::select(begins, seen.axis, chosen.axis);
                chosen.one_minus_cos = L::select(begins, seen.one_minus_cos, chosen.one_minus_cos);
                before += seen.weight;
            }
            let local = cone(number.min(one), v, chosen.one_minus_cos);
            let towards = Frame::around(chosen.axis).to_world(local).renormalize();
            direction = Vec3::select(to_image, towards, direction);
        }
        let cosine = cosine_pdf(direction.dot(normal).max(zero));
        let of_images = seen.iter().fold(zero, |density, seen| {
            (cone_pdf(seen.axis, direction, seen.one_minus_cos) * seen.weight)
                .masked(seen.weight.gt(zero))
                + density
        });
        let mixture = (one - share) * cosine + share * of_images / L::select(any, sum, one);
        (direction, L::select(any & mixture.gt(zero), cosine / mixture, one))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that weighted directions are those of the cosine: on a floor before a mirror that shows a
    /// lamp, their mean is 2/3 of the normal, and that of their weights is 1. Of the directions,
    /// more than a quarter goes to the image.
    #[test]
    fn weighted_bounces_to_images_have_the_density_of_the_cosine() {
        let material = Material { reflection: 0.9, ..Material::default() };
        let wall = Form::Plane(zerkalo_kernel::primitive::PlaneForm::through(
            DVec3::new(0.0, 0.0, -1.0),
            DVec3::Z,
        ));
        let faces = MirrorFace::all_of(&wall, &material);
        let lamp = BoundingSphere { center: DVec3::new(0.0, 2.0, 0.0), radius: 0.3 };
        let images = MirrorImages::<f64>::new(&faces, &[(lamp, None)]).unwrap_or_else(|| panic!());
        assert_eq!(images.images.len(), 1, "the lamp is behind the back of the mirror");
        let normal = Vec3::of([0.0, 1.0, 0.0]);
        let image = DVec3::new(0.0, 2.0, -2.0);
        let (mut mean, mut found, mut weights) = (DVec3::ZERO, 0, 0.0);
        let n = 200;
        for i in 0..n * n {
            let [u, v] = [i / n, i % n].map(|k| (f64::from(k) + 0.5) / f64::from(n));
            let (direction, ratio) = images.sample_bounce(Vec3::zero(), normal, u, v);
            let direction = DVec3::new(direction.x, direction.y, direction.z);
            mean += direction * ratio;
            weights += ratio;
            found += i32::from(direction.angle_between(image) < 0.3 / image.length());
        }
        let count = f64::from(n * n);
        assert!((weights / count - 1.0).abs() < 2e-3, "{}", weights / count);
        assert!((mean / count).distance(DVec3::Y * 2.0 / 3.0) < 2e-3, "{}", mean / count);
        assert!(f64::from(found) > 0.25 * count, "{found}");
    }
}
