//! Shared helpers of tests of lobes: materials, vectors, sampled reflections, traced samples.

use zerkalo_kernel::lanes::{Float, SimdFloat, Vec3};
use zerkalo_kernel::sampling::{CameraDimensions, SampleSettings, Sampler, SamplerKind};
use zerkalo_scene::Scene;
use zerkalo_scene::material::{
    Bsdf, BsdfQuery, InterfaceMedia, InterfaceQuery, Lobe, Masking, Material, ReflectionLobe,
};
use zerkalo_world::{Path, Radiance, World};

pub type Vector = [f64; 3];

pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the sum of vectors, each multiplied by a factor.
#[inline]
pub fn combine(terms: &[(f64, Vector)]) -> Vector {
    let mut sum = [0.0; 3];
    for (k, v) in terms {
        sum = [sum[0] + k * v[0], sum[1] + k * v[1], sum[2] + k * v[2]];
    }
    sum
}

pub fn unit(v: Vector) -> Vector {
    combine(&[(1.0 / dot(v, v).sqrt(), v)])
}

/// Returns two unit vectors orthogonal to `n` and to each other.
pub fn across(n: Vector) -> [Vector; 2] {
    let axis = if n[0].abs() < 0.5 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let t = unit(combine(&[(1.0, axis), (-dot(axis, n), n)]));
    let b = [n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]];
    [t, b]
}

/// Returns a normal that is not parallel to an axis.
pub fn tilted_normal() -> Vector {
    unit([0.3, -0.5, 0.8])
}

/// Returns the direction at the angle `theta` from `n`, with the azimuth `phi`, both in radians.
pub fn at_angle(n: Vector, theta: f64, phi: f64) -> Vector {
    let [t, b] = across(n);
    unit(combine(&[(theta.cos(), n), (theta.sin() * phi.cos(), t), (theta.sin() * phi.sin(), b)]))
}

pub fn vector(v: Vec3<f64>) -> Vector {
    [v.x, v.y, v.z]
}

/// Returns a white material that reflects all light in the lobe `lobe`, with a highlight of the
/// same microfacets.
pub fn reflector(lobe: Lobe, masking: Masking, roughness: f64) -> Material {
    Material {
        ambient: 0.0,
        diffuse: 0.0,
        specular: 1.0,
        highlight: zerkalo_scene::material::Highlight::CookTorrance,
        reflection: 1.0,
        roughness,
        lobe,
        masking,
        ..Material::default()
    }
}

/// Returns `true` if the lobe is a microfacet distribution. Only these have masking.
pub fn has_facets(lobe: Lobe) -> bool {
    let finish = Bsdf::<f64>::new(&reflector(lobe, Masking::Smith, 1.0), true);
    matches!(finish.lobe, ReflectionLobe::MicrofacetDistribution(_))
}

/// Returns every lobe with every masking that affects it.
pub fn every_lobe() -> Vec<(Lobe, Masking)> {
    let maskings = |lobe| if has_facets(lobe) { &Masking::ALL[..] } else { &Masking::ALL[..1] };
    Lobe::ALL.into_iter().flat_map(|l| maskings(l).iter().map(move |m| (l, *m))).collect()
}

/// Returns the query for a ray with the direction `incident` at a surface with the normal `n`.
pub fn query<L: SimdFloat>((incident, n): (Vector, Vector), fold: bool) -> BsdfQuery<L> {
    BsdfQuery { incident: Vec3::of(incident), normal: Vec3::of(n), fold }
}

/// Source of the random numbers for sampled reflections: kind, seed and pixel.
#[derive(Clone, Copy)]
pub struct Numbers {
    pub kind: SamplerKind,
    pub seed: u64,
    pub pixel: (u32, u32),
}

impl Numbers {
    pub fn random(seed: u64) -> Self {
        Self { kind: SamplerKind::Random, seed, pixel: (3, 5) }
    }

    pub fn sobol(seed: u64) -> Self {
        Self { kind: SamplerKind::Sobol, ..Self::random(seed) }
    }
}

