//! Packet sampler: the random numbers of the samples in the lanes of a packet.

use crate::lanes::{MAX_WIDTH, SimdFloat, SimdU32, array_from_fn};
use crate::sampling::hash::{
    hash, hash_scalar, hash_words, owen, owen_factor, owen_scramble_prefix, owen_scramble_suffix,
};
use crate::sampling::sobol;
use crate::sampling::sobol::DIMENSIONS;

/// Sample sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplerKind {
    /// Owen-scrambled Sobol points in eight dimensions (the joint set). Further dimensions are
    /// taken from further sets of the same points with shuffled indices (the padded sets).
    Sobol,
    /// Independent random numbers.
    Random,
}

impl SamplerKind {
    /// Name on the command line and in file headers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sobol => "sobol",
            Self::Random => "random",
        }
    }
}

/// Settings that determine all samples of a picture. A sample depends only on these settings, its
/// pixel, its replicate and its index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleSettings {
    /// Random seed. The errors of pictures with different seeds are independent.
    pub seed: u64,
    /// Sample sequence.
    pub kind: SamplerKind,
}

/// Number of dimensions of the joint set that are reserved for the first branch choices of a path
/// (reflection or transmission). They are its last dimensions.
const CHOICES: u32 = 2;

/// Largest number of lobes in the joint set.
const MAX_JOINT_LOBES: u32 = 2;

/// Number of powers of two up to the widest packet: the possible numbers of samples of one pixel in
/// a packet.
const PACKET_SHAPES: usize = MAX_WIDTH.ilog2() as usize + 1;

/// Choice of the camera's random numbers: each takes two dimensions at the start of the joint set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CameraDimensions {
    /// `true` if samples are distributed over the area of their pixel.
    pub pixel: bool,
    /// `true` if samples are distributed over a lens.
    pub lens: bool,
}

/// Sampler of a picture: tables and constants that all packets share.
pub struct Sampler<L: SimdFloat> {
    settings: SampleSettings,
    /// Two words per replicate, hashed from the seed.
    seeds: [[u32; 2]; 2],
    /// First dimension of the position on the lens. If samples are distributed over the pixel, the
    /// two dimensions before it are the position in the pixel.
    lens: usize,
    /// First dimension of the first lobe.
    first_lobe: usize,
    /// Number of lobes in the joint set. Further lobes belong to the padded sets.
    joint_lobes: u32,
    /// `low_bits[k][d]` holds the Sobol points 0..2^k in dimension d, repeated over the lanes.
    low_bits: [[L::SimdU32; DIMENSIONS]; PACKET_SHAPES],
    /// Lane indices 0, 1, 2 and so on.
    ramp: L::SimdU32,
    /// Constant for each dimension, so that dimensions are scrambled independently.
    dimension_salt: [u32; DIMENSIONS],
}

/// Part of a packet's random numbers that depends on the sample indices and not on the pixels.
pub struct SampleBlock<'a, L: SimdFloat> {
    sampler: &'a Sampler<L>,
    /// Sample index in each lane.
    index: L::SimdU32,
    /// `owen_prefix[d]`: Sobol points of the indices in dimension d, after
    /// [`owen_scramble_prefix`].
    owen_prefix: [L::SimdU32; DIMENSIONS],
}

impl<L: SimdFloat> Sampler<L> {
    /// Creates the sampler of a picture. `camera` are the dimensions that its camera rays use.
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

