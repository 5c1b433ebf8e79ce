//! Results of `zerkalo measure` as a text table.

use crate::dashboard::text::number;
use crate::measure::{DEFAULT, Experiment, Measured, Measurement, Median, TimeToTarget, median};
use std::fmt;
use std::path::Path;

/// Measurement with its scene and settings, displayed as a text table.
pub struct MeasureReport<'a> {
    pub scene: &'a Path,
    pub measurement: &'a Measurement,
}

impl MeasureReport<'_> {
    pub fn title(&self) -> String {
        let [width, height] = self.measurement.size;
        let threads = self.measurement.default().variant.threads;
        format!("{}, {width} x {height}, {threads} threads", self.scene.display())
    }

    /// Returns the model of the processor and the number of cores.
    pub fn machine(&self) -> String {
        let model = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
            let line = text.lines().find(|line| line.starts_with("model name"))?;
            Some(line.split_once(':')?.1.trim().to_string())
        });
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        format!("{}, {cores} cores", model.unwrap_or_else(|| std::env::consts::ARCH.to_string()))
    }
}

/// Formats a duration, such as `35.1 ms`, `1.23 s` or `2.5 min`.
fn time(seconds: f64) -> String {
    match seconds {
        s if s < 0.9995 => format!("{} ms", number(1e3 * s)),
        s if s < 120.0 => format!("{} s", number(s)),
        s => format!("{:.1} min", s / 60.0),
    }
}

fn percent(share: f64) -> String {
    format!("±{:.0} %", 100.0 * share)
}

fn reached(target: &TimeToTarget) -> String {
    format!("{} {}", time(target.seconds), percent(target.spread))
}

impl fmt::Display for MeasureReport<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let m = self.measurement;
        self.conditions(f)?;
        self.times(f)?;
        let mut last = &DEFAULT;
        for measured in &m.measured[1..] {
            if measured.variant.experiment != last {
                last = measured.variant.experiment;
                self.heading(f, last)?;
                self.row(f, m.default())?;
            }
            self.row(f, measured)?;
        }
        for experiment in &m.idle {
            writeln!(f, "\n{}: nothing to compare in this scene", experiment.title)?;
        }
        if m.measured.iter().any(|m| m.bias.is_some()) {
            writeln!(
                f,
                "\nbias: RMSE that remains at any number of samples, in 8-bit levels; z: difference of the mean \
                 brightness\nfrom the reference's, in standard errors (significant beyond 4)"
            )?;
        }
        Ok(())
    }
}

impl MeasureReport<'_> {
    /// Writes machine, reference and repetitions of the measurement.
    fn conditions(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let m = self.measurement;
        let [width, height] = m.size;
        writeln!(
            f,
            "{}: {width} x {height} pixels, {}, {} threads on {}; zerkalo {}",
            self.scene.display(),
            m.lanes,
            m.default().variant.threads,
            self.machine(),
            env!("CARGO_PKG_VERSION")
        )?;
        if m.reference.spp > 0.0 {
            writeln!(
                f,
                "Errors are against a reference of {:.0} samples per pixel, whose own error is {:.3} 8-bit levels ({}); \
                 against another\none they would be the same within {:.1} %.",
                m.reference.spp,
                m.reference.noise_levels(),
                time(m.reference.seconds),
                (100.0 * m.reference_uncertainty()).max(0.1)
            )?;
        }
        writeln!(f, "Times are medians of {} runs or more, ± their spread.", m.repetitions())
    }

    /// Writes the times in which the default settings reached each noise target.
    fn times(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let m = self.measurement;
        let default = m.default();
        writeln!(f, "\nTime to a given noise (RMSE as displayed, 8-bit levels)")?;
        writeln!(f, "  {:>7}  {:>18}  {:>18}", "levels", "time", "samples per pixel")?;
        for target in &m.targets {
            let expected = m.expected.iter().find(|e| e.levels == *target);
            match (default.time_to(*target), expected) {
                (Some(c), _) => writeln!(f, "  {target:>7}  {:>18}  {:>18.0}", reached(&c), c.spp)?,
                (None, Some(e)) => writeln!(
                    f,
                    "  {target:>7}  {:>18}  {:>18}",
                    format!("~ {}–{}", time(e.seconds_low), time(e.seconds_high)),
                    "expected"
                )?,
                (None, None) => writeln!(f, "  {target:>7}  {:>18}", "not in this time")?,
            }
        }
        if let (Some(slope), Some(Median { value: speed, spread })) =
            (default.slope(), default.samples_per_second())
        {
            writeln!(
                f,
                "  error ~ samples^({:.2} ±{:.2}); {:.1} million samples per second {}",
                slope.value,
                slope.standard_error,
                speed * 1e-6,
                percent(spread)
            )?;
        }
        if let Some(parts) = default.points.last().and_then(|point| point.parts.as_ref()) {
            writeln!(f, "  at the end: {parts}")?;
        }
        if !m.expected.is_empty() {
            writeln!(f, "  ~ extrapolated from the convergence so far")?;
        }
        Ok(())
    }

    fn heading(&self, f: &mut fmt::Formatter, experiment: &Experiment) -> fmt::Result {
        writeln!(
            f,
            "\n{} (to {:.2} 8-bit levels)",
            experiment.title, self.measurement.compared_at
        )?;
        let last = if experiment.is_unbiased { "" } else { "   bias" };
        writeln!(
            f,
            "  {:<18}  {:>14}  {:>9}  {:>9}  {:>9}{last}",
            "", "time", "speed", "spp", "Msamp./s"
        )
    }

    /// Writes the line of one variant in the table of its experiment.
    fn row(&self, f: &mut fmt::Formatter, measured: &Measured) -> fmt::Result {
        let levels = self.measurement.compared_at;
        let name = &measured.variant.name;
        let default = self.measurement.default().time_to(levels);
        let reached_at = measured.true_time_to(levels);
        let followed = || measured.points.last().map_or(0.0, |p| median(&p.seconds));
        let (bound, seconds, time) = match &reached_at {
            Some(target) => ("", target.seconds, reached(target)),
            None => ("< ", followed(), format!("> {}", time(followed()))),
        };
        let speed = default.map(|default| format!("{bound}{:.2}x", default.seconds / seconds));
        let speed = speed.unwrap_or_default();
        let spp = reached_at.as_ref().map_or(String::new(), |c| format!("{:.0}", c.spp));
        let rate = measured.samples_per_second().map_or(0.0, |speed| speed.value * 1e-6);
        write!(f, "  {name:<18}  {time:>14}  {speed:>9}  {spp:>9}  {rate:>9.1}")?;
        match measured.bias {
            Some(b) if b.is_seen() => writeln!(f, "   {:.2} levels (z = {:.0})", b.levels, b.z),
            Some(b) => writeln!(f, "   not detectable (below {:.2} levels)", b.least_levels),
            None => writeln!(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_three_digits() {
        let shown = [0.001234, 0.0351, 0.9996, 1.234, 12.34, 119.0, 600.0].map(time);
        assert_eq!(
            shown,
            ["1.23 ms", "35.1 ms", "1.00 s", "1.23 s", "12.3 s", "119 s", "10.0 min"]
        );
    }
}
