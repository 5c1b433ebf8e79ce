//! Panel of the outline, a list of everything in the scene that can be selected and edited.

use crate::dashboard::layout::{BORDER, Focus, Layout};
use crate::dashboard::message::DisplayChannel;
use crate::dashboard::model::{CompareView, Model};
use crate::dashboard::panel_lines::{OutlineEntry, OutlineLine, outline};
use crate::dashboard::view::frame::{panel, window};
use crate::dashboard::view::is_active;
use crate::dashboard::view::text::{Row, columns};
use crate::dashboard::view::theme::Theme;
use ratatui::buffer::Buffer;
use zerkalo_scene::edit::Target;
use zerkalo_terminal::cells::object_color;

/// Draws the outline, the list of all parts of the scene. Draws nothing if the panel is hidden.
pub fn draw(model: &Model, layout: &Layout, theme: &Theme, buffer: &mut Buffer) {
    let Some(area) = layout.outline else { return };
    let active = is_active(model, Focus::Outline);
    panel(area, "outline", active, theme, buffer);
    let inner = area.inner(BORDER);
    let lines = outline(model.scene());
    // If the picture shows object ids, the outline shows the colour of each object.
    let with_ids =
        model.channel == DisplayChannel::Objects && model.comparison.shown == CompareView::Live;
    let (scroll, border) = (model.outline_scroll, theme.border(active));
    for (row, i) in window(inner, scroll, lines.len(), border, buffer) {
        let mut to = Row::new(buffer, inner, row);
        match &lines[i] {
            OutlineLine::Heading(title) => {
                to.put(" ", theme.heading()).put(title, theme.heading());
            }
            OutlineLine::Entry(OutlineEntry { subject, label, note }) => {
                let selected = *subject == model.selection;
                let (name, noted) = match selected {
                    true => (theme.selected(active), theme.selected(active)),
                    false => (theme.text(), theme.dim()),
                };
                if selected {
                    to.fill(name);
                }
                let id = match subject {
                    Target::Object(i) if with_ids => theme.swatch(object_color(*i as u32)),
                    _ => None,
                };
                match id {
                    Some(style) => to.put(" ", name).put("■", style).put(" ", name),
                    None => to.put(if selected { " ▸ " } else { "   " }, name),
                };
                // The note, at the right end of the line, is omitted if there is no room for the
                // whole name beside it.
                to.put_right(" ", 0, name).put_right(note, 2 + columns(label), noted);
                to.put(label, name);
            }
        }
    }
}
