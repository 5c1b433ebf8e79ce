//! List of noise targets (noise at which rendering can stop), each with the time to reach it.

use crate::dashboard::Convergence;
use crate::dashboard::text::{duration, durations};
use zerkalo_render::session::{QUALITIES, Report};

/// Appearance of the picture at each target in [`QUALITIES`].
pub const APPEARANCES: [&str; QUALITIES.len()] = [
    "a draft: grain is visible",
    "grain in dark and even parts",
    "grain is visible by comparison",
    "clean: half a step of 8 bits",
    "finer than 8 bits can show",
    "for 16-bit files and measurements",
];

/// Note below the list.
pub const ABOUT: &str = "Halving the noise takes two to four times as long. Enter: stop there.";

/// Describes the time to reach the noise target `QUALITIES[at]`, such as `3–5 s more` or `reached
/// after 2 s`. For a target that the first report had reached, the text is `reached`.
pub fn cost(report: Option<&Report>, convergence: &Convergence, at: usize) -> String {
    let Some(report) = report else { return "not known yet".to_string() };
    if report.noise.is_some_and(|noise| noise.rmse.levels <= QUALITIES[at]) {
        let seconds = convergence.seconds_at(QUALITIES[at]);
        return seconds.map_or("reached".to_string(), |s| format!("reached after {}", duration(s)));
    }
    match report.quality_seconds[at] {
        Some(left) => format!("{} more", durations(left)),
        None => "not known yet".to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dashboard::testing::report;
    use zerkalo_render::schedule::Interval;

    #[test]
    fn reached_targets_show_time_and_others_the_rest() {
        let mut convergence = Convergence::default();
        for spp in [10, 20, 40] {
            convergence.add(&report(1, spp, Some(20.0 / spp as f64)));
        }
        let mut now = report(1, 80, Some(0.4));
        convergence.add(&now);
        now.quality_seconds[4] = Some(Interval { low: 0.2, high: 0.3 });
        // The simulated reports arrive after 10, 20, 40 and 80 ms. Their noise is 2, 1, 0.5 and 0.4
        // levels.
        let costs = [0, 1, 2, 3, 4, 5].map(|at| cost(Some(&now), &convergence, at));
        let [first, second, rest @ ..] = costs;
        assert_eq!([first, second], ["reached"; 2], "by the first look");
        let expected =
            ["reached after 0 s", "reached after 0 s", "0.2–0.3 s more", "not known yet"];
        assert_eq!(rest, expected);
        for (levels, seconds) in [(1.0, 0.02), (0.5, 0.04)] {
            let time = convergence.seconds_at(levels).unwrap();
            assert!((time - seconds).abs() < 1e-9, "{levels}: {time}");
        }
        // The requested noise is the geometric mean of 2 and 1 levels. `seconds_at` interpolates by
        // a power law, so it returns the geometric mean of the times 10 and 20 ms.
        let between = convergence.seconds_at(2f64.sqrt()).unwrap();
        assert!((between - 0.01 * 2f64.sqrt()).abs() < 1e-9, "{between}");
    }
}
