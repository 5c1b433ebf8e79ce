//! Encoding of cells in few bytes. Colours are sent only when they change. A block character looks
//! like its complement with exchanged colours; the one that needs fewer changes is sent.
//! The cursor moves by the shortest sequence.

use crate::cells::shape;
use ratatui::buffer::Cell;
use ratatui::style::{Color, Modifier};
use std::io::Write;
use unicode_width::UnicodeWidthStr;

/// Attributes that are visible on a space.
const LINES: Modifier = Modifier::REVERSED.union(Modifier::UNDERLINED).union(Modifier::CROSSED_OUT);

/// Colours and attributes of the next character.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Pen {
    fg: Color,
    bg: Color,
    modifier: Modifier,
}

/// Encoder of cells, which tracks colours, attributes and cursor position of the terminal.
#[derive(Clone, Debug, Default)]
pub struct Encoder {
    pen: Pen,
    /// Column and row of the cursor; `None` if unknown.
    cursor: Option<(u16, u16)>,
    columns: u16,
}

impl Encoder {
    /// Creates an encoder for a terminal with default colours and unknown cursor position.
    pub fn new(columns: u16) -> Self {
        Self { columns, ..Self::default() }
    }

    /// Writes the sequence that clears the terminal.
    pub fn clear(&mut self, out: &mut Vec<u8>) {
        *self = Self::new(self.columns);
        out.extend(b"\x1b[m\x1b[2J");
    }

    /// Writes `cell` at column `x` and row `y`.
    pub fn cell(&mut self, out: &mut Vec<u8>, x: u16, y: u16, cell: &Cell) {
        self.go(out, x, y);
        let (symbol, pen) = self.cheapest(cell);
        self.set(out, pen);
        out.extend(symbol.as_bytes());
        let width = symbol.width() as u16;
        // After the last column and wide characters, the cursor position depends on the terminal.
        self.cursor = (width == 1 && x + 1 < self.columns).then_some((x + 1, y));
    }

    /// Records that other output has moved the cursor to an unknown position.
    pub fn moved(&mut self) {
        self.cursor = None;
    }

    /// Records that other output has reset colours and attributes.
    pub fn pen_reset(&mut self) {
        self.pen = Pen::default();
    }

    /// Moves the cursor to column `x` and row `y`.
    pub fn go(&mut self, out: &mut Vec<u8>, x: u16, y: u16) {
        let before = self.cursor.replace((x, y));
        let counted = |n: u16, letter: char| match n {
            1 => format!("\x1b[{letter}"),
            n => format!("\x1b[{n}{letter}"),
        };
        let relative = match before {
            Some(position) if position == (x, y) => return,
            Some((from, row)) if row == y && from < x => Some(counted(x - from, 'C')),
            Some((from, row)) if row == y => Some(counted(from - x, 'D')),
            Some((_, row)) if row + 1 == y && x == 0 => Some("\r\n".to_string()),
            Some((column, row)) if column == x && row < y => Some(counted(y - row, 'B')),
            _ => None,
        };
        let absolute = match (x, y) {
            (0, 0) => "\x1b[H".to_string(),
            (0, y) => format!("\x1b[{}H", y + 1),
            (x, y) => format!("\x1b[{};{}H", y + 1, x + 1),
        };
        let shortest =
            relative.filter(|sequence| sequence.len() <= absolute.len()).unwrap_or(absolute);
        out.extend(shortest.as_bytes());
    }

