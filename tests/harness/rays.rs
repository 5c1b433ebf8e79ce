//! Rays in double precision, traced in packets of any lane type.

use super::*;
use zerkalo_kernel::sampling::{SampleSettings, Sampler, SamplerKind};
use zerkalo_world::{AnyWorld, MAX_GROUPS, Options, Path, Precision, Radiance, World};

/// Single ray in double precision: origin and unit direction.
pub type Line = (DVec3, DVec3);

/// Nearest surface that a ray hits.
#[derive(Clone, Copy, Debug)]
pub struct LineHit {
    pub t: f64,
    /// Index of the hit form in the list from which the aggregate was built.
    pub form: usize,
    pub point: DVec3,
    pub normal: DVec3,
}

/// Returns the rays `lines` in packets, each with the number of its rays. The last packet repeats
/// its last ray to fill all lanes.
pub fn packets<L: SimdFloat>(lines: &[Line]) -> impl Iterator<Item = (Ray<L>, usize)> + '_ {
    lines.chunks(L::WIDTH).map(|lines| {
        let line_of_lane = |i: usize| lines[i.min(lines.len() - 1)];
        let to_scalars = |v: DVec3| v.to_array().map(L::Scalar::from_f64);
        let origin = Vec3::from_fn(|i| to_scalars(line_of_lane(i).0));
        let direction = Vec3::from_fn(|i| to_scalars(line_of_lane(i).1));
        (Ray { origin, direction }, lines.len())
    })
}

pub fn to_dvec3<L: SimdFloat>(v: Vec3<L>, lane: usize) -> DVec3 {
    DVec3::from(v.lane(lane).map(Float::to_f64))
}

/// Returns the point and the normal of the surface that the ray of each lane hits. Lanes that hit
/// the same primitive are computed together.
pub fn surface<L: SimdFloat>(
    geometry: &Aggregate<L>,
    ray: &Ray<L>,
    hit: &Hit<L>,
) -> SurfacePoint<L> {
    let mut all =
        SurfacePoint { point: ray.at(hit.t), normal: Vec3::zero(), max_coordinate: L::zero() };
    let mut pending = hit.t.lt(L::from_f64(L::MAX));
    while pending.any() {
        let primitive = hit.primitive.id_lane(pending.bits().trailing_zeros() as usize);
        let primitive_mask = pending & hit.primitive.id_eq(primitive);
        let one = geometry.surface(primitive, hit.triangle, ray.at(hit.t));
        all.point = Vec3::select(primitive_mask, one.point, all.point);
        all.normal = Vec3::select(primitive_mask, one.normal, all.normal);
        all.max_coordinate = L::select(primitive_mask, one.max_coordinate, all.max_coordinate);
        pending = pending.and_not(primitive_mask);
    }
    all
}

/// Returns the nearest hit of each ray; `None` for a miss.
pub fn closest<L: SimdFloat>(geometry: &Aggregate<L>, lines: &[Line]) -> Vec<Option<LineHit>> {
    let mut out = Vec::with_capacity(lines.len());
    for (ray, count) in packets::<L>(lines) {
        let hit = geometry.closest(&ray, geometry.all());
        let hit_mask = hit.t.lt(L::from_f64(L::MAX));
        let surface = surface(geometry, &ray, &hit);
        out.extend((0..count).map(|i| {
            hit_mask.lane(i).then(|| LineHit {
                t: hit.t.lane(i).to_f64(),
                form: geometry.sources[hit.primitive.id_lane(i) as usize].form,
                point: to_dvec3(surface.point, i),
                normal: to_dvec3(surface.normal, i),
            })
        }));
    }
    out
}

/// Returns one value for each ray: `true` if it hits a surface before the distance `limit`.
pub fn occluded<L: SimdFloat>(geometry: &Aggregate<L>, lines: &[Line], limit: f64) -> Vec<bool> {
    let mut out = Vec::with_capacity(lines.len());
    for (ray, count) in packets::<L>(lines) {
        let occluded = geometry.occluded(&ray, L::from_f64(limit), L::mask(true), geometry.all());
        out.extend((0..count).map(|i| occluded.lane(i)));
    }
    out
}

/// Returns one form of every registered kind of shape, taken from the kind's documented example.
pub fn every_kind() -> Vec<(&'static str, Form)> {
    let form = |text: &str| parsed(&format!("[[object]]\n{text}")).objects[0].shape.form();
    EXAMPLES.iter().map(|(key, example)| (*key, form(example))).collect()
}

/// Returns centre and radius of the sphere around the bounding box of `form`. Returns `None` for an
/// unbounded form.
pub fn bounding_sphere(form: &Form) -> Option<(DVec3, f64)> {
    form.bounds().map(|(low, high)| (0.5 * (low + high), 0.5 * (high - low).length()))
}

/// Compiled scene whose radiance can be evaluated along single rays.
pub struct Traced {
    world: AnyWorld,
    /// Weight (red, green, blue) of each light group.
    weights: Vec<[f64; 3]>,
    /// Centre of the scene, which compilation subtracts from all coordinates.
    origin: DVec3,
}

