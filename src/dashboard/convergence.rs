//! History of the picture's estimated error, for the convergence plot.

use zerkalo_render::session::Report;

/// Point of the convergence plot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Seconds of tracing.
    pub seconds: f64,
    /// Estimated RMSE of the displayed picture in 8-bit levels, greater than 0.
    pub noise_levels: f64,
}

/// History of the noise of one picture, at most 400 points.
#[derive(Clone, Debug, Default)]
pub struct Convergence {
    /// Points in order of increasing time.
    pub points: Vec<Point>,
    generation: u64,
    samples: u64,
}

/// Largest number of stored points, more than a plot has columns.
const MOST: usize = 400;

impl Convergence {
    /// Returns the seconds of tracing after which the noise last fell to `levels` 8-bit levels,
    /// interpolated between two reports by a power law. Returns `None` if the latest noise is above
    /// `levels`, or if no stored noise is above it.
    pub fn seconds_at(&self, levels: f64) -> Option<f64> {
        // Only the last fall to `levels` counts, because switching on a light raises the noise
        // again.
        let after = self.points.iter().rposition(|p| p.noise_levels > levels)? + 1;
        let (before, after) = (self.points[after - 1], self.points.get(after)?);
        let part =
            (before.noise_levels / levels).ln() / (before.noise_levels / after.noise_levels).ln();
        Some(before.seconds * (after.seconds / before.seconds).powf(part))
    }

    /// Adds the noise in a report. The report of a new or restarted picture clears the history
    /// first.
    pub fn add(&mut self, report: &Report) {
        if report.generation != self.generation || report.samples < self.samples {
            self.points.clear();
        }
        self.generation = report.generation;
        self.samples = report.samples;
        let Some(noise_levels) = report.noise.map(|n| n.rmse.levels).filter(|n| *n > 0.0) else {
            return;
        };
        let point = Point { seconds: report.seconds, noise_levels };
        match self.points.last_mut() {
            // The estimate has not been updated since the last report.
            Some(last) if last.noise_levels == point.noise_levels => {}
            // Without new samples, the noise changes if a light is dimmed or the render finishes.
            Some(last) if last.seconds >= point.seconds => *last = point,
            _ => self.points.push(point),
        }
        if self.points.len() > MOST {
            self.thin();
        }
    }

    /// Removes every second point after the earliest 100, because late points lie closest together
    /// on the logarithmic time axis. The newest point stays.
    fn thin(&mut self) {
        let (early, newest) = (MOST / 4, self.points.len() - 1);
        let mut index = 0;
        self.points.retain(|_| {
            index += 1;
            index <= early || index % 2 == 0 || index == newest + 1
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dashboard::testing::report;

    #[test]
    fn history_is_thinned_in_order_with_both_ends() {
        let mut convergence = Convergence::default();
        for i in 1..100_000u64 {
            convergence.add(&report(1, i, Some(100.0 / (i as f64).sqrt())));
        }
        let points = &convergence.points;
        assert!((MOST / 2..=MOST).contains(&points.len()), "{}", points.len());
        assert!(points.is_sorted_by(|a, b| a.seconds < b.seconds));
        assert_eq!(points[0].noise_levels, 100.0);
        assert_eq!(points.last().unwrap().seconds, report(1, 99_999, None).seconds);
    }

    #[test]
    fn new_scene_and_restart_clear_history() {
        let mut convergence = Convergence::default();
        convergence.add(&report(1, 10, Some(3.0)));
        convergence.add(&report(1, 20, Some(2.0)));
        convergence.add(&report(1, 20, Some(2.5)));
        assert_eq!(convergence.points.len(), 2, "the same moment seen twice");
        assert_eq!(convergence.points[1].noise_levels, 2.5);
        convergence.add(&report(1, 5, Some(4.0)));
        assert_eq!(convergence.points.len(), 1, "restarted");
        convergence.add(&report(2, 50, None));
        assert!(convergence.points.is_empty(), "another scene");
    }
}
