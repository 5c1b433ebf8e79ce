//! Status line and hint line, the last two rows of the screen.

use crate::dashboard::hints::hints;
use crate::dashboard::model::Tone;
use crate::dashboard::text::{columns, duration, durations, number};
use crate::dashboard::update::commands::Hint;
use crate::dashboard::view::painter::Painter;
use crate::dashboard::view::theme::Theme;
use crate::dashboard::view::watch;
use crate::dashboard::{Mode, Model};
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};
use zerkalo_render::ErrorParts;
use zerkalo_render::schedule::StoppedBy;
use zerkalo_render::session::{Report, Snapshot, State};
use zerkalo_world::Precision;

/// Part of the status line, shown or omitted as a whole.
struct Part {
    /// Rank for omission: parts with the largest number are omitted first.
    expendable: u8,
    text: Vec<(String, Style)>,
}

/// Draws the status line. Parts that do not fit are omitted.
pub fn draw(model: &Model, area: Rect, painter: &mut Painter) {
    let mut parts = parts(model, &painter.theme);
    let width = |parts: &[Part]| -> usize {
        parts.iter().flat_map(|p| &p.text).map(|(text, _)| columns(text)).sum::<usize>()
            + 2 * parts.len()
    };
    while width(&parts) > usize::from(area.width) && parts.len() > 1 {
        let most = parts.iter().map(|p| p.expendable).max().unwrap_or(0);
        let Some(last) = parts.iter().rposition(|p| p.expendable == most) else { break };
        parts.remove(last);
    }
    let mut row = painter.row(area, 0);
    row.skip(1);
    for part in &parts {
        for (text, style) in &part.text {
            row.put(text, *style);
        }
        row.skip(2);
    }
}

/// Returns the parts of the status line, from left to right.
fn parts(model: &Model, theme: &Theme) -> Vec<Part> {
    let part = |expendable, text| Part { expendable, text };
    let plain = |text: String| (text, theme.text());
    let dim = |text: &str| (text.to_string(), theme.dim());
    let mut parts = Vec::new();
    if let Some(export) = &model.export {
        let [width, height] = export.size;
        let left = export.left.map_or(String::new(), |left| format!("  {} left", durations(left)));
        let done = format!("{:.0} %{left}", 100.0 * export.progress);
        let done = if export.progress < 1.0 { &done } else { "…" };
        let text = format!("writing {width}×{height}  {done}");
        parts.push(part(0, vec![(text, theme.accent())]));
    }
    if model.fullscreen && model.free_view.is_some() {
        parts.push(part(1, vec![("view, not the camera".to_string(), theme.warn())]));
    }
    let watching = model.watch.is_some();
    if let Some(table) = &model.watch {
        let summary = watch::summary(&table.report, theme).into_iter().enumerate();
        parts.extend(summary.map(|(i, text)| part(u8::from(i > 0), vec![text])));
    }
    let Some(snapshot) = &model.snapshot else {
        let text = if model.file.unreadable { "nothing to trace" } else { "compiling" };
        parts.extend((!watching).then(|| part(0, vec![dim(text)])));
        return parts;
    };
    let report = &snapshot.report;
    if !watching {
        // A picture without objects is complete, but there is nothing to see. While an export
        // renders, its progress says what is not complete.
        if model.is_empty() {
            parts.insert(0, part(0, vec![dim("empty")]));
            return parts;
        }
        if model.export.is_none() || !matches!(report.state, State::Finished(_)) {
            parts.insert(0, part(0, vec![state(model, report, theme)]));
        }
        if matches!(report.state, State::Idle | State::Failed(_)) {
            return parts;
        }
    }
    parts.push(part(if watching { 3 } else { 1 }, spp(model, report, theme)));
    if matches!(report.state, State::Tracing) && !watching {
        let speed = report.recent_samples_per_second * 1e-6;
        parts.push(part(4, vec![plain(number(speed)), dim(" Ms/s")]));
    }
    if let Some(noise) = report.noise {
        parts.push(part(2, noise_part(model, report, noise.rmse.levels, theme)));
    }
    if report.mixed {
        parts.push(part(5, vec![dim("mixed")]));
    }
    if let Some(error) = report.error.as_ref().filter(|_| !watching) {
        let (total, others) = error_texts(error);
        parts.push(part(4, vec![dim("error "), plain(total)]));
        parts.push(part(8, vec![dim(&others)]));
    }
    match model.stop.seconds {
        _ if watching => {}
        Some(limit) => {
            let text = format!("{} of {}", duration(report.seconds), duration(limit));
            parts.push(part(3, vec![plain(text)]));
        }
        None => parts.push(part(6, vec![dim(&duration(report.seconds))])),
    }
    for warning in report.warnings() {
        parts.push(part(3, vec![(warning, theme.warn())]));
    }
    if let Some(bytes_per_second) = model.connection_rate {
        parts.push(part(6, vec![plain(rate(bytes_per_second))]));
    }
    if !watching {
        let plural = if report.threads == 1 { "" } else { "s" };
        parts.push(part(7, vec![dim(report.precision.map_or("", Precision::name))]));
        parts.push(part(5, vec![dim(&format!("{} thread{plural}", report.threads))]));
    }
    parts
}

/// Formats a rate, such as `118 KB/s`. More digits would change too often to read.
fn rate(bytes_per_second: f64) -> String {
    let kilobytes = bytes_per_second / 1e3;
    match kilobytes {
        ..10.0 => format!("{kilobytes:.1} KB/s"),
        ..1000.0 => format!("{kilobytes:.0} KB/s"),
        _ => format!("{:.1} MB/s", kilobytes / 1e3),
    }
}

