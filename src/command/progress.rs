//! Progress of a render on stderr: a bar in a terminal, otherwise lines for a log.

use crate::command::{is_quiet, warn};
use crate::dashboard::text::durations;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use zerkalo_render::session::Report;

/// Seconds of rendering before the first output.
const QUIET_SECONDS: f64 = 0.25;
/// Seconds of rendering before the first line of a log. Each further interval is equal to the time
/// so far, up to [`LONGEST_INTERVAL_SECONDS`].
const FIRST_LINE_SECONDS: f64 = 1.0;
/// Longest interval between lines of a log.
const LONGEST_INTERVAL_SECONDS: f64 = 60.0;

/// Number of steps of the progress bar.
const STEPS: u64 = 1000;

/// Display of a render's progress.
pub enum Progress {
    /// Bar; `None` before the first output.
    Bar(Option<ProgressBar>),
    /// Lines of a log. The value is the rendering time at which the next one is due.
    Lines(f64),
}

impl Progress {
    pub fn on_stderr() -> Self {
        if is_quiet() {
            Self::Lines(f64::INFINITY)
        } else if std::io::stderr().is_terminal() {
            Self::Bar(None)
        } else {
            Self::Lines(FIRST_LINE_SECONDS)
        }
    }

    /// Shows the progress if the next output is due.
    pub fn show(&mut self, report: &Report) {
        if report.seconds < QUIET_SECONDS {
            return;
        }
        match self {
            Self::Bar(bar) => {
                let bar = bar.get_or_insert_with(new_bar);
                bar.set_position((report.progress.unwrap_or(0.0) * STEPS as f64) as u64);
                bar.set_message(status(report));
            }
            Self::Lines(due) if report.seconds >= *due => {
                let percent =
                    report.progress.map_or(String::new(), |p| format!("{:.0} %  ", 100.0 * p));
                // A closed stderr does not stop the render.
                let _ = writeln!(std::io::stderr(), "{percent}{}", status(report));
                *due = report.seconds
                    + report.seconds.clamp(FIRST_LINE_SECONDS, LONGEST_INTERVAL_SECONDS);
            }
            Self::Lines(_) => {}
        }
    }

    /// Prints a line beside the progress.
    pub fn note(&self, line: &str) {
        match self {
            Self::Bar(Some(bar)) => bar.println(line),
            Self::Bar(None) | Self::Lines(_) => warn(line),
        }
    }

    pub fn finish(self) {
        if let Self::Bar(Some(bar)) = self {
            bar.finish_and_clear();
        }
    }
}

fn new_bar() -> ProgressBar {
    // The message with the remaining time must fit into 80 columns.
    let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr());
    bar.with_style(style("{bar:10} {percent:>3} %  {wide_msg}"))
}

/// Returns the style of a progress bar. `template` must be well-formed.
pub fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).expect("the template is well-formed")
}

/// Formats the progress, such as `33 spp (32-210) 41.2 Msamples/s noise 0.81 3–5 s left`.
fn status(report: &Report) -> String {
    let mut text = counts(report);
    text += &format!("  {:.1} Msamples/s", report.samples_per_second() * 1e-6);
    if let Some(noise) = report.noise {
        text += &format!("  noise {:.2}", noise.rmse.levels);
    }
    if let Some(left) = report.eta_seconds {
        text += &format!("  {} left", durations(left));
    }
    text
}

/// Formats mean, smallest and largest number of samples per pixel, such as `212 spp (32-900)`.
pub fn counts(report: &Report) -> String {
    let spp = &report.spp;
    if spp.min == spp.max {
        format!("{} spp", spp.min)
    } else {
        format!("{:.0} spp ({}-{})", spp.mean, spp.min, spp.max)
    }
}

/// Formats the noise, such as `noise 0.500 8-bit levels`.
pub fn noise(report: &Report) -> String {
    match report.noise {
        Some(noise) => format!("noise {:.3} 8-bit levels", noise.rmse.levels),
        None => "noise unknown".to_string(),
    }
}
