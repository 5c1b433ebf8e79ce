//! Queue of paths that have left their first diffuse bounce, in worlds with many bounces and without
//! transmission.
//!
//! Such paths end one after the other: they escape, reach a black surface, or lose a game of Russian
//! roulette. The lanes that go on are therefore collected over many packets and traced in full ones,
//! surface by surface. At each surface a path goes one way only: along a diffuse bounce or along a
//! reflected ray. No sample depends on the packet in which its path is traced.

use crate::integrator::Integrator;
use crate::integrator::indirect_diffuse::{DiffuseReservoir, Walk};
use crate::integrator::path::{Path, Radiance};
use crate::world::World;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Float, MAX_WIDTH, Mask, SimdFloat, SimdU32, Vec3, array_from_fn};
use zerkalo_kernel::sampling::{PacketSampler, Sampler};

/// Number of packets of camera rays whose paths a queue holds.
pub(crate) const BATCH: usize = 16;

/// Number of diffuse bounces after which paths take part in Russian roulette. The first bounces have
/// most of the noise.
const FIRST_ROULETTE: u32 = 2;

/// Number of floats of a queued path.
const FLOATS: usize = 12;

/// Paths that leave the surfaces of a packet, to be queued.
pub(crate) struct QueuedPaths<L: SimdFloat> {
    pub path: Path<L>,
    /// Diffuse bounces of each path, with the one that it leaves.
    pub bounces: L,
    /// Reflections since the latest diffuse bounce.
    pub reflections: L,
}

/// Largest number of paths in a queue, with room for one packet that is stored whole.
const CAPACITY: usize = (BATCH + 1) * MAX_WIDTH;

/// Paths in the order of arrival.
struct Paths<S> {
    count: usize,
    floats: Box<[[S; CAPACITY]; FLOATS]>,
    /// Key and index of the path's padded sets, and number of its sample.
    integers: Box<[[u32; CAPACITY]; 3]>,
}

impl<S: Float> Paths<S> {
    fn new() -> Self {
        let floats = Box::new([[S::default(); CAPACITY]; FLOATS]);
        Self { count: 0, floats, integers: Box::new([[0; CAPACITY]; 3]) }
    }

    /// Adds the lanes `mask` of `paths` and of `integers`.
    #[inline(always)]
    fn push<L: SimdFloat<Scalar = S>>(
        &mut self,
        paths: &QueuedPaths<L>,
        integers: &[[u32; MAX_WIDTH]; 3],
        mask: L::Mask,
    ) {
        let (lanes, count) = lanes_of(mask);
        let Path { ray: Ray { origin: o, direction: d }, throughput: t, lobe_pdf, .. } = paths.path;
        let QueuedPaths { bounces, reflections, .. } = *paths;
        let floats = [o.x, o.y, o.z, d.x, d.y, d.z, t.x, t.y, t.z, lobe_pdf, bounces, reflections];
        let first = self.count;
        for (column, value) in self.floats.iter_mut().zip(floats) {
            let own: [S; MAX_WIDTH] = array_from_fn(|i| value.lane(i % L::WIDTH));
            let packed = L::gather(&own, &lanes);
            if let Some(part) = column[first..].first_chunk_mut::<MAX_WIDTH>() {
                for (i, value) in part[..L::WIDTH].iter_mut().enumerate() {
                    *value = packed.lane(i);
                }
            }
        }
        for (column, own) in self.integers.iter_mut().zip(integers) {
            if let Some(part) = column[first..].first_chunk_mut::<MAX_WIDTH>() {
                *part = array_from_fn(|i| own[lanes[i] as usize % MAX_WIDTH]);
            }
        }
        self.count += count;
    }

