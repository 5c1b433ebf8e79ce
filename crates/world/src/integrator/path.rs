//! State of a packet of paths, and the result of tracing it.

use crate::lights::groups::MAX_GROUPS;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3};
use zerkalo_scene::light::Emitter;

/// Largest number of reflections at the turned material of which samples of a narrower lobe are
/// reused.
pub const MAX_ORDER: usize = 3;

/// Radiance of a packet's samples in each light group. A light with a group of its own counts as a
/// white light of intensity 1.
pub struct Radiance<L: SimdFloat> {
    /// Radiance of each light group. Elements beyond the number of groups are not in use.
    pub groups: [Vec3<L>; MAX_GROUPS],
    /// Work of all packets that were traced so far.
    pub(crate) counts: Counts,
    /// Lanes of the packet whose paths have met the turned material once, twice, and so on.
    pub(crate) met: [L::Mask; MAX_ORDER],
}

impl<L: SimdFloat> Radiance<L> {
    /// Returns black samples.
    pub fn black() -> Self {
        Self {
            groups: [Vec3::zero(); MAX_GROUPS],
            counts: Counts::default(),
            met: [L::mask(false); MAX_ORDER],
        }
    }
}

/// Number of rays traced, and whether paths made random choices.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Number of rays: camera, shadow, reflected and transmitted.
    pub rays: u64,
    /// `true` if a path sampled a glossy lobe or a point of an emitter, or chose between reflection
    /// and transmission at random.
    pub glossy: bool,
    /// Largest number of reflections of a path by the turned material of the world, at most
    /// [`MAX_ORDER`] + 1.
    pub meetings: u8,
}

impl Counts {
    /// Adds one ray for each of `lanes`.
    #[inline(always)]
    pub(crate) fn add_rays(&mut self, lanes: impl Mask) {
        self.rays += u64::from(lanes.bits().count_ones());
    }

    /// Returns the counts of the packets of `self` and of `other`.
    pub fn and(self, other: Self) -> Self {
        Self {
            rays: self.rays + other.rays,
            glossy: self.glossy | other.glossy,
            meetings: self.meetings.max(other.meetings),
        }
    }
}

/// Packet of paths, each at its current vertex (the camera or a surface).
#[derive(Clone, Copy)]
pub struct Path<L> {
    /// Rays from the current vertices of the paths.
    pub ray: Ray<L>,
    /// Factor by which radiance along the ray contributes to the radiance of the sample (beta).
    pub throughput: Vec3<L>,
    /// Density [1/sr] with which the ray was sampled; the largest finite number for camera rays,
    /// mirrors and refraction. It is used only in worlds with emitters.
    pub lobe_pdf: L,
    /// Distance that the ray has travelled through clear panes since it was sampled.
    pub passed: L,
}

impl<L: SimdFloat> Path<L> {
    /// Largest throughput of a path. A larger throughput would saturate the film. An infinite
    /// throughput times an albedo of 0 would be NaN.
    const MAX_THROUGHPUT: f64 = (1u64 << 60) as f64;

    /// Creates the paths of the camera rays `ray`, with throughput 1.
    #[inline(always)]
    pub fn new(ray: Ray<L>) -> Self {
        Self {
            ray,
            throughput: Vec3::of([1.0; 3]),
            lobe_pdf: L::from_f64(L::MAX),
            passed: L::zero(),
        }
    }

    /// Returns `yes` in the lanes of `mask` and `no` elsewhere.
    #[inline(always)]
    pub(crate) fn select(mask: L::Mask, yes: &Self, no: &Self) -> Self {
        Self {
            ray: Ray {
                origin: Vec3::select(mask, yes.ray.origin, no.ray.origin),
                direction: Vec3::select(mask, yes.ray.direction, no.ray.direction),
            },
            throughput: Vec3::select(mask, yes.throughput, no.throughput),
            lobe_pdf: L::select(mask, yes.lobe_pdf, no.lobe_pdf),
            passed: L::select(mask, yes.passed, no.passed),
        }
    }

    /// Returns the density [1/sr] with which a point of `light` is sampled that the ray hits at
    /// distance `t`, on `triangle` of a mesh. Points are sampled from the origin of the ray before
    /// all clear panes.
    #[inline(always)]
    pub(crate) fn light_density(&self, light: &Emitter<L::Scalar>, t: L, triangle: L) -> L {
        light.density(self.receiver(), t + self.passed, triangle)
    }

    /// Returns the origin of the ray before all clear panes.
    #[inline(always)]
    pub(crate) fn receiver(&self) -> Vec3<L> {
        self.ray.direction.mul_add(-self.passed, self.ray.origin)
    }

    /// Returns `throughput`, limited to 2^60 in each channel. Mirrors that amplify light would let
    /// it grow without limit.
    #[inline(always)]
    pub fn bounded(throughput: Vec3<L>) -> Vec3<L> {
        let max = L::from_f64(Self::MAX_THROUGHPUT);
        Vec3::new(max.min(throughput.x), max.min(throughput.y), max.min(throughput.z))
    }
}
