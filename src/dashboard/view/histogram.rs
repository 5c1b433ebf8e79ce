//! Histogram of the picture's luminance, in place of the convergence plot.

use crate::dashboard::BORDER;
use crate::dashboard::text::number;
use crate::dashboard::view::painter::Painter;
use ratatui::layout::Rect;
use zerkalo_terminal::cells::Raster;

#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Number of pixels with each luminance in levels.
    counts: [u32; 256],
    /// Shares of the pixels in which a channel is at its end, and of black ones, in percent.
    clipped: [f64; 2],
}

impl Histogram {
    pub fn of(raster: &Raster) -> Self {
        let mut counts = [0; 256];
        for [r, g, b] in raster.pixels.iter().map(|rgb| rgb.map(f64::from)) {
            counts[(0.2126 * r + 0.7152 * g + 0.0722 * b).round() as usize] += 1;
        }
        let share = |is_counted: fn(&&[u8; 3]) -> bool| {
            let count = raster.pixels.iter().filter(is_counted).count();
            100.0 * count as f64 / raster.pixels.len().max(1) as f64
        };
        Self { counts, clipped: [share(|rgb| rgb.contains(&255)), share(|rgb| **rgb == [0; 3])] }
    }

    /// Draws the square roots of the counts.
    pub fn draw(&self, area: Rect, painter: &mut Painter) {
        let theme = painter.theme;
        painter.panel(area, "luminance", false);
        let [white, black] = self.clipped.map(number);
        let text = format!(" {white} % clipped, {black} % black ");
        painter.edge(area, 0).skip(12).put_right(&text, 0, theme.text());
        let inner = area.inner(BORDER);
        let (width, rows) = (usize::from(inner.width), usize::from(inner.height).saturating_sub(1));
        let mut bars = vec![0; width];
        for (level, count) in self.counts.iter().enumerate() {
            bars[level * width / 256] += count;
        }
        let most = bars.iter().copied().max().unwrap_or(0).max(1);
        let eighths = bars.iter().map(|count| {
            let height = (f64::from(*count) / f64::from(most)).sqrt() * 8.0 * rows as f64;
            height.ceil() as usize
        });
        let eighths: Vec<_> = eighths.collect();
        for row in 0..rows {
            let above = |eighths: &usize| eighths.saturating_sub(8 * (rows - 1 - row)).min(8);
            let bar =
                |eighths: &usize| [' ', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'][above(eighths)];
            let line: String = eighths.iter().map(bar).collect();
            painter.row(inner, row as u16).put(&line, theme.accent());
        }
        let mut axis = painter.row(inner, rows as u16);
        axis.put_right("255", 0, theme.dim());
        axis.put("0", theme.dim()).skip(width / 2 - 2).put("128", theme.dim());
    }
}
