//! Invalid samples of a film: samples that are NaN or negative.

/// Largest number of invalid samples whose positions are stored.
pub const INVALID_REMEMBERED: usize = 16;

/// Position of an invalid sample: the values that are needed to trace it again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct InvalidSample {
    /// Index of the sample in its pixel and replicate.
    pub index: u32,
    /// Replicate; 0: A, 1: B.
    pub replicate: u8,
    /// Row of the pixel, counted from the top.
    pub y: u32,
    /// Column of the pixel, counted from the left.
    pub x: u32,
}

/// Number of invalid samples, and the positions of up to [`INVALID_REMEMBERED`] of them,
/// independent of the order in which threads find them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InvalidSamples {
    /// Number of samples that were NaN or negative.
    pub count: u64,
    /// First positions in the order of index, replicate, y and x.
    pub first: Vec<InvalidSample>,
}

impl InvalidSamples {
    pub fn record(&mut self, sample: InvalidSample) {
        self.count += 1;
        self.remember(sample);
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.count += other.count;
        other.first.iter().for_each(|sample| self.remember(*sample));
    }

    fn remember(&mut self, sample: InvalidSample) {
        let index = self.first.partition_point(|known| *known <= sample);
        if index < INVALID_REMEMBERED {
            self.first.truncate(INVALID_REMEMBERED - 1);
            self.first.insert(index, sample);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remembered_samples_do_not_depend_on_the_order() {
        let all: Vec<_> = (0..40)
            .map(|i| InvalidSample { index: i * 7 % 40, replicate: (i % 2) as u8, y: i, x: 3 })
            .collect();
        let gather = |samples: &mut dyn Iterator<Item = &InvalidSample>| {
            let mut bad = InvalidSamples::default();
            samples.for_each(|s| bad.record(*s));
            bad
        };
        let forward = gather(&mut all.iter());
        let mut halves = gather(&mut all[20..].iter().rev());
        halves.merge(&gather(&mut all[..20].iter()));
        assert_eq!(forward, halves);
        assert_eq!(forward.count, 40);
        let indices: Vec<_> = forward.first.iter().map(|s| s.index).collect();
        assert_eq!(indices, (0..16).collect::<Vec<_>>());
    }
}