impl Traced {
    pub fn new(scene: &Scene, precision: Precision) -> Self {
        let world = AnyWorld::compile(scene, &Options { precision, ..Options::default() });
        let eye = match &world {
            AnyWorld::Single(w) => w.camera.eye,
            AnyWorld::Double(w) => w.camera.eye,
        };
        let weights = world.info().groups.weights(scene);
        Self { world, weights, origin: DVec3::from(scene.camera.eye) - eye }
    }

    /// Returns the radiance along `lines`, which are in scene coordinates.
    pub fn radiance(&self, lines: &[Line]) -> Vec<[f64; 3]> {
        let lines: Vec<Line> = lines.iter().map(|(o, d)| (*o - self.origin, *d)).collect();
        self.centered(&lines)
    }

    /// Returns the radiance along `lines`, which are relative to the scene's centre.
    pub fn centered(&self, lines: &[Line]) -> Vec<[f64; 3]> {
        match &self.world {
            AnyWorld::Single(w) => self.radiance_in(w, lines),
            AnyWorld::Double(w) => self.radiance_in(w, lines),
        }
    }

    /// Returns the centre of the scene in scene coordinates.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    fn radiance_in<L: SimdFloat>(&self, world: &World<L>, lines: &[Line]) -> Vec<[f64; 3]> {
        let settings = SampleSettings { seed: 1, kind: SamplerKind::Sobol };
        let sampler = Sampler::new(settings, world.camera_dimensions());
        let mut out = Vec::with_capacity(lines.len());
        let points = sampler.block(0, L::WIDTH);
        let mut radiance = Radiance::black();
        for (ray, count) in packets::<L>(lines) {
            let draws = points.for_pixel(sampler.key((0, 0), 0));
            world.trace(&mut Path::new(ray), None, &draws, L::mask(true), &mut radiance, None);
            for i in 0..count {
                let mut sum = DVec3::ZERO;
                for (group, weight) in radiance.groups.iter().zip(&self.weights) {
                    sum += to_dvec3(*group, i) * DVec3::from(*weight);
                }
                out.push(sum.to_array());
            }
        }
        out
    }
}

/// Returns a random ray around `form`, of one of six kinds:
///
/// - from outside towards a random point in and around the form
/// - from such a point in any direction
/// - along an axis towards such a point
/// - along an axis from a corner of the form's bounding box, or from the centre of an edge, of a
///   face or of the box
/// - along an axis towards such a corner or centre
/// - from one such corner or centre towards another
///
/// The zeros in directions along an axis have either sign. Half of these directions are inclined to
/// the axis in a coordinate plane.
pub fn any_line(numbers: &mut Numbers, form: &Form) -> Line {
    let (center, radius) = bounding_sphere(form).unwrap_or((DVec3::ZERO, 2.0));
    let axis = |numbers: &mut Numbers| {
        let zero = if numbers.bits() & 1 == 0 { 0.0 } else { -0.0 };
        let mut d = DVec3::splat(zero);
        let main_axis = numbers.below(3);
        d[main_axis] = if numbers.bits() & 1 == 0 { 1.0 } else { -1.0 };
        if numbers.below(2) == 0 {
            d[(main_axis + 1) % 3] = numbers.between(-1.0, 1.0);
        }
        d.normalize()
    };
    let target = center + numbers.in_cube(1.1 * radius);
    let (low, high) = form.bounds().unwrap_or((DVec3::splat(-1.0), DVec3::ONE));
    let corner = |numbers: &mut Numbers| {
        let pick = |n: &mut Numbers, l: f64, h: f64| [l, h, 0.5 * (l + h)][n.below(3)];
        DVec3::new(
            pick(numbers, low.x, high.x),
            pick(numbers, low.y, high.y),
            pick(numbers, low.z, high.z),
        )
    };
    match numbers.below(6) {
        0 => {
            let origin = center + numbers.direction() * (3.0 * radius);
            (origin, (target - origin).normalize())
        }
        1 => (target, numbers.direction()),
        2 => {
            let d = axis(numbers);
            (target - d * (2.0 * radius), d)
        }
        3 => (corner(numbers), axis(numbers)),
        4 => {
            let d = axis(numbers);
            (corner(numbers) - d * (2.0 * radius), d)
        }
        _ => {
            let (start, end) = (corner(numbers), corner(numbers));
            let d = (end - start).try_normalize().unwrap_or(DVec3::Y);
            (start - d * if numbers.bits() & 1 == 0 { 0.0 } else { radius }, d)
        }
    }
}

/// Returns the forms of every kind of shape in three versions each: unchanged, rotated, and scaled
/// non-uniformly (spheres become ellipsoids).
pub fn forms() -> Vec<(String, Form)> {
    let mut out = Vec::new();
    let rotation = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -1.1, 2.0);
    let place = DVec3::new(0.3, -2.0, 1.0);
    for (name, form) in every_kind() {
        let maps = [
            ("", DAffine3::IDENTITY),
            (" rotated", DAffine3::from_rotation_translation(rotation, place)),
            (
                " uneven",
                DAffine3::from_scale_rotation_translation(
                    DVec3::new(1.0, -0.2, 3.0),
                    rotation,
                    place,
                ),
            ),
        ];
        for (suffix, map) in maps {
            out.push((format!("{name}{suffix}"), form.clone().transformed(&map)));
        }
    }
    out
}
