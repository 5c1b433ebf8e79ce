//! The random numbers of a packet of samples.

use super::hash::{fold, mix, mix1, owen};
use super::sobol::{self, DIMENSIONS};
use crate::lanes::{Bits, Lanes, MAX_WIDTH};

/// Which sequence samples come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplerKind {
    /// A joint Owen-scrambled Sobol set in eight dimensions, padded by further sets.
    Sobol,
    /// Independent random numbers.
    Random,
}

impl SamplerKind {
    /// As written on the command line and in file headers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sobol => "sobol",
            Self::Random => "random",
        }
    }
}

/// What every sample of a picture depends on beside its pixel, replicate and index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleSettings {
    /// Any number; another number gives another, independent picture of the same scene.
    pub seed: u64,
    /// The sequence.
    pub kind: SamplerKind,
}

/// The numbers that samples of a lane type start from.
pub struct Sampler<L: Lanes> {
    settings: SampleSettings,
    /// Two words per replicate, from the seed.
    seeds: [[u32; 2]; 2],
    /// Dimensions of the first lobe: after the two of the pixel, if these are used.
    first_lobe: usize,
    /// `low[d]`: Sobol points 0..WIDTH in dimension d.
    low: [L::Bits; DIMENSIONS],
    /// 0, 1, 2, ... in the lanes.
    ramp: L::Bits,
}

impl<L: Lanes> Sampler<L> {
    /// `jitter`: samples move inside their pixel and use the first two dimensions for that;
    /// otherwise the lobes have them.
    pub fn new(settings: SampleSettings, jitter: bool) -> Self {
        let word = |replicate: u32, use_: u32| {
            fold(&[settings.seed as u32, (settings.seed >> 32) as u32, replicate, use_])
        };
        let low = |d| L::Bits::from_fn(|lane| sobol::point(d, lane as u32));
        Self {
            settings,
            seeds: [0, 1].map(|replicate| [word(replicate, 0), word(replicate, 1)]),
            first_lobe: if jitter { 2 } else { 0 },
            low: std::array::from_fn(low),
            ramp: L::Bits::from_fn(|lane| lane as u32),
        }
    }

    /// The key of a pixel's samples in one replicate (0: A, 1: B). Distinct for all pixels of a
    /// picture up to 65536 x 65536, since every step is a bijection of the packed coordinates.
    #[inline(always)]
    fn key(&self, x: u32, y: u32, replicate: usize) -> u32 {
        let [before, after] = self.seeds[replicate];
        mix1(mix1((x | y << 16) ^ before) ^ after)
    }

    /// Samples `first .. first + WIDTH` of one pixel; `first` is a multiple of WIDTH.
    #[inline(always)]
    pub fn of_pixel(&self, x: u32, y: u32, replicate: usize, first: u32) -> Draws<'_, L> {
        debug_assert!((first as usize).is_multiple_of(L::WIDTH));
        let key = L::Bits::splat(self.key(x, y, replicate));
        Draws { sampler: self, key, first, step: 1 }
    }

    /// Sample `index` of the pixels `(x, y) = at(lane)`.
    #[inline(always)]
    pub fn of_pixels(
        &self,
        at: impl Fn(usize) -> (u32, u32),
        replicate: usize,
        index: u32,
    ) -> Draws<'_, L> {
        let key = L::Bits::from_fn(|lane| {
            let (x, y) = at(lane);
            self.key(x, y, replicate)
        });
        Draws { sampler: self, key, first: index, step: 0 }
    }
}

/// The random numbers of one packet.
pub struct Draws<'a, L: Lanes> {
    sampler: &'a Sampler<L>,
    /// Key of the pixel in each lane.
    key: L::Bits,
    /// Index of lane 0.
    first: u32,
    /// 1: lane i has index first + i; 0: all lanes have index first.
    step: u32,
}

impl<L: Lanes> Draws<'_, L> {
    /// Where in its pixel a sample lies, each coordinate in [0, 1).
    #[inline(always)]
    pub fn pixel(&self) -> (L, L) {
        (self.joint(0), self.joint(1))
    }

    /// Two numbers in [0, 1) for the lobe of the surface met after `bounce` reflections.
    #[inline(always)]
    pub fn lobe(&self, bounce: u32) -> (L, L) {
        let d = self.sampler.first_lobe + 2 * bounce as usize;
        if bounce < 2 { (self.joint(d), self.joint(d + 1)) } else { self.padded(bounce - 2) }
    }

    /// The index in each lane.
    #[inline(always)]
    fn indices(&self) -> L::Bits {
        let ramp = self.sampler.ramp * L::Bits::splat(self.step);
        L::Bits::splat(self.first) + ramp
    }

    /// Dimension `d` of the joint set.
    #[inline(always)]
    fn joint(&self, d: usize) -> L {
        let seed = mix(self.key ^ L::Bits::splat(mix1(d as u32 + 1)));
        match self.sampler.settings.kind {
            SamplerKind::Random => L::unit(mix(mix(self.indices() ^ seed) + self.key)),
            SamplerKind::Sobol => {
                let low = self.sampler.low[d] * L::Bits::splat(self.step);
                let x = L::Bits::splat(sobol::point(d, self.first)) ^ low;
                L::unit(owen(x, seed).reverse())
            }
        }
    }

    /// Two numbers for lobe `pair` of the padded sets: four lobes share a set of eight dimensions,
    /// whose indices are shuffled by a key of the set's own.
    #[cold]
    fn padded(&self, pair: u32) -> (L, L) {
        let set = pair / 4 + 1;
        let d = 2 * (pair % 4) as usize;
        let key = mix(self.key + L::Bits::splat(mix1(set ^ 0x5bd1_e995)));
        let shuffled = owen(self.indices().reverse(), key).reverse();
        let mut at = [0; MAX_WIDTH];
        for (lane, at) in at.iter_mut().enumerate().take(L::WIDTH) {
            *at = shuffled.lane(lane);
        }
        let number = |d: usize| {
            let seed = mix(key ^ L::Bits::splat(mix1(d as u32 + 1)));
            match self.sampler.settings.kind {
                SamplerKind::Random => L::unit(mix(mix(self.indices() ^ seed) + key)),
                SamplerKind::Sobol => {
                    let x = L::Bits::from_fn(|lane| sobol::point(d, at[lane]));
                    L::unit(owen(x, seed).reverse())
                }
            }
        };
        (number(d), number(d + 1))
    }
}
