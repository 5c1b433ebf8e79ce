//! Packet sampler: the random numbers of the samples in the lanes of a packet.

use crate::lanes::{MAX_WIDTH, SimdFloat, SimdU32, array_from_fn};
use crate::sampling::hash::{hash, hash_scalar, hash_words};
use crate::sampling::sobol::{
    self, DIMENSIONS, owen, owen_factor, owen_scramble_prefix, owen_scramble_suffix,
};

/// Kind of the random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplerKind {
    /// Owen-scrambled Sobol points. The first eight dimensions of a sample, the *joint set*, are
    /// stratified together. Further dimensions come from *padded sets*: the same points with
    /// shuffled indices.
    Sobol,
    /// Independent random numbers.
    Random,
}

impl SamplerKind {
    /// Returns the name of the kind on the command line and in file headers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sobol => "sobol",
            Self::Random => "random",
        }
    }

    /// Returns the kind with the name `name`; `None` if there is no such kind.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Sobol, Self::Random].into_iter().find(|kind| kind.name() == name)
    }
}

/// Settings that determine the random numbers of all samples of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleSettings {
    /// Random seed. The errors of pictures with different seeds are independent.
    pub seed: u64,
    /// Kind of the random numbers.
    pub kind: SamplerKind,
}

/// Number of dimensions, the last ones of the joint set, for a path's first choices between
/// reflection and transmission. With indirect diffuse light, the first diffuse bounce takes them.
const CHOICES: u32 = 2;

/// Largest number of surfaces on a path whose sampled directions come from the joint set.
const MAX_JOINT_LOBES: u32 = 2;

/// Number of ways to divide a packet among pixels: 2^k samples of each pixel for each k.
const PACKET_SHAPES: usize = MAX_WIDTH.ilog2() as usize + 1;

/// Random positions that camera rays use. Each takes two dimensions, starting with dimension 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CameraDimensions {
    /// `true` if samples are distributed over the area of their pixel.
    pub pixel: bool,
    /// `true` if samples are distributed over a lens.
    pub lens: bool,
}

/// Sampler of a picture: tables and constants for the random numbers that all packets share.
pub struct Sampler<L: SimdFloat> {
    settings: SampleSettings,
    /// Two hash words of the random seed for each replicate.
    seeds: [[u32; 2]; 2],
    /// First dimension of the position on the lens.
    lens: usize,
    /// First dimension of the direction sampled at a path's first surface.
    first_lobe: usize,
    /// Number of surfaces on a path whose sampled directions come from the joint set.
    joint_lobes: u32,
    /// Table `low_bits[k][d]`: Sobol points 0 to 2^k - 1 in dimension d, repeated over the lanes,
    /// for packets with 2^k samples of each pixel.
    low_bits: [[L::SimdU32; DIMENSIONS]; PACKET_SHAPES],
    /// Lane indices 0, 1, 2 and so on.
    ramp: L::SimdU32,
    /// Constant of each dimension that is hashed with the key, so that scramblings differ.
    dimension_salt: [u32; DIMENSIONS],
}

/// Sobol points of successive sample indices, which the packets of all pixels share.
pub struct SampleBlock<'a, L: SimdFloat> {
    sampler: &'a Sampler<L>,
    /// Sample index of each lane, within the sequence of its pixel.
    index: L::SimdU32,
    /// Sobol points in each dimension, after [`owen_scramble_prefix`].
    owen_prefix: [L::SimdU32; DIMENSIONS],
}

impl<L: SimdFloat> Sampler<L> {
    /// Creates the sampler of a picture.
    pub fn new(settings: SampleSettings, camera: CameraDimensions) -> Self {
        let lens = if camera.pixel { 2 } else { 0 };
        let first_lobe = lens + if camera.lens { 2 } else { 0 };
        let free = DIMENSIONS - CHOICES as usize - first_lobe;
        let word = |replicate: u32, purpose: u32| {
            hash_words(&[settings.seed as u32, (settings.seed >> 32) as u32, replicate, purpose])
        };
        let low_bits = |k: usize, d| {
            L::SimdU32::from_fn(|lane| sobol::point(d, lane as u32 & ((1u32 << k) - 1)))
        };
        Self {
            settings,
            seeds: [0, 1].map(|replicate| [word(replicate, 0), word(replicate, 1)]),
            lens,
            first_lobe,
            joint_lobes: (free as u32 / 2).min(MAX_JOINT_LOBES),
            low_bits: array_from_fn(|k| array_from_fn(|d| low_bits(k, d))),
            ramp: L::SimdU32::from_fn(|lane| lane as u32),
            dimension_salt: array_from_fn(|d| hash_scalar(d as u32 + 1)),
        }
    }

