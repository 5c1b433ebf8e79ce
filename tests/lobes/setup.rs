//! Shared helpers of tests of lobes: materials, vectors, sampled reflections, traced samples.

use crate::harness::*;
use zerkalo_kernel::sampling::CameraDimensions;
use zerkalo_scene::material::InterfaceMedia;

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
    matches!(finish.lobe, ReflectionLobe::Microfacet(_))
}

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
pub struct Draws {
    pub kind: SamplerKind,
    pub seed: u64,
    pub pixel: (u32, u32),
}

impl Draws {
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
    numbers: Draws,
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
    numbers: Draws,
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
    numbers: Draws,
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
    numbers: Draws,
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
