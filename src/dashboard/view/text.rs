//! Text in rows of terminal cells. Its width is measured in columns; text that is too long is
//! truncated with an ellipsis.

use crate::dashboard::overlay_layout::wrapped;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;
use std::borrow::Cow;
use unicode_width::{UnicodeWidthChar, UnicodeWidthStr};
use zerkalo_scene::value::sanitized;

/// Returns the width of `text` in columns.
pub fn columns(text: &str) -> usize {
    text.width()
}

/// Truncates `text` to `width` columns. The last column of truncated text is an ellipsis.
pub fn cut(text: &str, width: usize) -> Cow<'_, str> {
    if columns(text) <= width {
        return Cow::Borrowed(text);
    }
    let mut out = String::new();
    let mut used = 1;
    for c in text.chars() {
        used += c.width().unwrap_or(0);
        if used > width {
            break;
        }
        out.push(c);
    }
    if width > 0 {
        out.push('…');
    }
    Cow::Owned(out)
}

/// Returns `text` without its first `skipped` columns.
pub fn skip(text: &str, skipped: usize) -> &str {
    let mut used = 0;
    let start = text.char_indices().find(|(_, c)| {
        let reached = used >= skipped;
        used += c.width().unwrap_or(0);
        reached
    });
    start.map_or("", |(at, _)| &text[at..])
}

/// Writer of a row of cells, which is filled from left to right.
pub struct Row<'a> {
    buffer: &'a mut Buffer,
    /// Column of the screen at which the next text begins.
    pub x: u16,
    /// Column of the screen that follows the last free column of the row.
    end: u16,
    /// Position of the row on the screen, counted from 0.
    pub y: u16,
}

impl<'a> Row<'a> {
    /// Creates a writer for row `row` of `area`, counted from 0. Nothing is drawn outside of
    /// `area`.
    pub fn new(buffer: &'a mut Buffer, area: Rect, row: u16) -> Self {
        let bounds = area.intersection(buffer.area);
        let y = area.y.saturating_add(row);
        let inside = row < area.height && (bounds.top()..bounds.bottom()).contains(&y);
        let (x, end) = if inside { (bounds.left(), bounds.right()) } else { (0, 0) };
        Self { buffer, x, end, y }
    }

    /// Returns the number of free columns of the row.
    pub fn left(&self) -> usize {
        usize::from(self.end.saturating_sub(self.x))
    }

    /// Draws `text` in the free columns of the row, truncated if necessary.
    pub fn put(&mut self, text: &str, style: Style) -> &mut Self {
        let left = self.left();
        if left > 0 {
            let text = safe(text);
            let visible = cut(&text, left);
            (self.x, _) = self.buffer.set_stringn(self.x, self.y, visible, left, style);
        }
        self
    }

    /// Draws `text`, truncated or padded to `width` columns, or to the free columns of the row if
    /// those are fewer.
    pub fn put_wide(&mut self, text: &str, width: usize, style: Style) -> &mut Self {
        let width = width.min(self.left());
        let text = safe(text);
        let visible = cut(&text, width);
        let gap = width - columns(&visible).min(width);
        self.put(&visible, style).skip(gap)
    }

    /// Draws `text` at the right end of the row's free columns. Draws nothing if there is no room
    /// for `text` and `gap` free columns before it.
    pub fn put_right(&mut self, text: &str, gap: usize, style: Style) -> &mut Self {
        let text = safe(text);
        let width = columns(&text);
        if width > 0 && width + gap <= self.left() {
            self.end -= width as u16;
            self.buffer.set_stringn(self.end, self.y, text, width, style);
        }
        self
    }

    /// Skips `columns` columns of the row, which stay unchanged.
    pub fn skip(&mut self, columns: usize) -> &mut Self {
        self.x += columns.min(self.left()) as u16;
        self
    }

    /// Sets the style of the row's free columns.
    pub fn fill(&mut self, style: Style) -> &mut Self {
        let area = Rect { x: self.x, y: self.y, width: self.end - self.x, height: 1 };
        if area.width > 0 {
            self.buffer.set_style(area, style);
        }
        self
    }
}

/// Draws texts below each other, from the top of `area` on. Each has a style and is wrapped at the
/// width of `area`. An empty text is an empty line.
pub fn paragraphs(area: Rect, texts: &[(String, Style)], buffer: &mut Buffer) {
    let lines = texts.iter().flat_map(|(text, style)| {
        wrapped(text, area.width).into_iter().map(move |line| (line, *style))
    });
    for (row, (line, style)) in (0..area.height).zip(lines) {
        Row::new(buffer, area, row).put(&line, style);
    }
}

