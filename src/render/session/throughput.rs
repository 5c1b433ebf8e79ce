//! How fast the work has gone of late.

use std::collections::VecDeque;

/// The speed is that of the last so many seconds of tracing.
const WINDOW_SECONDS: f64 = 1.0;

/// Samples against seconds of tracing, over the last second.
#[derive(Debug, Default)]
pub(super) struct Throughput {
    /// Seconds and samples since the beginning, oldest first.
    marks: VecDeque<(f64, u64)>,
}

impl Throughput {
    /// Notes that `samples` samples have been traced in the first `seconds` seconds.
    pub fn note(&mut self, seconds: f64, samples: u64) {
        self.marks.push_back((seconds, samples));
        while self.marks.get(1).is_some_and(|(at, _)| *at <= seconds - WINDOW_SECONDS) {
            self.marks.pop_front();
        }
    }

    /// Samples per second; `None` before there are two marks.
    pub fn samples_per_second(&self) -> Option<f64> {
        let (&(from, first), &(to, last)) = (self.marks.front()?, self.marks.back()?);
        (to > from).then(|| (last - first) as f64 / (to - from))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_second_counts() {
        let mut pace = Throughput::default();
        assert_eq!(pace.samples_per_second(), None);
        pace.note(0.0, 0);
        assert_eq!(pace.samples_per_second(), None);
        pace.note(0.25, 100);
        assert_eq!(pace.samples_per_second(), Some(400.0));
        // Ten times as fast from here on.
        (1..=20).for_each(|i| pace.note(0.25 + 0.25 * f64::from(i), 100 + 1000 * i as u64));
        assert_eq!(pace.samples_per_second(), Some(4000.0));
        assert!(pace.marks.len() < 10);
    }
}
