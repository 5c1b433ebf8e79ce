//! Borders, titles and scroll bars of panels, and the border of the picture's panel.

use crate::dashboard::layout::{Focus, Layout};
use crate::dashboard::message::DisplayChannel;
use crate::dashboard::model::{CompareView, Mode, Model};
use crate::dashboard::view::legend::Legend;
use crate::dashboard::view::text::{Row, columns, number};
use crate::dashboard::view::theme::Theme;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};
use ratatui::widgets::{Block, Clear, Widget};
use zerkalo_render::film::Tone;

/// Draws the border of a panel with its title. `focused` is `true` if the panel has the focus.
pub fn panel(area: Rect, title: &str, focused: bool, theme: &Theme, buffer: &mut Buffer) {
    Block::bordered()
        .border_type(theme.border_type(focused))
        .border_style(theme.border(focused))
        .render(area, buffer);
    let style = match focused {
        true => theme.accent().add_modifier(Modifier::BOLD),
        false => theme.heading(),
    };
    let inside = Rect { x: area.x + 2, width: area.width.saturating_sub(4), ..area };
    if !title.is_empty() {
        Row::new(buffer, inside, 0).put(" ", style).put(title, style).put(" ", style);
    }
}

/// Draws an empty box with a border and a title over the panels.
pub fn overlay(area: Rect, title: &str, theme: &Theme, buffer: &mut Buffer) {
    Clear.render(area.intersection(buffer.area), buffer);
    panel(area, title, true, theme, buffer);
}

/// Draws the scroll bar of a list on the border to the right of `area`, unless all of its `len`
/// lines are visible. `scroll` is the index of the first visible line; it is reduced if lines below
/// the end of the list would be visible. Returns two values for each visible line: its row in
/// `area` and its index.
pub fn window(
    area: Rect,
    scroll: usize,
    len: usize,
    style: Style,
    buffer: &mut Buffer,
) -> impl Iterator<Item = (u16, usize)> + use<> {
    let rows = usize::from(area.height);
    let most = len.saturating_sub(rows);
    let first = scroll.min(most);
    if most > 0 && rows > 0 {
        let length = (rows * rows / len).max(1);
        let top = (rows - length) * first / most;
        let bar = Rect { x: area.x + area.width, width: 1, ..area };
        for row in top..top + length {
            Row::new(buffer, bar, row as u16).put("┃", style);
        }
    }
    (0..area.height).zip(first..len)
}

/// Draws the border of the picture's panel with file name, mode, channel, exposure, tone curve and
/// legend. Draws nothing in full screen.
pub fn draw(
    model: &Model,
    layout: &Layout,
    legend: Option<&Legend>,
    theme: &Theme,
    buffer: &mut Buffer,
) {
    let area = layout.picture;
    let bottom = area.height.saturating_sub(1);
    let inside = Rect { x: area.x + 2, width: area.width.saturating_sub(4), ..area };
    if model.fullscreen {
        return;
    }
    let focused = crate::dashboard::view::is_active(model, Focus::Picture);
    panel(area, "", focused, theme, buffer);
    let chips = chips(model);
    let chip_columns: usize = chips.iter().map(|(text, _)| columns(text) + 3).sum();
    let mut row = Row::new(buffer, inside, 0);
    if chip_columns + 12 <= row.left() {
        for (text, loud) in chips.iter().rev() {
            let style = if *loud { theme.warn() } else { theme.dim() };
            row.put_right(&format!(" {text} "), 0, style);
            row.put_right("─", 0, theme.border(focused));
        }
    }
    let name = match focused {
        true => theme.accent().add_modifier(Modifier::BOLD),
        false => theme.text().add_modifier(Modifier::BOLD),
    };
    let unsaved = if model.is_unsaved() { 2 } else { 0 };
    let room = row.left().saturating_sub(2 + unsaved);
    row.put(" ", name).put(&crate::dashboard::view::text::cut(&model.file.name, room), name);
    if unsaved > 0 {
        row.put(" ●", theme.warn());
    }
    row.put(" ", name);
    if let Some(mode) = mode(model) {
        Row::new(buffer, inside, bottom)
            .put(" ", theme.accent())
            .put(&mode, theme.accent())
            .put(" ", theme.accent());
    }
    if let Some(legend) = legend {
        legend.draw(inside, bottom, theme, buffer);
    }
}

/// Returns short texts for the border of the picture: the channel or comparison that is shown, the
/// exposure and the tone curve. Default settings have no text. The second value of each pair is
/// `true` if the text is emphasised.
fn chips(model: &Model) -> Vec<(String, bool)> {
    let mut chips = Vec::new();
    match (model.comparison.shown, model.channel) {
        (CompareView::Pinned, _) => {
            let spp = model.comparison.pinned.as_ref().map_or(0.0, |(_, spp)| *spp);
            chips.push((format!("pinned picture, {spp:.0} spp"), true));
        }
        (CompareView::Difference, _) => chips.push(("live − pinned".to_string(), true)),
        (CompareView::Live, DisplayChannel::Beauty) => {}
        (CompareView::Live, channel) => chips.push((channel.name().to_string(), true)),
    }
    let exposure = model.display.exposure_ev;
    if exposure != 0.0 {
        let sign = if exposure > 0.0 { "+" } else { "−" };
        chips.push((format!("{sign}{} EV", number(exposure.abs())), false));
    }
    if model.display.tone != Tone::Clip {
        chips.push((model.display.tone.to_string(), false));
    }
    chips
}

/// Returns a description of the mode of the picture's panel. Returns `None` in the default mode, in
/// which the arrow keys orbit.
fn mode(model: &Model) -> Option<String> {
    let selected = || model.selection.title(model.scene());
    Some(match model.mode {
        Mode::Orbit => return None,
        Mode::Move => format!("moving {}", selected()),
        Mode::Rotate => format!("turning {}", selected()),
        Mode::Fly => "flying".to_string(),
        Mode::Probe => "probing".to_string(),
    })
}