    /// Creates the block of the indices `first..first + count` for packets of `WIDTH / count`
    /// pixels: lane i has index `first + i % count`. `count` is a power of two, at most `WIDTH`,
    /// and `first` a multiple of it.
    pub fn block(&self, first: u32, count: usize) -> SampleBlock<'_, L> {
        debug_assert!(count.is_power_of_two() && count <= L::WIDTH);
        debug_assert!((first as usize).is_multiple_of(count));
        // Points at aligned indices are the first point XOR constants.
        let low_bits = &self.low_bits[count.ilog2() as usize];
        let point = |d| L::SimdU32::splat(sobol::point(d, first)) ^ low_bits[d];
        let owen_prefix = array_from_fn(|d| owen_scramble_prefix(point(d)));
        let within = self.ramp & L::SimdU32::splat(count as u32 - 1);
        SampleBlock { sampler: self, index: L::SimdU32::splat(first) + within, owen_prefix }
    }

    /// Key of a pixel's samples in one replicate (0: A, 1: B). Keys are distinct for all pixels of
    /// a picture up to 65536 x 65536, because every step is a bijection of the packed coordinates.
    #[inline(always)]
    pub fn key(&self, (x, y): (u32, u32), replicate: usize) -> u32 {
        let [before, after] = self.seeds[replicate];
        hash_scalar(hash_scalar((x | y << 16) ^ before) ^ after)
    }
}

impl<L: SimdFloat> SampleBlock<'_, L> {
    /// Creates the sampler of a packet with samples of one pixel. `key` is its [`Sampler::key`].
    #[inline(always)]
    pub fn for_pixel(&self, key: u32) -> PacketSampler<'_, L> {
        PacketSampler {
            points: self,
            key: L::SimdU32::splat(key),
            single_key: Some(key),
            first_lobe: 0,
            first_choice: 0,
        }
    }

    /// Creates the sampler of a packet with samples of several pixels. `keys` holds the
    /// [`Sampler::key`] of the pixel in each lane.
    #[inline(always)]
    pub fn for_pixels(&self, keys: L::SimdU32) -> PacketSampler<'_, L> {
        PacketSampler { points: self, key: keys, single_key: None, first_lobe: 0, first_choice: 0 }
    }
}

/// Number of lobes, and of branch choices, that are reserved for each generation of a path with
/// diffuse bounces.
const PER_GENERATION: u32 = 1 << 16;

/// Number of the first of the branch choices that select the hit of a diffuse bounce (reservoir
/// sampling).
const RESERVOIR: u32 = 1 << 31;

/// Random numbers of one packet.
#[derive(Clone, Copy)]
pub struct PacketSampler<'a, L: SimdFloat> {
    points: &'a SampleBlock<'a, L>,
    /// Key of the pixel in each lane.
    key: L::SimdU32,
    /// Key of the pixel, if all lanes have the same one.
    single_key: Option<u32>,
    /// Number that is added to the numbers of lobes.
    first_lobe: u32,
    /// Number that is added to the numbers of branch choices.
    first_choice: u32,
}