/// Escapes control characters in `text`, because the buffer would drop them without notice.
fn safe(text: &str) -> Cow<'_, str> {
    if text.chars().any(char::is_control) {
        Cow::Owned(sanitized(text))
    } else {
        Cow::Borrowed(text)
    }
}

/// Formats `value` with about three significant digits, such as `1.50`, `21.3` or `1.20e6`.
pub fn number(value: f64) -> String {
    match value.abs() {
        v if v >= 9.995e5 || v < 5e-4 && v > 0.0 => format!("{value:.2e}"),
        v if v >= 99.95 => format!("{value:.0}"),
        v if v >= 9.995 => format!("{value:.1}"),
        v if v >= 0.0995 || v == 0.0 => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    }
}

/// Formats a duration, such as `0.4 s`, `35 s`, `12 min` or `3.5 h`.
pub fn duration(seconds: f64) -> String {
    let (value, unit) = in_unit(seconds, seconds);
    format!("{value} {unit}")
}

/// Formats a range of durations, such as `3–5 s`.
pub fn durations(from: f64, to: f64) -> String {
    let ((from, _), (to, unit)) = (in_unit(from, to), in_unit(to, to));
    if from == to { format!("{to} {unit}") } else { format!("{from}–{to} {unit}") }
}

/// Converts `seconds` to a unit (s, min, h or days) that suits a duration of `reference` seconds.
/// Returns two texts: the converted number and the name of the unit.
fn in_unit(seconds: f64, reference: f64) -> (String, &'static str) {
    let (value, unit) = match reference {
        r if r < 99.5 => (seconds, "s"),
        r if r < 99.5 * 60.0 => (seconds / 60.0, "min"),
        r if r < 72.0 * 3600.0 => (seconds / 3600.0, "h"),
        _ => (seconds / 86_400.0, "days"),
    };
    let text = if value >= 9.95 || value == 0.0 {
        format!("{value:.0}")
    } else {
        format!("{value:.1}").trim_end_matches(".0").to_string()
    };
    (text, unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn truncation_counts_columns() {
        assert_eq!(cut("mirror", 6), "mirror");
        assert_eq!(cut("mirror", 5), "mirr…");
        assert_eq!(cut("鏡鏡鏡", 6), "鏡鏡鏡");
        // Wide characters are not split.
        assert_eq!(cut("鏡鏡鏡", 4), "鏡…");
        assert_eq!(cut("鏡鏡鏡", 5), "鏡鏡…");
        assert_eq!([cut("abc", 1), cut("abc", 0)], ["…", ""]);
        assert_eq!([skip("abc", 1), skip("鏡ab", 2), skip("ab", 9)], ["bc", "ab", ""]);
    }

    #[test]
    fn text_is_clipped_to_its_area() {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 8, 2));
        let area = Rect { x: 2, y: 1, width: 4, height: 1 };
        Row::new(&mut buffer, area, 0).put("abcdefgh", Style::new());
        Row::new(&mut buffer, area, 1).put("outside", Style::new());
        Row::new(&mut buffer, Rect { x: 7, y: 0, width: 9, height: 9 }, 0).put("yz", Style::new());
        let wide = Rect { x: 0, y: 0, width: 6, height: 1 };
        Row::new(&mut buffer, wide, 0)
            .put_right("r\u{1b}", 0, Style::new())
            .put_right("R", 0, Style::new())
            .put("l", Style::new())
            .put_right("never", 1, Style::new());
        let row = |y: u16| (0..8).map(|x| buffer[(x, y)].symbol()).collect::<String>();
        assert_eq!([row(0), row(1)], ["l    R …", "  abc…  "]);
    }

    #[test]
    fn numbers_and_durations_are_formatted() {
        let numbers = [0.0, 0.012_34, 0.5, 1.0 / 3.0, 9.999, 12.34, 99.96, 1234.0, 3e6, 1e-5];
        let expected =
            ["0.00", "0.012", "0.50", "0.33", "10.0", "12.3", "100", "1234", "3.00e6", "1.00e-5"];
        assert_eq!(numbers.map(number), expected);
        let times = [0.0, 0.42, 3.04, 35.2, 99.6, 600.0, 5999.0, 9000.0, 1e6];
        let expected =
            ["0 s", "0.4 s", "3 s", "35 s", "1.7 min", "10 min", "1.7 h", "2.5 h", "12 days"];
        assert_eq!(times.map(duration), expected);
        assert_eq!([durations(3.0, 5.0), durations(20.0, 150.0)], ["3–5 s", "0.3–2.5 min"]);
        assert_eq!(durations(3.01, 3.02), "3 s");
    }
}