    /// Takes the last packet of paths: the paths, their integers, and the number of paths.
    #[inline(always)]
    fn pop<L: SimdFloat<Scalar = S>>(
        &mut self,
    ) -> Option<(QueuedPaths<L>, [[u32; MAX_WIDTH]; 3], usize)> {
        let count = self.count.min(L::WIDTH);
        if count == 0 {
            return None;
        }
        self.count -= count;
        let first = self.count;
        let integers = array_from_fn(|i| {
            self.integers[i][first..].first_chunk().copied().unwrap_or([0; MAX_WIDTH])
        });
        let floats: [L; FLOATS] = array_from_fn(|i| {
            let part = self.floats[i][first..].first_chunk::<MAX_WIDTH>();
            let part = part.copied().unwrap_or([S::default(); MAX_WIDTH]);
            L::from_fn(|lane| part[lane])
        });
        let [ox, oy, oz, dx, dy, dz, tx, ty, tz, lobe_pdf, bounces, reflections] = floats;
        let ray = Ray { origin: Vec3::new(ox, oy, oz), direction: Vec3::new(dx, dy, dz) };
        let throughput = Vec3::new(tx, ty, tz);
        let path = Path { ray, throughput, lobe_pdf, passed: L::zero() };
        Some((QueuedPaths { path, bounces, reflections }, integers, count))
    }
}

/// Returns the numbers of the lanes of `mask`, and how many there are.
#[inline(always)]
fn lanes_of(mask: impl Mask) -> ([u32; MAX_WIDTH], usize) {
    let (mut bits, mut lanes, mut count) = (mask.bits(), [0; MAX_WIDTH], 0);
    while bits != 0 {
        lanes[count % MAX_WIDTH] = bits.trailing_zeros();
        bits &= bits - 1;
        count += 1;
    }
    (lanes, count)
}

/// Returns the first `count` lanes.
#[inline(always)]
pub(crate) fn first_lanes<L: SimdFloat>(count: usize) -> L::Mask {
    if count == L::WIDTH {
        return L::mask(true);
    }
    let lanes = L::from_fn(|lane| L::Scalar::from_f64(if lane < count { 1.0 } else { 0.0 }));
    lanes.gt(L::zero())
}

/// Queue of the paths of a batch of packets.
pub struct BounceQueue<L: SimdFloat> {
    paths: Paths<L::Scalar>,
    /// Those of `paths` that go on from their next surfaces.
    next: Paths<L::Scalar>,
    /// Radiance of the packets of the batch.
    batch: Vec<Vec3<L>>,
    /// Number of packets of the batch that were traced.
    pub(crate) traced: usize,
    /// Radiance that the queued paths have added: group after group, sample after sample.
    sums: Vec<[L::Scalar; 3]>,
}

impl<L: SimdFloat> BounceQueue<L> {
    pub(crate) fn new(world: &World<L>) -> Self {
        let groups = world.info.scales.len();
        Self {
            paths: Paths::new(),
            next: Paths::new(),
            batch: vec![Vec3::zero(); BATCH * groups],
            traced: 0,
            sums: vec![[L::Scalar::default(); 3]; BATCH * L::WIDTH * groups],
        }
    }

    /// Adds `lanes` of the packet that is being traced, whose random numbers are those of `sampler`.
    #[inline(never)]
    pub(crate) fn push(&mut self, path: Path<L>, lanes: L::Mask, sampler: &PacketSampler<'_, L>) {
        let paths = QueuedPaths { path, bounces: L::one(), reflections: L::zero() };
        let first = self.traced * L::WIDTH;
        let integer = |i: usize| {
            array_from_fn(|lane| match i {
                0 | 1 => sampler.state(lane % L::WIDTH)[i],
                _ => (first + lane) as u32,
            })
        };
        self.paths.push(&paths, &array_from_fn(integer), lanes);
    }

    /// Keeps the radiance `last` of the packet that was traced last. Returns the number of packets that
    /// are complete: all of the batch if it is full or the packet `is_last`, otherwise none.
    #[inline(never)]
    pub(crate) fn finished(
        &mut self,
        world: &World<L>,
        sampler: &Sampler<L>,
        is_last: bool,
        last: &mut Radiance<L>,
    ) -> usize {
        let groups = world.info.scales.len();
        self.batch[self.traced * groups..][..groups].copy_from_slice(&last.groups[..groups]);
        self.traced += 1;
        if !is_last && self.traced < BATCH {
            return 0;
        }
        self.finish(world, sampler, last);
        std::mem::take(&mut self.traced)
    }