    /// Creates a block of samples: the Sobol points of the sample indices `first..first + count`,
    /// for packets of `WIDTH / count` pixels. Lane i has index `first + i % count`. `count` must be
    /// a power of two, at most `WIDTH`, and `first` a multiple of `count`.
    pub fn block(&self, first: u32, count: usize) -> SampleBlock<'_, L> {
        debug_assert!(count.is_power_of_two() && count <= L::WIDTH);
        debug_assert!((first as usize).is_multiple_of(count));
        // Sobol point `first + i` is point `first` XOR point i, because `first` is a multiple of
        // `count`, a power of two.
        let low_bits = &self.low_bits[count.ilog2() as usize];
        let point = |d| L::SimdU32::splat(sobol::point(d, first)) ^ low_bits[d];
        let owen_prefix = array_from_fn(|d| owen_scramble_prefix(point(d)));
        let within = self.ramp & L::SimdU32::splat(count as u32 - 1);
        SampleBlock { sampler: self, index: L::SimdU32::splat(first) + within, owen_prefix }
    }

    /// Creates a block of the samples with any indices `index`, for padded sets alone.
    #[inline(always)]
    pub fn padded_block(&self, index: L::SimdU32) -> SampleBlock<'_, L> {
        let owen_prefix = [L::SimdU32::splat(0); DIMENSIONS];
        SampleBlock { sampler: self, index, owen_prefix }
    }

    /// Returns the scrambling key of the samples of a pixel in `replicate` 0 (A) or 1 (B). Keys are
    /// distinct for all pixels of a picture up to 65536 x 65536, because every step is a bijection
    /// of the packed coordinates.
    #[inline(always)]
    pub fn key(&self, (x, y): (u32, u32), replicate: usize) -> u32 {
        let [before, after] = self.seeds[replicate];
        hash_scalar(hash_scalar((x | y << 16) ^ before) ^ after)
    }
}

impl<L: SimdFloat> SampleBlock<'_, L> {
    /// Creates the sampler of a packet of one pixel, whose [`Sampler::key`] is `key`.
    #[inline(always)]
    pub fn for_pixel(&self, key: u32) -> PacketSampler<'_, L> {
        PacketSampler { single_key: Some(key), ..self.for_pixels(L::SimdU32::splat(key)) }
    }

    /// Creates the sampler of a packet of several pixels. `keys` has the key of each lane's pixel.
    #[inline(always)]
    pub fn for_pixels(&self, keys: L::SimdU32) -> PacketSampler<'_, L> {
        PacketSampler { points: self, key: keys, single_key: None, first_lobe: 0, first_choice: 0 }
    }
}

/// Number of sampled directions, and number of choices, that have random numbers of their own in
/// each *segment* of a path. Diffuse bounces divide a path into segments.
const PER_GENERATION: u32 = 1 << 16;

/// Number of the first choice of a reservoir. Smaller numbers belong to choices between reflection
/// and transmission.
const RESERVOIR: u32 = 1 << 31;

/// Random numbers of the samples in one packet. Each method returns the numbers for one purpose.
#[derive(Clone, Copy)]
pub struct PacketSampler<'a, L: SimdFloat> {
    points: &'a SampleBlock<'a, L>,
    /// Scrambling key of each lane's pixel.
    key: L::SimdU32,
    /// Scrambling key if all lanes belong to the same pixel.
    single_key: Option<u32>,
    /// Number of the first sampled direction in the segment.
    first_lobe: u32,
    /// Number of the first choice between reflection and transmission in the segment.
    first_choice: u32,
}

