//! Drawing of text, panels and lists into a buffer of terminal cells.

use crate::dashboard::text::{columns, cut, wrapped};
use crate::dashboard::view::theme::Theme;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};
use ratatui::widgets::{Block, Clear, Widget};
use std::borrow::Cow;
use zerkalo_scene::value::sanitized;

pub struct Painter<'a> {
    pub theme: Theme,
    pub buffer: &'a mut Buffer,
}

/// Visible line of a list: its row in the area of the list, and its index in the list.
pub struct VisibleLine {
    pub row: u16,
    pub index: usize,
}

/// Row of a list, with the styles of its parts.
pub struct ListRow<'a> {
    pub to: Row<'a>,
    pub name: Style,
    pub note: Style,
    pub key: Style,
}

impl Painter<'_> {
    /// Starts row `row` of a list in `area`. `selected` is `None` unless the cursor is on the row.
    /// Its value is `true` if the list has the focus.
    pub fn list_row(&mut self, area: Rect, row: u16, selected: Option<bool>) -> ListRow<'_> {
        let theme = self.theme;
        let mut to = self.row(area, row);
        let [name, note, key] = match selected {
            Some(active) => [theme.selected(active); 3],
            None => [theme.text(), theme.dim(), theme.accent()],
        };
        if selected.is_some() {
            to.fill(name);
        }
        ListRow { to, name, note, key }
    }

    /// Returns a writer of row `row` of `area`, counted from 0.
    pub fn row(&mut self, area: Rect, row: u16) -> Row<'_> {
        let bounds = area.intersection(self.buffer.area);
        let y = area.y.saturating_add(row);
        let inside = row < area.height && (bounds.top()..bounds.bottom()).contains(&y);
        let (x, end) = if inside { (bounds.left(), bounds.right()) } else { (0, 0) };
        Row { buffer: self.buffer, theme: self.theme, x, end, y }
    }

    /// Draws the border of a panel with its title.
    pub fn panel(&mut self, area: Rect, title: &str, focused: bool) {
        let theme = self.theme;
        Block::bordered()
            .border_type(theme.border_type(focused))
            .border_style(theme.border(focused))
            .render(area, self.buffer);
        let style = match focused {
            true => theme.accent().add_modifier(Modifier::BOLD),
            false => theme.heading(),
        };
        if !title.is_empty() {
            self.edge(area, 0).put(" ", style).put(title, style).put(" ", style);
        }
    }

    /// Returns a writer of row `row` of a panel's border, without two columns at each end.
    pub fn edge(&mut self, area: Rect, row: u16) -> Row<'_> {
        self.row(Rect { x: area.x + 2, width: area.width.saturating_sub(4), ..area }, row)
    }

    /// Draws an empty box over the panels.
    pub fn overlay(&mut self, area: Rect, title: &str) {
        Clear.render(area.intersection(self.buffer.area), self.buffer);
        self.panel(area, title, true);
    }

    /// Draws the scroll bar of a list to the right of `area`, unless all `len` lines are visible.
    /// Returns the visible lines: from `scroll` on, or from a smaller index if too few lines would
    /// remain to fill `area`.
    pub fn window(
        &mut self,
        area: Rect,
        scroll: usize,
        len: usize,
        style: Style,
    ) -> impl Iterator<Item = VisibleLine> + use<> {
        let rows = usize::from(area.height);
        let most = len.saturating_sub(rows);
        let first = scroll.min(most);
        if most > 0 && rows > 0 {
            let length = (rows * rows / len).max(1);
            let top = (rows - length) * first / most;
            let bar = Rect { x: area.x + area.width, width: 1, ..area };
            for row in top..top + length {
                self.row(bar, row as u16).put("┃", style);
            }
        }
        (0..area.height).zip(first..len).map(|(row, index)| VisibleLine { row, index })
    }

    /// Draws texts below each other, wrapped. An empty text is an empty line.
    pub fn paragraphs(&mut self, area: Rect, texts: &[(String, Style)]) {
        let lines = texts.iter().flat_map(|(text, style)| {
            wrapped(text, area.width).into_iter().map(move |line| (line, *style))
        });
        for (row, (line, style)) in (0..area.height).zip(lines) {
            self.row(area, row).put(&line, style);
        }
    }
}

/// Writer of a row of cells, from left to right.
pub struct Row<'a> {
    pub buffer: &'a mut Buffer,
    pub theme: Theme,
    /// Column of the next text.
    pub x: u16,
    /// First column to the right of the free columns.
    pub end: u16,
    pub y: u16,
}

impl Row<'_> {
    pub fn left(&self) -> usize {
        usize::from(self.end.saturating_sub(self.x))
    }

    pub fn put(&mut self, text: &str, style: Style) -> &mut Self {
        let left = self.left();
        if left > 0 {
            let text = safe(text);
            let visible = cut(&text, left);
            (self.x, _) = self.buffer.set_stringn(self.x, self.y, visible, left, style);
        }
        self
    }

    /// Draws `text`, truncated or padded to `width` columns, or to the columns left if fewer.
    pub fn put_wide(&mut self, text: &str, width: usize, style: Style) -> &mut Self {
        let width = width.min(self.left());
        let text = safe(text);
        let visible = cut(&text, width);
        let gap = width - columns(&visible).min(width);
        self.put(&visible, style).skip(gap)
    }

    /// Draws `text` at the right end, if there is room for it and `gap` columns before it.
    pub fn put_right(&mut self, text: &str, gap: usize, style: Style) -> &mut Self {
        let text = safe(text);
        let width = columns(&text);
        if width > 0 && width + gap <= self.left() {
            self.end -= width as u16;
            self.buffer.set_stringn(self.end, self.y, text, width, style);
        }
        self
    }

    pub fn skip(&mut self, columns: usize) -> &mut Self {
        self.x += columns.min(self.left()) as u16;
        self
    }

    pub fn fill(&mut self, style: Style) -> &mut Self {
        let area = Rect { x: self.x, y: self.y, width: self.end - self.x, height: 1 };
        if area.width > 0 {
            self.buffer.set_style(area, style);
        }
        self
    }
}

/// Escapes control characters, which the buffer would drop.
fn safe(text: &str) -> Cow<'_, str> {
    if text.chars().any(char::is_control) {
        Cow::Owned(sanitized(text))
    } else {
        Cow::Borrowed(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dashboard::Preferences;
    use zerkalo_terminal::cells::Colors;

    #[test]
    fn text_is_clipped_to_its_area() {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 8, 2));
        let tones = Preferences::default().tones;
        let theme = Theme { colors: Colors::Mono, on_light: false, tones };
        let mut painter = Painter { theme, buffer: &mut buffer };
        let area = Rect { x: 2, y: 1, width: 4, height: 1 };
        painter.row(area, 0).put("abcdefgh", Style::new());
        painter.row(area, 1).put("outside", Style::new());
        painter.row(Rect { x: 7, y: 0, width: 9, height: 9 }, 0).put("yz", Style::new());
        let wide = Rect { x: 0, y: 0, width: 6, height: 1 };
        painter
            .row(wide, 0)
            .put_right("r\u{1b}", 0, Style::new())
            .put_right("R", 0, Style::new())
            .put("l", Style::new())
            .put_right("never", 1, Style::new());
        let row = |y: u16| (0..8).map(|x| buffer[(x, y)].symbol()).collect::<String>();
        assert_eq!([row(0), row(1)], ["l    R …", "  abc…  "]);
    }
}
