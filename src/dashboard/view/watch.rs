//! Drawing of the table of watched film files, and of their summary in the status line.

use crate::dashboard::text::{duration, wrapped};
use crate::dashboard::view::is_active;
use crate::dashboard::view::painter::{ListRow, Painter, Row, VisibleLine};
use crate::dashboard::view::theme::Theme;
use crate::dashboard::{Focus, Layout, Model, short_name};
use ratatui::layout::Rect;
use ratatui::style::Style;
use zerkalo_render::session::{WatchReport, WatchedShards, WatchedState};
use zerkalo_scene::value::sanitized;

/// Width of the column with the time since each file was written.
const AGE: usize = 7;
/// Width of the column with the progress in percent.
const SHARE: usize = 5;
/// Width of the column with the number of samples.
const SAMPLES: usize = 12;

pub fn draw(model: &Model, layout: &Layout, painter: &mut Painter) {
    let theme = painter.theme;
    let (Some(table), Some(area)) = (&model.watch, layout.outline) else { return };
    let Some((rows, details)) = model.watch_rows() else { return };
    let active = is_active(model, Focus::Outline);
    painter.panel(area, &title(&table.report), active);
    let head = Rect { y: rows.y - 1, height: 1, ..rows };
    let name = if table.report.complete.is_some() { " shard" } else { " file" };
    let mut to = painter.row(head, 0);
    right(&mut to, [("written", AGE), ("", SHARE), ("samples", SAMPLES)], theme.heading());
    to.put(name, theme.heading());
    let shards = &table.report.shards;
    let border = theme.border(active);
    for VisibleLine { row, index } in painter.window(rows, table.at.scroll, shards.len(), border) {
        let shard = &shards[index];
        let selected = (index == table.at.index).then_some(active);
        let ListRow { mut to, name: plain, note: dim, .. } = painter.list_row(rows, row, selected);
        let (mark, word, style) = state(shard, &theme);
        let style = if selected.is_some() { plain } else { style };
        to.put(mark, style);
        // Fractions of a second would change at each report.
        let age = shard.age.map_or(String::new(), |age| duration(age.as_secs() as f64));
        right(&mut to, [(&age, AGE)], if word == LATE { style } else { dim });
        if [MISSING, NOT_USED].contains(&word) {
            to.put_right(word, 1, style);
        } else {
            right(&mut to, [(&share(shard), SHARE)], plain);
            right(&mut to, [(&samples(shard), SAMPLES)], dim);
        }
        to.put(&label(shard), plain);
    }
    if let Some(selected) = shards.get(table.at.index) {
        explain(selected, details, painter);
    }
}

/// Draws texts from the right end of the row to the left, each right-aligned in its width.
fn right<const N: usize>(to: &mut Row, texts: [(&str, usize); N], style: Style) {
    for (text, width) in texts {
        to.put_right(&format!("{text:>width$}"), 0, style);
    }
}

/// Draws path and state of the file under the cursor, below the table.
fn explain(shard: &WatchedShards, area: Rect, painter: &mut Painter) {
    let theme = painter.theme;
    if area.height == 0 {
        return;
    }
    painter.row(area, 0).put(&"─".repeat(area.width.into()), theme.border(false));
    let (.., style) = state(shard, &theme);
    let width = area.width.saturating_sub(2);
    let path = shard.path.as_ref().map(|path| sanitized(&path.display().to_string()));
    let path = path.map_or(String::new(), |path| format!("{path}: "));
    let text = match &shard.state {
        WatchedState::Complete => path + "complete",
        WatchedState::Running => path + "unfinished, written in the last three minutes",
        WatchedState::Late => path + "unfinished, not written for three minutes",
        WatchedState::Missing => path + "there is no such file",
        WatchedState::Refused(reason) => sanitized(reason),
    };
    for (row, line) in (1..area.height).zip(wrapped(&text, width)) {
        let style = if row == 1 { style } else { theme.text() };
        painter.row(area, row).skip(1).put(&line, style);
    }
}

fn title(report: &WatchReport) -> String {
    match report.complete {
        Some([complete, all]) => format!("{complete} of {all} shards complete"),
        None => "checkpoint".to_string(),
    }
}

/// Returns the numbers of the shards in the file, or the name of a file without shards.
fn label(shard: &WatchedShards) -> String {
    match (&shard.path, shard.shards.as_str()) {
        (Some(path), "") => short_name(path),
        (_, "0") => "base".to_string(),
        (_, shards) => shards.to_string(),
    }
}

const LATE: &str = "late";
const MISSING: &str = "missing";
const NOT_USED: &str = "not used";

/// Returns mark, word and style for the state of a file.
fn state(shard: &WatchedShards, theme: &Theme) -> (&'static str, &'static str, Style) {
    match shard.state {
        WatchedState::Complete => (" ✓ ", "complete", theme.good()),
        WatchedState::Running => (" ● ", "running", theme.accent()),
        WatchedState::Late => (" ! ", LATE, theme.warn()),
        WatchedState::Missing => (" ✗ ", MISSING, theme.bad()),
        WatchedState::Refused(_) => (" ✗ ", NOT_USED, theme.bad()),
    }
}

/// Formats the progress in percent, rounded down.
fn share(shard: &WatchedShards) -> String {
    match shard.total {
        Some(total) if total > 0 => {
            format!("{}%", 100 * u128::from(shard.samples) / u128::from(total))
        }
        Some(_) => "100%".to_string(),
        None => String::new(),
    }
}

/// Formats the number of samples in a file, and the number in the complete file, such as
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

/// Returns parts of the status line: state and progress of the render, and the numbers of files
/// that are late, missing or refused.
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
    for (wanted, style) in [(NOT_USED, theme.bad()), (MISSING, theme.bad()), (LATE, theme.warn())] {
        let is_wanted = |shard: &&WatchedShards| state(shard, theme).1 == wanted;
        let count = report.shards.iter().filter(is_wanted).count();
        if count > 0 {
            texts.push((format!("{count} {wanted}"), style));
        }
    }
    texts
}
