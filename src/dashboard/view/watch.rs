//! Drawing of the table of watched files, and of their summary in the status line.

use crate::dashboard::layout::{Focus, Layout};
use crate::dashboard::model::{Model, WatchTable, short_name};
use crate::dashboard::overlay_layout::wrapped;
use crate::dashboard::view::frame::{panel, scroll_mark};
use crate::dashboard::view::is_active;
use crate::dashboard::view::text::{Row, cut};
use crate::dashboard::view::theme::Theme;
use crate::render::session::{WatchReport, WatchedShards, WatchedState};
use crate::terminal::Area;
use crate::value::sanitized;
use ratatui::buffer::Buffer;
use ratatui::style::Style;
use std::time::Duration;

/// Width of the column of ages, in columns of the terminal.
const AGE: usize = 7;
/// Width of the column of percentages, in columns of the terminal.
const SHARE: usize = 5;
/// Width of the column of sample counts, in columns of the terminal.
const SAMPLES: usize = 12;

/// Draws the table of watched files. Draws nothing if the panel is folded.
pub fn draw(
    model: &Model,
    table: &WatchTable,
    layout: &Layout,
    theme: &Theme,
    buffer: &mut Buffer,
) {
    let (Some(area), Some((rows, details))) = (layout.outline, model.watch_rows()) else { return };
    let active = is_active(model, Focus::Outline);
    panel(area, &title(&table.report), active, theme, buffer);
    let head = Area { y: rows.y - 1, height: 1, ..rows };
    let name = if table.report.complete.is_some() { " shard" } else { " file" };
    let mut to = Row::new(buffer, head, 0);
    right(&mut to, [("written", AGE), ("", SHARE), ("samples", SAMPLES)], theme.heading());
    to.put(name, theme.heading());
    let shards = &table.report.shards;
    let (height, first) = (usize::from(rows.height), table.scroll);
    for (row, (i, shard)) in (0..).zip(shards.iter().enumerate().skip(first).take(height)) {
        let mut to = Row::new(buffer, rows, row);
        let (mark, style) = mark(&shard.state, theme);
        let (plain, dim, style) = match i == table.cursor {
            true => {
                to.fill(theme.selected(active));
                (theme.selected(active), theme.selected(active), theme.selected(active))
            }
            false => (theme.text(), theme.dim(), style),
        };
        to.put(mark, style);
        let age = shard.age.map_or(String::new(), age);
        let late = if shard.state == WatchedState::Late { style } else { dim };
        to.put_right(&age_column(&age), 0, late);
        match &shard.state {
            WatchedState::Missing | WatchedState::Refused(_) => {
                to.put_right(word(&shard.state), 1, style);
            }
            _ => {
                to.put_right(&format!("{:>SHARE$}", share(shard)), 0, plain);
                to.put_right(&format!("{:>SAMPLES$}", samples(shard)), 0, dim);
            }
        }
        let label = label(shard);
        to.put(&cut(&label, to.left()), plain);
    }
    scroll_mark(rows, (first, height, shards.len()), theme.border(active), buffer);
    if let Some(selected) = shards.get(table.cursor) {
        explain(selected, details, theme, buffer);
    }
}

/// Draws `texts` at the right end of a row, each right-aligned in the given width.
fn right<const N: usize>(to: &mut Row, texts: [(&str, usize); N], style: Style) {
    for (text, width) in texts {
        to.put_right(&format!("{text:>width$}"), 0, style);
    }
}

fn age_column(age: &str) -> String {
    format!("{age:>AGE$}")
}

/// Draws the path and the state of a watched file, or of missing shards, below the table.
fn explain(shard: &WatchedShards, area: Area, theme: &Theme, buffer: &mut Buffer) {
    if area.height == 0 {
        return;
    }
    Row::new(buffer, area, 0).put(&"─".repeat(area.width.into()), theme.border(false));
    let (_, style) = mark(&shard.state, theme);
    let width = area.width.saturating_sub(2);
    let path = shard.path.as_ref().map(|path| sanitized(&path.display().to_string()));
    let text = match &shard.state {
        WatchedState::Refused(reason) => sanitized(reason),
        state => format!("{}{}", path.map_or(String::new(), |p| format!("{p}: ")), sentence(state)),
    };
    for (row, line) in (1..area.height).zip(wrapped(&text, width)) {
        let style = if row == 1 { style } else { theme.text() };
        Row::new(buffer, area, row).skip(1).put(&line, style);
    }
}

