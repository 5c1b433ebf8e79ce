//! Errors of the scene file, and the reason why a scene cannot be rendered, in the picture's panel.

use crate::dashboard::view::painter::Painter;
use crate::dashboard::view::theme::Theme;
use crate::dashboard::{BORDER, Layout, Model};
use ratatui::layout::{Margin, Rect};
use ratatui::style::{Modifier, Style};
use zerkalo_render::session::State;
use zerkalo_scene::Diagnostic;
use zerkalo_scene::value::sanitized;

fn text_area(layout: &Layout) -> Rect {
    let inner = layout.picture.inner(BORDER);
    let (x, y) = if inner.width > 50 && inner.height > 12 { (3, 1) } else { (1, 0) };
    inner.inner(Margin::new(x, y))
}

/// Draws the errors of a scene file that has never been readable.
pub fn broken(model: &Model, layout: &Layout, painter: &mut Painter) {
    let theme = painter.theme;
    let Some(errors) = &model.file.broken else { return };
    let bold = theme.bad().add_modifier(Modifier::BOLD);
    let mut texts = vec![(format!("{} cannot be read", model.file.name), bold)];
    for message in &errors.messages {
        texts.push((String::new(), theme.text()));
        texts.extend(formatted(message, &theme));
    }
    if errors.more > 0 {
        texts.push((format!("… and {} more.", errors.more), theme.text()));
    }
    let help = "Fix the file: it is reloaded as soon as it is written.";
    texts.extend(["", help].map(|text| (text.to_string(), theme.text())));
    painter.paragraphs(text_area(layout), &texts);
}

/// Formats location, problem and help of an error, one paragraph each.
fn formatted(message: &Diagnostic, theme: &Theme) -> Vec<(String, Style)> {
    let mut texts = Vec::new();
    if let Some((line, column)) = message.line_column {
        texts.push((format!("line {line}, column {column}"), theme.accent()));
    }
    let subject = match message.subject.as_str() {
        "" => String::new(),
        subject => format!("{}: ", sanitized(subject)),
    };
    texts.push((format!("{subject}{}.", sanitized(&message.found)), theme.text()));
    if !message.help.is_empty() {
        texts.push((sanitized(&message.help), theme.dim()));
    }
    texts
}

/// Draws what to do first in a scene without objects.
pub fn empty(model: &Model, layout: &Layout, painter: &mut Painter) {
    if model.is_empty() && model.overlay.is_none() {
        let hints = ["a  adds an object: gold ball, checker floor, mirror …", "A  adds a light"];
        let texts = hints.map(|hint| (hint.to_string(), painter.theme.text()));
        painter.paragraphs(text_area(layout), &texts);
    }
}

/// Draws the reason why the scene cannot be rendered, and on the border the first error of a scene
/// file that has become unreadable.
pub fn failure(model: &Model, layout: &Layout, painter: &mut Painter) {
    let theme = painter.theme;
    let failed = model.snapshot.as_ref().and_then(|s| match &s.report.state {
        State::Failed(why) => Some(why),
        _ => None,
    });
    if let Some(why) = failed {
        let title = "This scene cannot be rendered".to_string();
        let texts = [(title, theme.bad()), (sanitized(why), theme.text())];
        painter.paragraphs(text_area(layout), &texts);
    }
    if let Some(first) = model.file.broken.as_ref().and_then(|b| b.messages.first())
        && !model.fullscreen
    {
        let area = layout.picture;
        let place =
            first.line_column.map_or(String::new(), |(line, column)| format!(":{line}:{column}"));
        let text = format!(" ✗ {}{place}  {} ", model.file.name, sanitized(&first.found));
        painter.edge(area, area.height.saturating_sub(1)).put(&text, theme.bad());
    }
}
