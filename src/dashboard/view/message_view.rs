//! Messages in the picture's panel: errors of the scene file, and the reason why a scene cannot be
//! rendered.

use crate::dashboard::layout::Layout;
use crate::dashboard::model::Model;
use crate::dashboard::overlay_layout::wrapped;
use crate::dashboard::view::text::Row;
use crate::dashboard::view::theme::Theme;
use crate::render::session::State;
use crate::scene::Diagnostic;
use crate::terminal::Area;
use crate::value::sanitized;
use ratatui::buffer::Buffer;
use ratatui::style::{Modifier, Style};

type Lines = Vec<(String, Style)>;

/// Draws `lines` in the picture's panel, with a margin if there is room.
fn write(lines: &Lines, layout: &Layout, buffer: &mut Buffer) {
    let area = text_area(layout);
    for (row, (line, style)) in (0..area.height).zip(lines) {
        Row::new(buffer, area, row).put(line, *style);
    }
}

fn text_area(layout: &Layout) -> Area {
    let inner = layout.picture.inner();
    let (x, y) = if inner.width > 50 && inner.height > 12 { (3, 1) } else { (1, 0) };
    Area {
        x: inner.x + x,
        y: inner.y + y,
        width: inner.width.saturating_sub(2 * x),
        height: inner.height.saturating_sub(2 * y),
    }
}

/// Draws the errors of a file that has never been readable.
pub fn broken(model: &Model, layout: &Layout, theme: &Theme, buffer: &mut Buffer) {
    let Some(errors) = &model.file.broken else { return };
    let width = text_area(layout).width;
    let bold = theme.bad().add_modifier(Modifier::BOLD);
    let mut lines = vec![(format!("{} cannot be read", model.file.name), bold)];
    for message in errors.messages() {
        lines.push((String::new(), theme.text()));
        lines.extend(formatted(message, width, theme));
    }
    if errors.more() > 0 {
        lines.push((format!("… and {} more.", errors.more()), theme.text()));
    }
    lines.push((String::new(), theme.text()));
    let help = "Fix the file: it is reloaded as soon as it is written.";
    lines.extend(wrapped(help, width).into_iter().map(|line| (line, theme.text())));
    write(&lines, layout, buffer);
}

/// Formats a diagnostic as lines of at most `width` columns: location, problem, help.
fn formatted(message: &Diagnostic, width: u16, theme: &Theme) -> Lines {
    let mut lines = Vec::new();
    if let Some((line, column)) = message.line_column {
        lines.push((format!("line {line}, column {column}"), theme.accent()));
    }
    let subject = match message.subject.as_str() {
        "" => String::new(),
        subject => format!("{}: ", sanitized(subject)),
    };
    let found = format!("{subject}{}.", sanitized(&message.found));
    lines.extend(wrapped(&found, width).into_iter().map(|line| (line, theme.text())));
    if !message.help.is_empty() {
        let help = wrapped(&sanitized(&message.help), width);
        lines.extend(help.into_iter().map(|line| (line, theme.dim())));
    }
    lines
}

/// Draws the reason why the current scene cannot be rendered, over the last picture. Draws the
/// first error of a file that has become unreadable on the lower border.
pub fn failure(model: &Model, layout: &Layout, theme: &Theme, buffer: &mut Buffer) {
    let failed = model.snapshot.as_ref().and_then(|s| match &s.report.state {
        State::Failed(why) => Some(why),
        _ => None,
    });
    if let Some(why) = failed {
        let mut lines = vec![("This scene cannot be rendered".to_string(), theme.bad())];
        let width = text_area(layout).width;
        let why = wrapped(&sanitized(why), width);
        lines.extend(why.into_iter().map(|line| (line, theme.text())));
        write(&lines, layout, buffer);
    }
    if let Some(first) = model.file.broken.as_ref().and_then(|b| b.messages().first())
        && !model.fullscreen
    {
        let area = layout.picture;
        let edge = Area { x: area.x + 2, width: area.width.saturating_sub(4), ..area };
        let place =
            first.line_column.map_or(String::new(), |(line, column)| format!(":{line}:{column}"));
        let text = format!(" ✗ {}{place}  {} ", model.file.name, sanitized(&first.found));
        Row::new(buffer, edge, area.height.saturating_sub(1)).put(&text, theme.bad());
    }
}
