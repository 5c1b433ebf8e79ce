//! Panel of the outline.

use crate::dashboard::text::columns;
use crate::dashboard::view::false_color::object_color;
use crate::dashboard::view::is_active;
use crate::dashboard::view::painter::{ListRow, Painter, VisibleLine};
use crate::dashboard::{BORDER, DisplayChannel, Focus, Layout, Model, OutlineEntry, OutlineLine};
use zerkalo_scene::edit::Target;

pub fn draw(model: &Model, layout: &Layout, painter: &mut Painter) {
    let theme = painter.theme;
    let Some(area) = layout.outline else { return };
    let active = is_active(model, Focus::Outline);
    painter.panel(area, "outline", active);
    let inner = area.inner(BORDER);
    let lines = model.outline_lines();
    // If the picture shows object ids as colours, each line has a mark in its object's colour.
    let with_ids = model.channel == DisplayChannel::Objects;
    let (scroll, border) = (model.outline_scroll, theme.border(active));
    for VisibleLine { row, index } in painter.window(inner, scroll, lines.len(), border) {
        match &lines[index] {
            OutlineLine::Heading(title) => {
                painter.row(inner, row).skip(1).put(title, theme.heading());
            }
            OutlineLine::Entry(OutlineEntry { target, label, depth, unfolded, note }) => {
                let selected = (*target == model.selection).then_some(active);
                let ListRow { mut to, name, note: noted, .. } =
                    painter.list_row(inner, row, selected);
                let id = match target {
                    Target::Object(i) if with_ids => theme.swatch(object_color(*i as u32)),
                    _ => None,
                };
                match id {
                    Some(style) => to.put(" ", name).put("■", style).put(" ", name),
                    None => {
                        let mark = if model.marked.contains(target) { "●" } else { " " };
                        to.put(if selected.is_some() { " ▸" } else { "  " }, name).put(mark, name)
                    }
                };
                // The name has precedence over the note.
                let fold = match unfolded {
                    Some(true) => " ▾",
                    Some(false) => " ▸",
                    None => "",
                };
                let indent = 2 * depth;
                let taken = 2 + indent + columns(label) + columns(fold);
                to.put_right(" ", 0, name).put_right(note, taken, noted);
                to.put(&" ".repeat(indent), name).put(label, name).put(fold, noted);
            }
        }
    }
}