fn title(report: &WatchReport) -> String {
    match report.complete {
        Some([complete, all]) => format!("{complete} of {all} shards complete"),
        None => "checkpoint".to_string(),
    }
}

/// Returns the name of a row: the numbers of its shards, or the name of its file.
fn label(shard: &WatchedShards) -> String {
    match (&shard.path, shard.shards.as_str()) {
        (Some(path), "") => short_name(path),
        (_, "0") => "base".to_string(),
        (_, shards) => shards.to_string(),
    }
}

fn mark(state: &WatchedState, theme: &Theme) -> (&'static str, Style) {
    match state {
        WatchedState::Complete => (" ✓ ", theme.good()),
        WatchedState::Running => (" ● ", theme.accent()),
        WatchedState::Late => (" ! ", theme.warn()),
        WatchedState::Missing | WatchedState::Refused(_) => (" ✗ ", theme.bad()),
    }
}

fn word(state: &WatchedState) -> &'static str {
    match state {
        WatchedState::Complete => "complete",
        WatchedState::Running => "running",
        WatchedState::Late => "late",
        WatchedState::Missing => "missing",
        WatchedState::Refused(_) => "not used",
    }
}

fn sentence(state: &WatchedState) -> &'static str {
    match state {
        WatchedState::Complete => "complete",
        WatchedState::Running => "unfinished, written in the last three minutes",
        WatchedState::Late => "unfinished, not written for three minutes",
        WatchedState::Missing => "there is no such file",
        WatchedState::Refused(_) => "not used",
    }
}

/// Formats the fraction of its samples that a row has, in percent, rounded down.
fn share(shard: &WatchedShards) -> String {
    match shard.total {
        Some(total) if total > 0 => {
            format!("{}%", 100 * u128::from(shard.samples) / u128::from(total))
        }
        Some(_) => "100%".to_string(),
        None => String::new(),
    }
}

/// Formats the number of samples in a row's file and the number that its shards need, such as
/// `1.2/4.8M`.
fn samples(shard: &WatchedShards) -> String {
    let most = shard.total.unwrap_or(shard.samples).max(1) as f64;
    let units = [(1e12, "T"), (1e9, "G"), (1e6, "M"), (1e3, "k")];
    let (unit, name) = units.into_iter().find(|(unit, _)| most >= *unit).unwrap_or((1.0, ""));
    let digits = |samples: u64| match samples as f64 / unit {
        value if unit == 1.0 || value >= 99.95 => format!("{value:.0}"),
        value => format!("{value:.1}"),
    };
    match shard.total {
        Some(total) => format!("{}/{}{name}", digits(shard.samples), digits(total)),
        None => format!("{}{name}", digits(shard.samples)),
    }
}

/// Formats an age in whole units, such as `40 s`, `12 min`, `3 h` or `2 d`.
fn age(age: Duration) -> String {
    let seconds = age.as_secs();
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min", seconds / 60),
        3600..86400 => format!("{} h", seconds / 3600),
        _ => format!("{} d", seconds / 86400),
    }
}

/// Returns the summary of the watched files for the status line: state, percentage of the samples,
/// and numbers of files that are late, missing or refused.
pub fn summary(report: &WatchReport, theme: &Theme) -> Vec<(String, Style)> {
    let mut texts = Vec::new();
    match report.complete {
        Some([complete, all]) if complete == all => {
            texts.push(("✓ complete".to_string(), theme.good()));
        }
        _ => {
            texts.push(("● watching".to_string(), theme.accent()));
            let percent = report.progress.map(|share| format!("{:.0} %", (100.0 * share).floor()));
            texts.extend(percent.map(|percent| (percent, theme.text())));
        }
    }
    let count = |wanted: &dyn Fn(&WatchedState) -> bool| {
        report.shards.iter().filter(|shard| wanted(&shard.state)).count()
    };
    let refused = count(&|state| matches!(state, WatchedState::Refused(_)));
    let missing = count(&|state| *state == WatchedState::Missing);
    let late = count(&|state| *state == WatchedState::Late);
    let counts = [(refused, "not used"), (missing, "missing"), (late, "late")];
    for (count, what) in counts.into_iter().filter(|(count, _)| *count > 0) {
        let style = if what == "late" { theme.warn() } else { theme.bad() };
        texts.push((format!("{count} {what}"), style));
    }
    texts
}