impl<L: SimdFloat> PacketSampler<'_, L> {
    /// Returns the random numbers of one generation of a path with diffuse bounces: the part after
    /// `generation` diffuse bounces. The direction of the first diffuse bounce uses the dimensions
    /// of the first branch choices.
    #[inline(always)]
    pub fn generation(&self, generation: u32) -> Self {
        let first_lobe = generation * PER_GENERATION;
        Self { first_lobe, first_choice: first_lobe + CHOICES, ..*self }
    }

    /// Returns two numbers in [0, 1) for the direction of a path's diffuse bounce `number`, counted
    /// from 0.
    #[inline(always)]
    pub fn diffuse_2d(&self, number: u32) -> (L, L) {
        if number == 0 {
            let d = DIMENSIONS - CHOICES as usize;
            (self.joint(d, 0), self.joint(d + 1, 0))
        } else {
            self.padded((number + 1) * PER_GENERATION - 1, 0)
        }
    }

    /// Returns a number in [0, 1) for candidate `number` of the reservoir that selects the hit of
    /// this generation's diffuse bounce.
    #[inline(always)]
    pub fn reservoir_1d(&self, number: u32) -> L {
        self.padded_choice(RESERVOIR + self.first_choice + number)
    }

    /// Returns the position of each sample in its pixel, two coordinates in [0, 1).
    #[inline(always)]
    pub fn pixel(&self) -> (L, L) {
        (self.joint(0, 0), self.joint(1, 0))
    }

    /// Returns two numbers in [0, 1) for the position of each sample on the lens.
    #[inline(always)]
    pub fn lens(&self) -> (L, L) {
        let d = self.points.sampler.lens;
        (self.joint(d, 0), self.joint(d + 1, 0))
    }

    /// Returns two numbers in [0, 1) for the lobe of the surface that a path hits after `bounce`
    /// reflections.
    #[inline(always)]
    pub fn lobe_2d(&self, bounce: u32) -> (L, L) {
        self.pair_2d(bounce, 0)
    }

    /// Returns two numbers in [0, 1) for emitter `light` at the surface that a path hits after
    /// `bounce` reflections.
    ///
    /// They are the numbers of the lobe at this surface with another scrambling, so that both are
    /// stratified together with the position in the pixel and with the lobes of earlier surfaces.
    /// Light from an emitter and light along the lobe are added, never multiplied, so that they may
    /// share dimensions.
    #[inline(always)]
    pub fn light_2d(&self, bounce: u32, light: u32) -> (L, L) {
        self.pair_2d(bounce, hash_scalar(light + 1))
    }

    /// Returns a number in [0, 1) for the choice of point lights at the surface that a path hits
    /// after `bounce` reflections. It is a number of [`Self::light_2d`] under a scrambling of its
    /// own.
    #[inline(always)]
    pub fn light_choice_1d(&self, bounce: u32) -> L {
        self.light_2d(bounce, u32::MAX - 1).0
    }

    /// Returns the lobe's two dimensions at the surface after `bounce` reflections, scrambled with
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

    /// Returns a number in [0, 1) for branch choice `number` of a path: reflection or transmission.
    /// Choices are numbered from 0.
    #[inline(always)]
    pub fn branch_1d(&self, number: u32) -> L {
        let number = number + self.first_choice;
        if number < CHOICES {
            self.joint(DIMENSIONS - CHOICES as usize + number as usize, 0)
        } else {
            self.padded_choice(number - CHOICES)
        }
    }

    /// Returns dimension `d` of the joint set. Different values of `salt` give independent
    /// scramblings.
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

    /// Returns two numbers for lobe number `pair` of the padded sets, scrambled with `salt`. Four
    /// lobes share a set.
    #[cold]
    fn padded(&self, pair: u32, salt: u32) -> (L, L) {
        let d = 2 * (pair % 4) as usize;
        let [a, b] = self.padded_set((pair / 4 + 1) ^ 0x5bd1_e995, [d, d + 1], salt);
        (a, b)
    }

    /// Returns a number for branch choice `number` of the padded sets. Eight choices share a set.
    #[cold]
    fn padded_choice(&self, number: u32) -> L {
        let per_set = DIMENSIONS as u32;
        let [x] =
            self.padded_set((number / per_set + 1) ^ 0x9e37_79b9, [(number % per_set) as usize], 0);
        x
    }

    /// Returns the given `dimensions` of the padded set `set`, scrambled with `salt`. Each padded
    /// set shuffles the sample indices by a key of its own.
    #[inline(always)]
    fn padded_set<const N: usize>(&self, set: u32, dimensions: [usize; N], salt: u32) -> [L; N] {
        let SampleBlock { sampler, index, .. } = self.points;
        let key = hash(self.key + L::SimdU32::splat(hash_scalar(set)));
        let shuffled = owen(index.reverse(), key).reverse();
        let mut indices = [0; MAX_WIDTH];
        for (lane, index) in indices.iter_mut().enumerate().take(L::WIDTH) {
            *index = shuffled.lane(lane);
        }
        dimensions.map(|d| {
            let seed = hash(key ^ L::SimdU32::splat(sampler.dimension_salt[d] ^ salt));
            match sampler.settings.kind {
                SamplerKind::Random => L::to_unit(hash(hash(*index ^ seed) + key)),
                SamplerKind::Sobol => {
                    let x = L::SimdU32::from_fn(|lane| sobol::point(d, indices[lane]));
                    L::to_unit(owen(x, seed).reverse())
                }
            }
        })
    }
}