    /// Returns the symbol and pen that show `cell` with the fewest bytes.
    fn cheapest<'a>(&self, cell: &'a Cell) -> (&'a str, Pen) {
        let Cell { fg, bg, modifier, .. } = *cell;
        let symbol = cell.symbol();
        let pen = |fg, bg| Pen { fg, bg, modifier };
        let plain = (symbol, pen(fg, bg));
        let shape = symbol.chars().next().and_then(shape);
        let Some(shape) = shape.filter(|_| !modifier.intersects(LINES)) else { return plain };
        let is_flat = fg == bg || symbol == " " || symbol == "█";
        let color = if symbol == "█" { fg } else { bg };
        // The default colours of foreground and background are both `Color::Reset`, but look
        // different.
        let is_explicit =
            [fg, bg].iter().all(|c| *c != Color::Reset) || is_flat && color != Color::Reset;
        let candidates: &[(&str, Pen)] = match (is_explicit, is_flat) {
            // The full block of some fonts does not cover the edge of the cell.
            (true, true) => &[(" ", pen(self.pen.fg, color))],
            (true, false) => &[plain, (&shape.complement, pen(bg, fg))],
            (false, _) if symbol == " " => &[(" ", pen(self.pen.fg, bg))],
            (false, _) => &[plain],
        };
        let changes = |(symbol, pen): &(&str, Pen)| {
            let colors = usize::from(pen.fg != self.pen.fg) + usize::from(pen.bg != self.pen.bg);
            // A change of colour needs up to 17 bytes, a glyph 1 to 4.
            16 * colors + symbol.len()
        };
        candidates.iter().min_by_key(|candidate| changes(candidate)).copied().unwrap_or(plain)
    }

    /// Writes the sequence (SGR) that sets colours and attributes to those of `pen`.
    fn set(&mut self, out: &mut Vec<u8>, pen: Pen) {
        if pen == self.pen {
            return;
        }
        let mut codes = Vec::new();
        // The parameter 0 resets all attributes and colours. A parameter that resets one attribute
        // may affect another one.
        if !pen.modifier.contains(self.pen.modifier) || pen == Pen::default() {
            self.pen = Pen::default();
            codes.push("0".to_string());
        }
        // Bit n of a modifier stands for the attribute that SGR parameter n + 1 sets: bold, dim and
        // so on.
        let missing = (pen.modifier - self.pen.modifier).iter();
        codes.extend(missing.map(|bit| (bit.bits().trailing_zeros() + 1).to_string()));
        for (new, old, base) in [(pen.fg, self.pen.fg, 30), (pen.bg, self.pen.bg, 40)] {
            if new != old {
                codes.push(color_code(new, base));
            }
        }
        // Writing to memory does not fail.
        let _ = write!(out, "\x1b[{}m", codes.join(";"));
        self.pen = pen;
    }
}