/// Samples `count` reflections as the program does, in the SIMD type `L`. Passes each direction and
/// weight to `take`. `incident` points towards the surface. If `fold` is `true`, directions below
/// the surface are mirrored up; otherwise they are absorbed.
pub fn each_reflection<L: SimdFloat>(
    material: &Material,
    (incident, n): (Vector, Vector),
    fold: bool,
    numbers: Numbers,
    count: u32,
    mut take: impl FnMut(Vector, Vector),
) {
    reflect::<L>(material, (incident, n), fold, numbers, count, &mut take);
}

/// Implements [`each_reflection`], compiled once for each SIMD type.
fn reflect<L: SimdFloat>(
    material: &Material,
    (incident, n): (Vector, Vector),
    fold: bool,
    numbers: Numbers,
    count: u32,
    take: &mut dyn FnMut(Vector, Vector),
) {
    let finish = Bsdf::<L::Scalar>::new(material, true);
    let query = query::<L>((incident, n), fold);
    let settings = SampleSettings { seed: numbers.seed, kind: numbers.kind };
    let sampler = Sampler::<L>::new(settings, CameraDimensions { pixel: false, lens: false });
    for first in (0..count).step_by(L::WIDTH) {
        let key = sampler.key(numbers.pixel, 0);
        let uv = sampler.block(first, L::WIDTH).for_pixel(key).lobe_2d(0);
        let r = finish.sample(&query, uv);
        for lane in 0..L::WIDTH {
            take(r.direction.lane(lane).map(Float::to_f64), r.weight.lane(lane).map(Float::to_f64));
        }
    }
}

/// Returns a white dielectric with the lobe `lobe`. Its coefficients of reflection and transmission
/// are 1.
pub fn rough_glass(lobe: Lobe, masking: Masking, alpha: f64, ior: f64) -> Material {
    Material {
        alpha: Some(alpha),
        transmission: 1.0,
        ior,
        fresnel: Some(zerkalo_scene::material::Fresnel::Dielectric),
        ..reflector(lobe, masking, alpha * 8f64.sqrt())
    }
}

/// Smooth or rough interface: the indices of refraction on the side of the incident ray and on the
/// side of the transmitted ray, and `true` for a thin pane.
#[derive(Clone, Copy, Debug)]
pub struct Sides {
    pub n_i: f64,
    pub n_t: f64,
    pub thin: bool,
}

impl Sides {
    /// Returns the query for a ray with the direction `incident` at a surface with the normal `n`.
    pub fn query<L: SimdFloat>(self, at: (Vector, Vector), fold: bool) -> InterfaceQuery<L> {
        InterfaceQuery {
            rays: query(at, fold),
            media: InterfaceMedia {
                n_i: L::from_f64(self.n_i),
                n_t: L::from_f64(self.n_t),
                outer: L::mask(self.n_i <= self.n_t),
                thin: L::mask(self.thin),
            },
            reflecting: L::mask(true),
        }
    }
}

/// Directions and weights of the reflected and the transmitted ray of one sample at a rough
/// interface.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    pub reflected: (Vector, Vector),
    pub transmitted: (Vector, f64),
}

/// Samples `count` pairs of reflected and transmitted rays as the program does, in the SIMD type
/// `L`. Passes each pair to `take`. If `fold` is `true`, directions on the wrong side of the
/// surface are mirrored; otherwise they are absorbed.
pub fn each_crossing<L: SimdFloat>(
    material: &Material,
    (incident, n): (Vector, Vector),
    (sides, fold): (Sides, bool),
    numbers: Numbers,
    count: u32,
    mut take: impl FnMut(Crossing),
) {
    cross::<L>(material, (incident, n), (sides, fold), numbers, count, &mut take);
}

