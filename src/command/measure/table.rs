//! A measurement for people.

use crate::measure::{Crossing, Measured, Measurement, Topic};
use std::fmt;
use std::path::Path;

/// A measurement with what it was made on.
pub struct About<'a> {
    pub scene: &'a Path,
    pub threads: usize,
    pub lanes: &'static str,
    pub measurement: &'a Measurement,
}

impl About<'_> {
    /// One line for a drawing.
    pub fn title(&self) -> String {
        let [width, height] = self.measurement.size;
        format!("{}, {width} x {height}, {} threads", self.scene.display(), self.threads)
    }

    /// What it ran on.
    pub fn machine(&self) -> String {
        let model = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
            let line = text.lines().find(|line| line.starts_with("model name"))?;
            Some(line.split_once(':')?.1.trim().to_string())
        });
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        format!("{}, {cores} cores", model.unwrap_or_else(|| std::env::consts::ARCH.to_string()))
    }
}

/// `1.2 s`, `35 ms`: three digits.
fn time(seconds: f64) -> String {
    match seconds {
        s if s < 0.9995 => format!("{:.*} ms", digits(1e3 * s), 1e3 * s),
        s if s < 120.0 => format!("{:.*} s", digits(s), s),
        s => format!("{:.1} min", s / 60.0),
    }
}

/// Digits after the point that make three in all.
fn digits(value: f64) -> usize {
    if value >= 99.95 {
        0
    } else if value >= 9.995 {
        1
    } else {
        2
    }
}

fn percent(share: f64) -> String {
    format!("±{:.0} %", 100.0 * share)
}

fn reached(crossing: &Crossing) -> String {
    let least = if crossing.at_most { "< " } else { "" };
    format!("{least}{} {}", time(crossing.seconds), percent(crossing.spread))
}

impl fmt::Display for About<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let m = self.measurement;
        let [width, height] = m.size;
        writeln!(
            f,
            "{}: {width} x {height} pixels, {}, {} threads on {}; zerkalo {}",
            self.scene.display(),
            self.lanes,
            self.threads,
            self.machine(),
            env!("CARGO_PKG_VERSION")
        )?;
        if m.reference_spp > 0.0 {
            writeln!(
                f,
                "Errors are against a reference of {:.0} samples per pixel, itself {:.3} codes off ({}).",
                m.reference_spp,
                m.reference_codes,
                time(m.reference_seconds)
            )?;
        }
        let Some(default) = m.measured.first() else { return Ok(()) };
        writeln!(f, "\nHow long to a given noise (RMSE as displayed, 8-bit codes)")?;
        writeln!(f, "  {:>7}  {:>18}  {:>18}", "codes", "time", "samples per pixel")?;
        for target in &m.targets {
            match default.crossing(*target) {
                Some(c) => writeln!(f, "  {target:>7}  {:>18}  {:>18.0}", reached(&c), c.spp)?,
                None => writeln!(f, "  {target:>7}  {:>18}", "not in this time")?,
            }
        }
        if let (Some(slope), Some((speed, spread))) =
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
        let mut last = Topic::Default;
        for measured in &m.measured[1..] {
            if measured.topic != last {
                last = measured.topic;
                self.heading(f, last)?;
                self.row(f, default)?;
            }
            self.row(f, measured)?;
        }
        Ok(())
    }
}

impl About<'_> {
    fn heading(&self, f: &mut fmt::Formatter, topic: Topic) -> fmt::Result {
        writeln!(f, "\n{} (to {:.2} codes)", topic.question(), self.measurement.compared_at)?;
        let last = if topic.unbiased() { "" } else { "        off by" };
        writeln!(
            f,
            "  {:<16}  {:>16}  {:>9}  {:>9}  {:>9}{last}",
            "", "time", "default/", "spp", "Msamp./s"
        )
    }

    fn row(&self, f: &mut fmt::Formatter, measured: &Measured) -> fmt::Result {
        let codes = self.measurement.compared_at;
        let at = |m: &Measured| {
            if m.bias.is_some() { m.told_crossing(codes) } else { m.crossing(codes) }
        };
        let (own, default) = (at(measured), self.measurement.measured[0].crossing(codes));
        let time = own.as_ref().map_or("not in this time".to_string(), reached);
        let ratio = match (&own, &default) {
            (Some(own), Some(default)) => format!("{:.2}x", default.seconds / own.seconds),
            _ => String::new(),
        };
        let spp = own.as_ref().map_or(String::new(), |c| format!("{:.0}", c.spp));
        let speed = measured.samples_per_second().map_or(0.0, |(speed, _)| speed * 1e-6);
        write!(f, "  {:<16}  {time:>16}  {ratio:>9}  {spp:>9}  {speed:>9.1}", measured.name)?;
        match measured.bias {
            Some(bias) => writeln!(f, "  {:>7.3} codes (mean: z = {:.1})", bias.codes, bias.z),
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