/// Returns the SGR parameters of `color`; `base` is 30 for foreground and 40 for background. RGB
/// and indexed colours follow ISO 8613-6.
fn color_code(color: Color, base: u8) -> String {
    let parameter = match color {
        Color::Reset => 9,
        Color::Black => 0,
        Color::Red => 1,
        Color::Green => 2,
        Color::Yellow => 3,
        Color::Blue => 4,
        Color::Magenta => 5,
        Color::Cyan => 6,
        Color::Gray => 7,
        Color::DarkGray => 60,
        Color::LightRed => 61,
        Color::LightGreen => 62,
        Color::LightYellow => 63,
        Color::LightBlue => 64,
        Color::LightMagenta => 65,
        Color::LightCyan => 66,
        Color::White => 67,
        Color::Rgb(r, g, b) => return format!("{};2;{r};{g};{b}", base + 8),
        Color::Indexed(index) => return format!("{};5;{index}", base + 8),
    };
    (base + parameter).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use ratatui::buffer::Buffer;
    use ratatui::layout::Rect;
    use ratatui::style::Style;
    use std::num::NonZeroU16;

    const SIZE: [u16; 2] = [9, 5];

    fn encoded(cells: &[(u16, u16, Cell)]) -> String {
        let (mut encoder, mut out) = (Encoder::new(80), Vec::new());
        cells.iter().for_each(|(x, y, cell)| encoder.cell(&mut out, *x, *y, cell));
        String::from_utf8(out).unwrap()
    }

    fn half(symbol: &'static str, fg: u8, bg: u8) -> Cell {
        let mut cell = Cell::new(symbol);
        cell.set_style(Style::new().fg(Color::Rgb(fg, 0, 0)).bg(Color::Rgb(bg, 0, 0)));
        cell
    }

    #[test]
    fn only_changed_colors_are_sent() {
        let cells = [(0, 0, half("▀", 1, 2)), (1, 0, half("▀", 1, 3)), (2, 0, half("▀", 3, 1))];
        let bytes = encoded(&cells);
        let expected = "\x1b[H\x1b[38;2;1;0;0;48;2;2;0;0m▀\x1b[48;2;3;0;0m▀▄";
        assert_eq!(bytes, expected);
    }

    #[test]
    fn flat_cell_is_a_space() {
        let cells = [(5, 1, half("▀", 1, 2)), (6, 1, half(" ", 7, 2)), (7, 1, half("▀", 1, 1))];
        let expected = "\x1b[2;6H\x1b[38;2;1;0;0;48;2;2;0;0m▀ \x1b[48;2;1;0;0m ";
        assert_eq!(encoded(&cells), expected);
        // A full block is sent as a space, so that the foreground of the pen does not matter.
        let cells = [(0, 0, half("▀", 1, 2)), (1, 0, half("█", 1, 9))];
        let expected = "\x1b[H\x1b[38;2;1;0;0;48;2;2;0;0m▀\x1b[48;2;1;0;0m ";
        assert_eq!(encoded(&cells), expected);
    }

    #[test]
    fn cursor_moves_by_the_shortest_sequence() {
        let x = |x, y| (x, y, Cell::new("x"));
        let bytes = encoded(&[x(3, 2), x(5, 2), x(20, 2), x(2, 2), x(3, 4), x(0, 5), x(0, 7)]);
        let expected = "\x1b[3;4Hx\x1b[Cx\x1b[14Cx\x1b[19Dx\x1b[2Bx\r\nx\x1b[8Hx";
        assert_eq!(bytes, expected);
    }

    fn color() -> impl Strategy<Value = Color> {
        prop_oneof![
            Just(Color::Reset),
            (0u8..3).prop_map(|n| Color::Rgb(n, 20, 30)),
            (0u8..3).prop_map(Color::Indexed),
        ]
    }

    fn any_cell() -> impl Strategy<Value = Cell> {
        let symbol = prop_oneof![Just("▀"), Just("▄"), Just("█"), Just(" "), Just("a"), Just("é")];
        // Bold and dim are not combined, because terminals show the combination differently and the
        // dashboard does not use it.
        let weight =
            prop_oneof![Just(Modifier::empty()), Just(Modifier::BOLD), Just(Modifier::DIM)];
        let style = prop_oneof![
            Just(Modifier::empty()),
            Just(Modifier::ITALIC),
            Just(Modifier::UNDERLINED),
            Just(Modifier::ITALIC | Modifier::UNDERLINED),
        ];
        let parts = (symbol, color(), color(), weight, style);
        parts.prop_map(|(symbol, fg, bg, weight, style)| {
            let mut cell = Cell::new(symbol);
            let modifier = weight | style;
            cell.set_style(Style::new().fg(fg).bg(bg).add_modifier(modifier));
            cell
        })
    }

    /// Returns `(contents, attributes)` of a cell of an emulated terminal. `contents` is the
    /// visible glyph with its colours. Cells that look the same have equal pairs.
    fn look(cell: &vt100::Cell) -> (String, String) {
        let [fg, bg] = [cell.fgcolor(), cell.bgcolor()].map(|color| format!("{color:?}"));
        let attributes =
            format!("{}{}{}{}", cell.bold(), cell.dim(), cell.italic(), cell.underline());
        let plain = "Default";
        match cell.contents() {
            "▀" => (format!("{fg}/{bg}"), attributes),
            "▄" if fg != plain && bg != plain => (format!("{bg}/{fg}"), attributes),
            "█" if fg != plain => (format!("{fg}/{fg}"), attributes),
            " " | "" if bg != plain && !cell.underline() => (format!("{bg}/{bg}"), attributes),
            " " | "" if !cell.underline() => ("empty".into(), attributes),
            text => (format!("{text} {fg} {bg}"), attributes),
        }
    }

    proptest! {
        /// Checks that an emulated terminal shows the encoded cells, sent in any order and over any
        /// previous contents.
        #[test]
        fn emulator_shows_encoded_cells(
            cells in prop::collection::vec((0..SIZE[0], 0..SIZE[1], any_cell()), 1..120),
        ) {
            let [columns, rows] = SIZE;
            let [wide, high] = SIZE.map(|n| NonZeroU16::new(n).unwrap());
            let mut parser = vt100::Parser::new(high, wide, 0);
            let mut expected = Buffer::empty(Rect::new(0, 0, columns, rows));
            let mut encoder = Encoder::new(columns);
            let mut out = Vec::new();
            encoder.clear(&mut out);
            for (x, y, cell) in &cells {
                encoder.cell(&mut out, *x, *y, cell);
                expected[(*x, *y)] = cell.clone();
            }
            parser.process(&out);
            for y in 0..rows {
                for x in 0..columns {
                    // The reference is a second emulated terminal that receives only this cell,
                    // with the cell's own symbol and pen.
                    let cell = &expected[(x, y)];
                    let mut alone = vt100::Parser::new(high, wide, 0);
                    let mut bytes = Vec::new();
                    let mut encoder = Encoder::new(columns);
                    let pen = Pen { fg: cell.fg, bg: cell.bg, modifier: cell.modifier };
                    encoder.set(&mut bytes, pen);
                    bytes.extend(cell.symbol().as_bytes());
                    alone.process(&bytes);
                    let shown = look(parser.screen().cell(y, x).unwrap());
                    prop_assert_eq!(shown, look(alone.screen().cell(0, 0).unwrap()), "{} {}", x, y);
                }
            }
        }
    }
}