fn state(model: &Model, report: &Report, theme: &Theme) -> (String, Style) {
    let (text, style) = match &report.state {
        State::Idle => ("compiling", theme.dim()),
        State::Failed(_) => ("✗ cannot be rendered", theme.bad()),
        State::Paused => ("‖ paused", theme.warn()),
        State::Tracing if model.paused => ("‖ paused", theme.warn()),
        State::Tracing => ("● tracing", theme.accent()),
        State::Finished(StoppedBy::Noise | StoppedBy::Rmse | StoppedBy::Error) => {
            ("✓ converged", theme.good())
        }
        State::Finished(StoppedBy::Spp) => ("✓ samples reached", theme.good()),
        State::Finished(StoppedBy::Time) => ("✓ time over", theme.good()),
        State::Finished(StoppedBy::RaysPerPixel) if model.region.is_some() => {
            ("✓ region converged", theme.good())
        }
        State::Finished(StoppedBy::RaysPerPixel) => ("✓ rays per pixel reached", theme.good()),
        State::Finished(StoppedBy::Full) => ("✓ no more samples fit", theme.good()),
    };
    (text.to_string(), style)
}

fn spp(model: &Model, report: &Report, theme: &Theme) -> Vec<(String, Style)> {
    let spp = report.spp;
    let mut text = vec![(format!("{:.0}", spp.mean), theme.text())];
    if let Some(target) = model.stop.spp {
        text.push((format!(" of {target}"), theme.text()));
    }
    text.push((" spp".to_string(), theme.dim()));
    if spp.min != spp.max {
        text.push((format!(" ({}–{})", spp.min, spp.max), theme.dim()));
    }
    text
}

/// Formats noise, noise target and remaining time, such as `noise 0.84 → 0.5 levels in 3–5 s`.
fn noise_part(model: &Model, report: &Report, levels: f64, theme: &Theme) -> Vec<(String, Style)> {
    let dim = |text: &str| (text.to_string(), theme.dim());
    let mut text = vec![dim("noise "), (number(levels), theme.text())];
    if let Some(target) = model.stop.noise_levels.filter(|target| *target < levels) {
        text.push((format!(" → {target}"), theme.good()));
    }
    text.push(dim(" levels"));
    if let (Some(left), State::Tracing) = (report.eta_seconds, &report.state) {
        let left = if left.high < 1.0 { "under 1 s".to_string() } else { durations(left) };
        text.push((format!(" in {left}"), theme.text()));
    }
    text
}

/// Formats the whole error, and its parts except the noise.
fn error_texts(error: &ErrorParts) -> (String, String) {
    let total = error.total();
    let total = match total.is_finite() {
        true => format!("{}{}", error.sign(), number(total)),
        false => "without bound".to_string(),
    };
    (total, error.others())
}

/// Draws the notice if there is one, otherwise the key hints.
pub fn hints_line(model: &Model, area: Rect, painter: &mut Painter) {
    let theme = painter.theme;
    let mut row = painter.row(area, 0);
    row.skip(1);
    let widest = row.left();
    let room = match &model.notice {
        None => widest,
        // A notice never covers the hints of a mode.
        Some(notice) if model.is_busy() || model.mode != Mode::Orbit => {
            widest.saturating_sub(columns(&notice.text) + 5).max(widest / 2)
        }
        Some(_) => 0,
    };
    for hint in fitting(hints(model), room) {
        row.put(hint.keys, theme.accent().add_modifier(Modifier::BOLD)).put(" ", theme.dim());
        row.put(hint.text, theme.dim()).skip(3);
    }
    if let Some(notice) = &model.notice {
        let (mark, style) = match notice.tone {
            Tone::Good => ("✓ ", theme.good()),
            Tone::Plain => ("· ", theme.accent()),
            Tone::Bad => ("✗ ", theme.bad()),
        };
        row.put(mark, style).put(&notice.text, theme.text());
    } else if let Some(Snapshot { report: Report { state: State::Finished(_), .. }, .. }) =
        model.snapshot.as_deref()
        && model.overlay.is_none()
    {
        row.put_right(&model.graphics.description(), 2, theme.dim());
    }
}

/// Removes hints until the others fit into `width` columns. The first one and the last two, which
/// lead to all commands, stay longest.
fn fitting(mut hints: Vec<&Hint>, width: usize) -> Vec<&Hint> {
    let width_of = |hints: &[&Hint]| -> usize {
        let columns_of = |hint: &&Hint| columns(hint.keys) + 1 + columns(hint.text) + 3;
        hints.iter().map(columns_of).sum::<usize>().saturating_sub(3)
    };
    while width_of(&hints) > width && !hints.is_empty() {
        hints.remove(if hints.len() > 3 { hints.len() - 3 } else { hints.len() - 1 });
    }
    hints
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_have_few_digits() {
        let rates = [2000.0, 9940.0, 29_600.0, 118_400.0, 2.34e6].map(rate);
        assert_eq!(rates, ["2.0 KB/s", "9.9 KB/s", "30 KB/s", "118 KB/s", "2.3 MB/s"]);
    }

    #[test]
    fn hints_to_all_commands_are_dropped_last() {
        let all = [("a", "first"), ("b", "second"), (":", "all"), ("?", "keys")]
            .map(|(keys, text)| Hint { lines: &[], position: 0, keys, text });
        let keys_fitting = |width| -> Vec<_> {
            fitting(all.iter().collect(), width).iter().map(|hint| hint.keys).collect()
        };
        assert_eq!(keys_fitting(80).len(), 4);
        assert_eq!(keys_fitting(25), ["a", ":", "?"]);
        assert!(keys_fitting(3).is_empty());
    }
}
