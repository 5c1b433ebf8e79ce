//! Legend of pictures in false colour.

use crate::dashboard::text::{columns, number};
use crate::dashboard::view::false_color::{Scale, difference, magnitude};
use crate::dashboard::view::painter::Row;
use crate::dashboard::view::picture::paint;
use ratatui::layout::Rect;
use zerkalo_terminal::cells::{Raster, picture_cells};

/// Width of the colour bar in columns.
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

    /// Draws the legend at the right end of the row, without the unit if there is no room for it.
    pub fn draw(&self, mut line: Row) {
        let theme = line.theme;
        let needed = columns(&self.low) + columns(&self.high) + BAR + 4;
        line.put_right(&format!("{} ", self.unit), needed, theme.dim());
        if line.left() < needed {
            return;
        }
        line.put_right(&format!(" {} ", self.high), 0, theme.text());
        line.put_right(&" ".repeat(BAR), 0, theme.text());
        let bar = Rect { x: line.end, y: line.y, width: BAR as u16, height: 1 };
        line.put_right(&format!(" {} ", self.low), 0, theme.text());
        paint(&picture_cells(&self.bar, theme.colors, false), bar, line.buffer);
    }
}

/// Returns a bar with the colours of values from 0 to 1.
fn bar(color: impl Fn(f64) -> [u8; 3]) -> Raster {
    Raster::from_fn(BAR, 2, |i| color((i % BAR) as f64 / (BAR - 1) as f64))
}
