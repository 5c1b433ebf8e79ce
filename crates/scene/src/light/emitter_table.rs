//! Table of emitters, from which each lane of a packet samples another one.

use crate::light::emitter::{PointSample, Surface, sample_disk, sample_rectangle, sample_sphere};
use crate::light::{Emitter, LightSample};
use zerkalo_kernel::lanes::{Float, MAX_WIDTH, SimdFloat, Vec3};

/// Method by which the points of an emitter are sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Method {
    Sphere,
    Rectangle,
    Disk,
    /// [`Emitter::sample`], for one emitter after the other.
    Single,
}

/// Number of fields of a record; spheres have fewer.
const FIELDS: usize = 16;
const SPHERE_FIELDS: usize = 6;

/// Sphere, rectangle or disk: the centre, the radiance (negative if both sides emit light), the
/// lift, two sizes (radius of a sphere or disk, area of a disk, width and height of a rectangle), and
/// the axes.
type Record<S> = [S; FIELDS];

/// Emitters, of which each lane of a packet may sample another one.
#[derive(Clone, Debug, Default)]
pub struct EmitterTable<S> {
    records: Vec<Record<S>>,
    method_of: Vec<Method>,
    /// Methods of the records, each once.
    methods: Vec<Method>,
}

impl<S: Float> EmitterTable<S> {
    /// Creates a table of `emitters`.
    pub fn new<'a>(emitters: impl Iterator<Item = &'a Emitter<S>>) -> Self {
        let zero = S::default();
        let record = |emitter: &Emitter<S>| {
            let no_axes = [[zero; 3]; 3];
            let (method, center, axes, size) = match emitter.surface {
                Surface::Sphere { center, radius } => {
                    (Method::Sphere, center, no_axes, [radius, zero])
                }
                Surface::Rectangle { center, axes, size } => {
                    (Method::Rectangle, center, axes, size)
                }
                Surface::Disk { center, axes, radius } => {
                    (Method::Disk, center, axes, [radius, S::from_f64(emitter.area)])
                }
                Surface::Faces { .. } | Surface::Mesh(_) | Surface::DistantDisk { .. } => {
                    (Method::Single, [zero; 3], no_axes, [zero; 2])
                }
            };
            let [x, y, z] = center;
            let sign = if emitter.sides.both { -1.0 } else { 1.0 };
            let radiance = S::from_f64(sign * emitter.radiance.to_f64());
            let [[a, b, c], [d, e, f], [g, h, i]] = axes;
            let [width, height] = size;
            let lift = emitter.sides.lift;
            ([x, y, z, radiance, lift, width, height, a, b, c, d, e, f, g, h, i], method)
        };
        let (records, method_of): (Vec<_>, Vec<_>) = emitters.map(record).unzip();
        let mut methods: Vec<Method> = Vec::new();
        for method in &method_of {
            if !methods.contains(method) {
                methods.push(*method);
            }
        }
        Self { records, method_of, methods }
    }

    /// Samples a point of the emitter with the number `chosen[i]` in each lane `i`, as
    /// [`Emitter::sample`] does. `emitter` returns the emitter with a number.
    #[inline(always)]
    pub fn sample<'a, L: SimdFloat<Scalar = S>>(
        &self,
        chosen: &[u32; MAX_WIDTH],
        origin: Vec3<L>,
        numbers: (L, L),
        emitter: impl Fn(u32) -> Option<&'a Emitter<S>>,
    ) -> LightSample<L> {
        let mut out: Option<LightSample<L>> = None;
        for method in &self.methods {
            let sample = match method {
                Method::Single => sample_singly(chosen, origin, numbers, &emitter),
                Method::Sphere | Method::Rectangle | Method::Disk => {
                    self.sample_quadrics(*method, chosen, origin, numbers)
                }
            };
            out = Some(match out {
                None => sample,
                Some(others) => {
                    let flag = |lane: usize| {
                        let is_method = self.method_of[chosen[lane] as usize] == *method;
                        S::from_f64(f64::from(is_method))
                    };
                    select(L::from_fn(flag).gt(L::zero()), &sample, &others)
                }
            });
        }
        out.unwrap_or_else(|| PointSample::nothing().with_radiance(L::zero()))
    }

    /// Result of [`Self::sample`] in the lanes whose emitter is sampled by `method`.
    #[inline(always)]
    fn sample_quadrics<L: SimdFloat<Scalar = S>>(
        &self,
        method: Method,
        chosen: &[u32; MAX_WIDTH],
        origin: Vec3<L>,
        numbers: (L, L),
    ) -> LightSample<L> {
        if method == Method::Sphere {
            let [x, y, z, radiance, lift, radius] = self.gather::<L, SPHERE_FIELDS>(chosen);
            let sides = (lift, radiance.lt(L::zero()));
            let to_center = Vec3::new(x, y, z) - origin;
            return sample_sphere(to_center, radius, sides, numbers).with_radiance(radiance.abs());
        }
        let [x, y, z, radiance, lift, width, height, a, b, c, d, e, f, g, h, i] =
            self.gather::<L, FIELDS>(chosen);
        let to_center = Vec3::new(x, y, z) - origin;
        let axes = [Vec3::new(a, b, c), Vec3::new(d, e, f), Vec3::new(g, h, i)];
        let sides = (lift, radiance.lt(L::zero()));
        let point = match method {
            Method::Disk => sample_disk(to_center, |i| axes[i], width, height, numbers),
            Method::Rectangle | Method::Sphere | Method::Single => {
                sample_rectangle(to_center, |i| axes[i], [width, height], sides, numbers)
            }
        };
        point.with_radiance(radiance.abs())
    }

    /// Returns the first `N` fields of the records of the `chosen` emitters.
    #[inline(always)]
    fn gather<L: SimdFloat<Scalar = S>, const N: usize>(
        &self,
        chosen: &[u32; MAX_WIDTH],
    ) -> [L; N] {
        let mut fields = [[S::default(); MAX_WIDTH]; N];
        for lane in 0..L::WIDTH {
            let record = &self.records[chosen[lane] as usize];
            for (field, value) in fields.iter_mut().zip(record) {
                field[lane] = *value;
            }
        }
        fields.map(
            #[inline(always)]
            |field| {
                L::from_fn(
                    #[inline(always)]
                    |lane| field[lane],
                )
            },
        )
    }
}