/// Implements [`each_crossing`], compiled once for each SIMD type.
fn cross<L: SimdFloat>(
    material: &Material,
    (incident, n): (Vector, Vector),
    (sides, fold): (Sides, bool),
    numbers: Numbers,
    count: u32,
    take: &mut dyn FnMut(Crossing),
) {
    let finish = Bsdf::<L::Scalar>::new(material, true);
    let query = sides.query::<L>((incident, n), fold);
    let settings = SampleSettings { seed: numbers.seed, kind: numbers.kind };
    let sampler = Sampler::<L>::new(settings, CameraDimensions { pixel: false, lens: false });
    for first in (0..count).step_by(L::WIDTH) {
        let key = sampler.key(numbers.pixel, 0);
        let uv = sampler.block(first, L::WIDTH).for_pixel(key).lobe_2d(0);
        let s = finish.sample_interface(&query, uv);
        for lane in 0..L::WIDTH {
            let of = |v: Vec3<L>| v.lane(lane).map(Float::to_f64);
            take(Crossing {
                reflected: (of(s.reflected), of(s.reflected_weight)),
                transmitted: (of(s.transmitted), s.transmitted_weight.lane(lane).to_f64()),
            });
        }
    }
}

/// Returns the radiance of as many samples of a pixel as the SIMD type has lanes, from index
/// `first` on. The values of lanes outside of `active` have no meaning. The order of values is
/// `[sample][group][channel]`.
pub fn trace<L: SimdFloat>(
    world: &World<L>,
    sampler: &Sampler<L>,
    pixel: (u32, u32),
    first: u32,
    active: L::Mask,
) -> Vec<Vec<Vector>> {
    let points = sampler.block(first, L::WIDTH);
    let draws = points.for_pixel(sampler.key(pixel, 0));
    let half = L::from_f64(0.5);
    let jitter = if world.jitter() { draws.pixel() } else { (half, half) };
    let corner = Vec3::splat(world.camera().pixel_corner_direction(pixel));
    let mut path = Path::new(world.camera().rays(corner, jitter));
    let mut radiance = Radiance::black();
    world.trace(&mut path, None, &draws, active, &mut radiance);
    let groups = &radiance.groups[..world.groups()];
    let of_lane = |lane| groups.iter().map(|g| g.lane(lane).map(Float::to_f64)).collect();
    (0..L::WIDTH).map(of_lane).collect()
}

pub fn scene(text: &str) -> Scene {
    Scene::parse(text, "test").unwrap()
}

const SETTINGS: SampleSettings = SampleSettings { seed: 3, kind: SamplerKind::Sobol };

/// Returns the samples `0..count` of every pixel, traced in full packets. Each is the sum over the
/// light groups, with the weight 1 for all lights.
pub fn samples<L: SimdFloat>(scene: &Scene, count: u32) -> Vec<Vector> {
    samples_by::<L>(scene, count, |world, sampler, pixel, first| {
        trace(world, sampler, pixel, first, L::mask(true))
    })
}

/// Returns the same values as [`samples`]. Each sample is traced alone: it is the only active lane
/// of its packet.
pub fn lone_samples<L: SimdFloat>(scene: &Scene, count: u32) -> Vec<Vector> {
    let only = |lane: usize| {
        L::from_fn(|i| L::Scalar::from_f64(f64::from(u8::from(i == lane)))).gt(L::zero())
    };
    samples_by::<L>(scene, count, |world, sampler, pixel, first| {
        let alone = |lane| trace(world, sampler, pixel, first, only(lane)).swap_remove(lane);
        (0..L::WIDTH).map(alone).collect()
    })
}

/// Returns the samples `0..count` of every pixel. `packet` returns the radiance of the samples of a
/// pixel from an index on, as [`trace`] does.
fn samples_by<L: SimdFloat>(
    scene: &Scene,
    count: u32,
    packet: impl Fn(&World<L>, &Sampler<L>, (u32, u32), u32) -> Vec<Vec<Vector>>,
) -> Vec<Vector> {
    let world = World::<L>::new(scene);
    let sampler = Sampler::<L>::new(SETTINGS, world.camera_dimensions());
    let [width, height] = scene.film.size;
    let mut out = Vec::new();
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        for first in (0..count).step_by(L::WIDTH) {
            for groups in packet(&world, &sampler, (x, y), first) {
                let all: Vec<_> = groups.into_iter().map(|g| (1.0, g)).collect();
                out.push(combine(&all));
            }
        }
    }
    out
}