impl<L: SimdFloat> PacketSampler<'_, L> {
    /// Returns the scrambling key and the sample index of lane `i`, with which
    /// [`Sampler::padded_block`] and [`SampleBlock::for_pixels`] restore its padded sets.
    #[inline(always)]
    pub fn state(&self, i: usize) -> [u32; 2] {
        [self.key.lane(i), self.points.index.lane(i)]
    }

    /// Returns the random numbers for the segment of each path after `generation` diffuse bounces.
    /// The choices in this segment use only padded sets.
    #[inline(always)]
    pub fn generation(&self, generation: u32) -> Self {
        let first_lobe = generation * PER_GENERATION;
        Self { first_lobe, first_choice: first_lobe + CHOICES, ..*self }
    }

    /// Returns two numbers in [0, 1) for the direction of diffuse bounce `number`, counted from 0.
    #[inline(always)]
    pub fn diffuse_2d(&self, number: u32) -> (L, L) {
        if number == 0 {
            let d = DIMENSIONS - CHOICES as usize;
            (self.joint(d, 0), self.joint(d + 1, 0))
        } else {
            self.padded((number + 1) * PER_GENERATION - 1, 0)
        }
    }

    /// Returns a random number in [0, 1) for candidate `number` of a resampling reservoir.
    #[inline(always)]
    pub fn reservoir_1d(&self, number: u32) -> L {
        self.padded_choice(RESERVOIR + self.first_choice + number)
    }

    /// Returns the position of each sample in its pixel: two coordinates in [0, 1).
    #[inline(always)]
    pub fn pixel(&self) -> (L, L) {
        (self.joint(0, 0), self.joint(1, 0))
    }

    /// Returns two random numbers in [0, 1) for the position on the camera's lens.
    #[inline(always)]
    pub fn lens(&self) -> (L, L) {
        let d = self.points.sampler.lens;
        (self.joint(d, 0), self.joint(d + 1, 0))
    }

    /// Returns two random numbers in [0, 1) for the direction sampled at the surface that a path
    /// hits after `bounce` reflections.
    #[inline(always)]
    pub fn lobe_2d(&self, bounce: u32) -> (L, L) {
        self.pair_2d(bounce, 0)
    }

    /// Returns two random numbers in [0, 1) for a point on emitter `light`, as seen from the
    /// surface that a path hits after `bounce` reflections.
    ///
    /// The numbers are those of [`Self::lobe_2d`] with another scrambling. Lobe and emitter may
    /// share dimensions, because their light is added, never multiplied.
    #[inline(always)]
    pub fn light_2d(&self, bounce: u32, light: u32) -> (L, L) {
        self.pair_2d(bounce, hash_scalar(light + 1))
    }

    /// Returns a random number in [0, 1) for the choice among sets of point and spot lights, at the
    /// surface that a path hits after `bounce` reflections. The number is one of [`Self::light_2d`]
    /// with another scrambling.
    #[inline(always)]
    pub fn light_choice_1d(&self, bounce: u32) -> L {
        self.light_2d(bounce, u32::MAX - 1).0
    }

    /// Returns the two random numbers for the surface after `bounce` reflections, scrambled with
    /// `salt`.
    #[inline(always)]
    fn pair_2d(&self, bounce: u32, salt: u32) -> (L, L) {
        let Sampler { first_lobe, joint_lobes, .. } = self.points.sampler;
        let bounce = bounce + self.first_lobe;
        let d = first_lobe + 2 * bounce as usize;
        match bounce.checked_sub(*joint_lobes) {
            None => (self.joint(d, salt), self.joint(d + 1, salt)),
            Some(further) => self.padded(further, salt),
        }
    }

    /// Returns a random number in [0, 1) for choice `number` between reflection and transmission,
    /// counted from 0.
    #[inline(always)]
    pub fn branch_1d(&self, number: u32) -> L {
        let number = number + self.first_choice;
        if number < CHOICES {
            self.joint(DIMENSIONS - CHOICES as usize + number as usize, 0)
        } else {
            self.padded_choice(number - CHOICES)
        }
    }

    /// Returns dimension `d` of the joint set, scrambled with `salt`.
    #[inline(always)]
    fn joint(&self, d: usize, salt: u32) -> L {
        let points = self.points;
        let dimension_salt = points.sampler.dimension_salt[d] ^ salt;
        let seed = match self.single_key {
            Some(key) => L::SimdU32::splat(hash_scalar(key ^ dimension_salt)),
            None => hash(self.key ^ L::SimdU32::splat(dimension_salt)),
        };
        match points.sampler.settings.kind {
            SamplerKind::Random => L::to_unit(hash(hash(points.index ^ seed) + self.key)),
            SamplerKind::Sobol => L::to_unit(
                owen_scramble_suffix(points.owen_prefix[d], seed, owen_factor(seed)).reverse(),
            ),
        }
    }

    /// Returns two dimensions of a padded set for the sampled direction with the number `pair`,
    /// scrambled with `salt`. Four directions share a set.
    #[cold]
    fn padded(&self, pair: u32, salt: u32) -> (L, L) {
        let d = 2 * (pair % 4) as usize;
        let [a, b] = self.padded_set((pair / 4 + 1) ^ 0x5bd1_e995, [d, d + 1], salt);
        (a, b)
    }

    /// Returns a dimension of a padded set for choice `number`. Eight choices share a set.
    #[cold]
    fn padded_choice(&self, number: u32) -> L {
        let per_set = DIMENSIONS as u32;
        let [x] =
            self.padded_set((number / per_set + 1) ^ 0x9e37_79b9, [(number % per_set) as usize], 0);
        x
    }

    /// Returns `dimensions` of the padded set with the number `set`, scrambled with `salt`.
    #[inline(always)]
    fn padded_set<const N: usize>(&self, set: u32, dimensions: [usize; N], salt: u32) -> [L; N] {
        let SampleBlock { sampler, index, .. } = self.points;
        let key = hash(self.key + L::SimdU32::splat(hash_scalar(set)));
        let shuffled = owen(index.reverse(), key).reverse();
        dimensions.map(|d| {
            let seed = hash(key ^ L::SimdU32::splat(sampler.dimension_salt[d] ^ salt));
            match sampler.settings.kind {
                SamplerKind::Random => L::to_unit(hash(hash(*index ^ seed) + key)),
                SamplerKind::Sobol => {
                    let x = L::SimdU32::from_fn(|lane| sobol::point(d, shuffled.lane(lane)));
                    L::to_unit(owen(x, seed).reverse())
                }
            }
        })
    }
}
