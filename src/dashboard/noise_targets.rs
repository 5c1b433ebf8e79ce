//! List of noise targets, noise values at which rendering can stop, with the time to reach each of
//! them.

use crate::dashboard::Convergence;
use zerkalo_render::session::{QUALITIES, Report};

/// Appearance of the picture at each target in [`QUALITIES`].
pub const LOOKS: [&str; QUALITIES.len()] = [
    "a draft: grain is visible",
    "grain in dark and even parts",
    "grain is visible by comparison",
    "clean: half a step of 8 bits",
    "finer than 8 bits can show",
    "for 16-bit files and measurements",
];

/// Note below the list.
pub const ABOUT: &str = "Halving the noise takes two to four times as long. Enter: stop there.";

/// Render time that is needed to reach a noise target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cost {
    /// The target was reached after this number of seconds; `None` if the noise in the first report
    /// was not above it.
    Reached(Option<f64>),
    /// Lower and upper estimate of the remaining render time in seconds.
    Left(f64, f64),
    /// There is no noise estimate yet.
    Unknown,
}

/// Returns the render time to reach the noise target `QUALITIES[at]`.
pub fn cost(report: &Report, convergence: &Convergence, at: usize) -> Cost {
    let reached = report.noise.is_some_and(|noise| noise.rmse_levels <= QUALITIES[at]);
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
    fn reached_targets_show_time_and_others_the_rest() {
        let mut convergence = Convergence::default();
        for spp in [10, 20, 40] {
            convergence.add(&report(1, spp, Some(20.0 / spp as f64)));
        }
        let mut now = report(1, 80, Some(0.4));
        convergence.add(&now);
        now.quality_seconds[4] = Some((0.2, 0.3));
        // The simulated reports arrive after 10, 20, 40 and 80 ms. Their noise is 2, 1, 0.5 and 0.4
        // levels.
        for at in [0, 1] {
            assert_eq!(cost(&now, &convergence, at), Cost::Reached(None), "by the first look");
        }
        for (at, seconds) in [(2, 0.02), (3, 0.04)] {
            let Cost::Reached(Some(time)) = cost(&now, &convergence, at) else { panic!("{at}") };
            assert!((time - seconds).abs() < 1e-9, "{at}: {time}");
        }
        assert_eq!(cost(&now, &convergence, 4), Cost::Left(0.2, 0.3));
        assert_eq!(cost(&now, &convergence, 5), Cost::Unknown);
        // The requested noise is the geometric mean of 2 and 1 levels. `seconds_at` interpolates by
        // a power law, so it returns the geometric mean of the times 10 and 20 ms.
        let between = convergence.seconds_at(2f64.sqrt()).unwrap();
        assert!((between - 0.01 * 2f64.sqrt()).abs() < 1e-9, "{between}");
    }
}