/// Result of [`EmitterTable::sample`] for emitters of any kind.
#[inline(never)]
fn sample_singly<'a, L: SimdFloat>(
    chosen: &[u32; MAX_WIDTH],
    origin: Vec3<L>,
    numbers: (L, L),
    emitter: &impl Fn(u32) -> Option<&'a Emitter<L::Scalar>>,
) -> LightSample<L>
where
    L::Scalar: 'a,
{
    let mut out = PointSample::nothing().with_radiance(L::zero());
    for lane in 0..L::WIDTH {
        let number = chosen[lane];
        if !chosen[..lane].contains(&number)
            && let Some(emitter) = emitter(number)
        {
            let sample = emitter.sample(origin, numbers);
            out = select(lanes_with::<L>(chosen, number), &sample, &out);
        }
    }
    out
}

/// Returns the lanes in which `chosen` is `number`.
#[inline(always)]
pub fn lanes_with<L: SimdFloat>(chosen: &[u32; MAX_WIDTH], number: u32) -> L::Mask {
    L::from_fn(|lane| L::Scalar::from_f64(f64::from(chosen[lane] == number))).gt(L::zero())
}

#[inline(always)]
fn select<L: SimdFloat>(
    mask: L::Mask,
    yes: &LightSample<L>,
    no: &LightSample<L>,
) -> LightSample<L> {
    LightSample {
        wi: Vec3::select(mask, yes.wi, no.wi),
        distance: L::select(mask, yes.distance, no.distance),
        irradiance: Vec3::select(mask, yes.irradiance, no.irradiance),
        density: L::select(mask, yes.density, no.density),
    }
}
