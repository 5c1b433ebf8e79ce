//! What each quality costs on the scene at hand: how long it takes to a given noise.

use crate::dashboard::convergence::Convergence;
use crate::dashboard::model::Model;
use crate::render::session::{QUALITIES, Report};

/// What a noise, in codes, looks like.
const LOOKS: [&str; QUALITIES.len()] = [
    "a draft: grain is plain to see",
    "grain in dark and even parts",
    "grain is seen only by comparing",
    "clean: half a step of 8 bits",
    "finer than 8 bits can show",
    "for 16-bit files and measurements",
];

/// What to know about all of them.
pub const ABOUT: &str = "Halving the noise takes two to four times as long. Enter: stop there.";

/// What a quality costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cost {
    /// It is reached; after so many seconds of tracing, if that was seen.
    Reached(Option<f64>),
    /// So many seconds of tracing more, a lower and an upper guess.
    Left(f64, f64),
    /// No error is known yet.
    Unknown,
}

/// A quality to choose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Its noise, in codes.
    pub noise_codes: f64,
    /// What it looks like, in a few words.
    pub looks: &'static str,
    /// What it costs.
    pub cost: Cost,
    /// Whether the work stops there.
    pub is_target: bool,
}

impl Model {
    /// The qualities, the cheapest first.
    pub fn qualities(&self) -> [Quality; QUALITIES.len()] {
        let report = self.snapshot.as_ref().map(|snapshot| &snapshot.report);
        std::array::from_fn(|i| Quality {
            noise_codes: QUALITIES[i],
            looks: LOOKS[i],
            cost: report.map_or(Cost::Unknown, |report| cost(report, &self.convergence, i)),
            is_target: self.stop.noise_codes == Some(QUALITIES[i]),
        })
    }
}

fn cost(report: &Report, convergence: &Convergence, at: usize) -> Cost {
    let reached = report.noise.is_some_and(|noise| noise.rmse_codes <= QUALITIES[at]);
    match report.quality_seconds[at] {
        _ if reached => Cost::Reached(convergence.seconds_at(QUALITIES[at])),
        Some((from, to)) => Cost::Left(from, to),
        None => Cost::Unknown,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dashboard::testing::report;

    #[test]
    fn what_is_reached_is_told_with_its_time_and_the_rest_with_what_is_left() {
        let mut convergence = Convergence::default();
        for spp in [10, 20, 40] {
            convergence.add(&report(1, spp, Some(20.0 / spp as f64)));
        }
        let mut now = report(1, 80, Some(0.4));
        convergence.add(&now);
        now.quality_seconds[4] = Some((0.2, 0.3));
        // The reports are 10, 20, 40 and 80 ms into the work; 2, 1, 0.5 and 0.4 codes.
        for at in [0, 1] {
            assert_eq!(cost(&now, &convergence, at), Cost::Reached(None), "by the first look");
        }
        for (at, seconds) in [(2, 0.02), (3, 0.04)] {
            let Cost::Reached(Some(told)) = cost(&now, &convergence, at) else { panic!("{at}") };
            assert!((told - seconds).abs() < 1e-9, "{at}: {told}");
        }
        assert_eq!(cost(&now, &convergence, 4), Cost::Left(0.2, 0.3));
        assert_eq!(cost(&now, &convergence, 5), Cost::Unknown);
        // Half way between 1 and 2 codes, on logarithmic scales.
        let between = convergence.seconds_at(2f64.sqrt()).unwrap();
        assert!((between - 0.01 * 2f64.sqrt()).abs() < 1e-9, "{between}");
    }
}