    /// Copies the radiance of complete packet number `packet` to `out`.
    #[inline(never)]
    pub(crate) fn restore(&self, packet: usize, groups: usize, out: &mut Radiance<L>) {
        out.groups[..groups].copy_from_slice(&self.batch[packet * groups..][..groups]);
    }

    /// Traces the queued paths to their ends and adds their radiance to that of their packets.
    /// `scratch` counts the rays.
    #[inline(never)]
    pub fn finish(&mut self, world: &World<L>, sampler: &Sampler<L>, scratch: &mut Radiance<L>) {
        let groups = world.info.scales.len();
        let samples = BATCH * L::WIDTH;
        self.sums.fill([L::Scalar::default(); 3]);
        for step in 1.. {
            while let Some((mut paths, integers, count)) = self.paths.pop::<L>() {
                scratch.groups[..groups].fill(Vec3::zero());
                let [keys, indices, numbers] = integers;
                let block = sampler.padded_block(L::SimdU32::from_fn(|i| indices[i]));
                let sampler = block.for_pixels(L::SimdU32::from_fn(|i| keys[i])).generation(step);
                let active = first_lanes::<L>(count);
                let lanes = world.walk(&mut paths, active, step, &sampler, scratch);
                self.next.push(&paths, &integers, lanes);
                for (group, value) in scratch.groups[..groups].iter().enumerate() {
                    let bright = active.and_not(value.max_element().le(L::zero()));
                    let (lanes, bright) = lanes_of(bright);
                    let sums = &mut self.sums[group * samples..][..samples];
                    for lane in &lanes[..bright] {
                        let lane = *lane as usize % L::WIDTH;
                        let sum = &mut sums[numbers[lane] as usize];
                        let value = value.lane(lane);
                        *sum = array_from_fn(|i| sum[i].plus(value[i]));
                    }
                }
            }
            if self.next.count == 0 {
                break;
            }
            std::mem::swap(&mut self.paths, &mut self.next);
        }
        for (packet, radiance) in self.batch.chunks_exact_mut(groups).enumerate() {
            for (group, value) in radiance.iter_mut().enumerate() {
                let sums = &self.sums[group * samples + packet * L::WIDTH..][..L::WIDTH];
                *value += Vec3::from_fn(|lane| sums[lane]);
            }
        }
    }
}

impl<L: SimdFloat> World<L> {
    /// Returns `true` if paths are queued at their first diffuse bounce.
    pub(crate) fn walks(&self) -> bool {
        self.diffuse_limits.is_some_and(|limits| limits.walks)
    }

    /// Traces `active` paths to their next surfaces, the surfaces number `step` after the first
    /// diffuse bounce, and adds the radiance of these. Replaces `paths` by the paths that go on, and
    /// returns their lanes.
    #[inline(always)]
    fn walk(
        &self,
        paths: &mut QueuedPaths<L>,
        active: L::Mask,
        step: u32,
        sampler: &PacketSampler<'_, L>,
        out: &mut Radiance<L>,
    ) -> L::Mask {
        let Some(limits) = self.diffuse_limits else { return L::mask(false) };
        let depth = if limits.caustics { self.depth } else { 0 };
        let limit = |depth: u32| L::from_f64(f64::from(depth));
        let may_bounce = paths.bounces.lt(limit(limits.depth));
        let may_reflect = paths.reflections.lt(limit(depth));
        let may_end = paths.bounces.ge(limit(FIRST_ROULETTE));
        let walk = Walk::new(step, [may_bounce, may_reflect, may_end]);
        let mut reservoir = DiffuseReservoir::walking(walk);
        let candidates = &self.culling.all_candidates;
        let integrator = Integrator { world: self, sampler, candidates, depth: u32::MAX };
        integrator.trace_opaque::<false>(&mut paths.path, active, Some(&mut reservoir), out);
        let Some(Walk { bounces, reflects, .. }) = reservoir.walk else { return L::mask(false) };
        paths.reflections = (paths.reflections + L::one()).masked(reflects);
        paths.bounces += L::one().masked(bounces);
        bounces | reflects
    }
}
