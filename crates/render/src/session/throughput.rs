//! Throughput of tracing over the latest second.

use std::collections::VecDeque;

/// Time window of the measurement, in seconds of tracing.
const WINDOW_SECONDS: f64 = 1.0;

#[derive(Debug, Default)]
pub(super) struct Throughput {
    /// Seconds of tracing and numbers of samples since the start of the render, oldest first.
    marks: VecDeque<(f64, u64)>,
}

impl Throughput {
    pub fn record(&mut self, seconds: f64, samples: u64) {
        self.marks.push_back((seconds, samples));
        while self.marks.get(1).is_some_and(|(time, _)| *time <= seconds - WINDOW_SECONDS) {
            self.marks.pop_front();
        }
    }

    /// Returns the samples per second in the time window, over all pixels. Returns `None` before
    /// there are two marks.
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
