//! Throughput of tracing: samples per second over the latest second.

use std::collections::VecDeque;

/// Length of the time window in which the throughput is measured, in seconds of tracing.
const WINDOW_SECONDS: f64 = 1.0;

/// Throughput of tracing in the latest second ([`WINDOW_SECONDS`]), computed from recorded sample
/// counts.
#[derive(Debug, Default)]
pub(super) struct Throughput {
    /// Recorded totals since the start of the render, oldest first, each as `(seconds of tracing,
    /// number of samples)`.
    marks: VecDeque<(f64, u64)>,
}

impl Throughput {
    /// Records the number of samples that the first `seconds` seconds of tracing have given.
    pub fn record(&mut self, seconds: f64, samples: u64) {
        self.marks.push_back((seconds, samples));
        while self.marks.get(1).is_some_and(|(time, _)| *time <= seconds - WINDOW_SECONDS) {
            self.marks.pop_front();
        }
    }

    /// Returns the throughput in the latest time window: samples per second of tracing, summed over
    /// all pixels. Returns `None` before there are two sample counts.
    pub fn samples_per_second(&self) -> Option<f64> {
        let (&(from, first), &(to, last)) = (self.marks.front()?, self.marks.back()?);
        (to > from).then(|| (last - first) as f64 / (to - from))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn throughput_is_that_of_the_last_second() {
        let mut throughput = Throughput::default();
        assert_eq!(throughput.samples_per_second(), None);
        throughput.record(0.0, 0);
        assert_eq!(throughput.samples_per_second(), None);
        throughput.record(0.25, 100);
        assert_eq!(throughput.samples_per_second(), Some(400.0));
        // From here on, tracing is ten times as fast.
        (1..=20).for_each(|i| throughput.record(0.25 + 0.25 * f64::from(i), 100 + 1000 * i as u64));
        assert_eq!(throughput.samples_per_second(), Some(4000.0));
        assert!(throughput.marks.len() < 10);
    }
}
