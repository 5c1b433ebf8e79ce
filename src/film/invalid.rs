//! Invalid samples: samples that are NaN or negative.

/// Largest number of invalid samples whose positions are stored. Further ones are only counted.
pub const INVALID_REMEMBERED: usize = 16;

/// Position of a sample: the values that are needed to trace it again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct InvalidSample {
    /// Index in the sample sequence of the replicate.
    pub index: u32,
    /// Replicate; 0: A, 1: B.
    pub replicate: u8,
    /// Row, from the top, in pixels.
    pub y: u32,
    /// Column, from the left, in pixels.
    pub x: u32,
}

/// Number of invalid samples, and the positions of the first ones in sorted order. Both are
/// independent of the order in which threads find the samples.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InvalidSamples {
    /// Number of invalid samples.
    pub count: u64,
    /// Positions of the first [`INVALID_REMEMBERED`] invalid samples, in ascending order.
    pub first: Vec<InvalidSample>,
}

impl InvalidSamples {
    pub(super) fn record(&mut self, sample: InvalidSample) {
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
