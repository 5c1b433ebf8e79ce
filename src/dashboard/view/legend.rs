//! Legend of pictures in false colour.

use crate::dashboard::text::{columns, number};
use crate::dashboard::view::false_color::{Scale, difference, magnitude};
use crate::dashboard::view::painter::Row;
use crate::dashboard::view::picture::paint;
use ratatui::layout::Rect;
use ratatui::style::Style;
use zerkalo_terminal::cells::{Raster, picture_cells};

const BAR: usize = 12;

/// Legend of a scale: the values at both ends, the unit and a colour bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    low: String,
    high: String,
    unit: String,
    bar: Raster,
}

impl Legend {
    /// Creates the legend of `scale`.
    pub fn magnitude(scale: Scale, unit: &str) -> Self {
        let bar = bar(magnitude);
        let [low, high] = [scale.value(0.0), scale.value(1.0)].map(number);
        Self { low, high, unit: unit.to_string(), bar }
    }

    /// Creates the legend of differences from `-end` to `end`. `rms` is their root mean square.
    pub fn difference(end: f64, rms: f64) -> Self {
        Self {
            low: format!("-{end}"),
            high: format!("+{end}"),
            unit: format!("8-bit levels · RMS {}", number(rms)),
            bar: bar(|part| difference(2.0 * part - 1.0)),
        }
    }

    fn columns(&self) -> usize {
        columns(&self.low) + columns(&self.high) + columns(&self.unit) + BAR + 5
    }

    /// Draws the legend at the right end of the row, without the unit if there is no room for it.
    pub fn draw(&self, mut line: Row) {
        let theme = line.theme;
        let words = columns(&self.unit) + 1;
        let (width, with_words) = match line.left() {
            left if left >= self.columns() => (self.columns(), true),
            left if left >= self.columns() - words => (self.columns() - words, false),
            _ => return,
        };
        line.skip(line.left() - width).put(" ", theme.text()).put(&self.low, theme.text());
        line.put(" ", theme.text());
        let bar = Rect { x: line.x, y: line.y, width: BAR as u16, height: 1 };
        line.skip(BAR).put(" ", Style::new()).put(&self.high, theme.text());
        if with_words {
            line.put(" ", Style::new()).put(&self.unit, theme.dim());
        }
        line.put(" ", Style::new());
        paint(&picture_cells(&self.bar, theme.colors, false), bar, line.buffer);
    }
}

/// Returns a bar with the colours of values from 0 to 1.
fn bar(color: impl Fn(f64) -> [u8; 3]) -> Raster {
    Raster::from_fn(BAR, 2, |i| color((i % BAR) as f64 / (BAR - 1) as f64))
}
