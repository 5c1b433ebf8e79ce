//! Legend of pictures in false colour.

use crate::dashboard::view::picture::paint;
use crate::dashboard::view::text::{Row, columns, number};
use crate::dashboard::view::theme::Theme;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;
use zerkalo_terminal::cells::{PictureCells, Raster, Scale, difference, magnitude};

/// Width of the legend's colour bar in columns.
const BAR: usize = 12;

/// Legend of a false-colour scale: the values at both ends, the unit and a colour bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    low: String,
    high: String,
    unit: String,
    bar: Raster,
}

impl Legend {
    /// Creates the legend of a false-colour picture. `scale` gives the values at the ends of the
    /// colour bar, and `unit` is their unit.
    pub fn magnitude(scale: Scale, unit: &str) -> Self {
        let bar = bar(magnitude);
        let [low, high] = [scale.value(0.0), scale.value(1.0)].map(number);
        Self { low, high, unit: unit.to_string(), bar }
    }

    /// Creates the legend of false-colour differences from `-end` to `end` in 8-bit levels. `rms`
    /// is the root mean square of the differences.
    pub fn difference(end: f64, rms: f64) -> Self {
        Self {
            low: format!("-{end}"),
            high: format!("+{end}"),
            unit: format!("8-bit levels · RMS {}", number(rms)),
            bar: bar(|part| difference(2.0 * part - 1.0)),
        }
    }

    /// Returns the width of the whole legend in columns.
    fn columns(&self) -> usize {
        columns(&self.low) + columns(&self.high) + columns(&self.unit) + BAR + 5
    }

    /// Draws the legend at the right end of the row `row` of `area`. Omits the unit if there is no
    /// room for it. Draws nothing if even the legend without the unit does not fit.
    pub fn draw(&self, area: Rect, row: u16, theme: &Theme, buffer: &mut Buffer) {
        let mut line = Row::new(buffer, area, row);
        let words = columns(&self.unit) + 1;
        let (width, with_words) = match line.left() {
            left if left >= self.columns() => (self.columns(), true),
            left if left >= self.columns() - words => (self.columns() - words, false),
            _ => return,
        };
        line.skip(line.left() - width).put(" ", theme.text()).put(&self.low, theme.text());
        line.put(" ", theme.text());
        let bar = Rect { x: line.x, y: area.y + row, width: BAR as u16, height: 1 };
        line.skip(BAR).put(" ", Style::new()).put(&self.high, theme.text());
        if with_words {
            line.put(" ", Style::new()).put(&self.unit, theme.dim());
        }
        line.put(" ", Style::new());
        paint(&PictureCells::new(&self.bar, theme.colors, false), bar, buffer);
    }
}

/// Returns a colour bar: a row of cells with the colours that `color` assigns to values from 0 to
/// 1.
fn bar(color: impl Fn(f64) -> [u8; 3]) -> Raster {
    Raster::from_fn(BAR, 2, |i| color((i % BAR) as f64 / (BAR - 1) as f64))
}
