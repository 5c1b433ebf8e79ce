//! Convergence plot: noise over seconds of tracing on logarithmic axes, with the noise target and
//! the estimated time at which it is reached.

use crate::dashboard::text::{self, columns};
use crate::dashboard::view::false_color::positive_range;
use crate::dashboard::view::painter::Painter;
use crate::dashboard::{BORDER, Layout, Model};
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::widgets::Widget;
use ratatui::widgets::canvas::{Canvas, Line};
use zerkalo_scene::value::{number, round_significant};

/// Logarithmic axis from `low` to `high`, both greater than 0.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axis {
    low: f64,
    high: f64,
}

impl Axis {
    /// Creates an axis that contains all positive finite `values`.
    fn around(values: impl Iterator<Item = f64>) -> Option<Self> {
        let (low, high) = positive_range(values)?;
        // The axis spans at least a factor of 2, and both ends get a margin of 10 %.
        let stretch = (2.0 * low / high).max(1.0).sqrt() * 1.1;
        Some(Self { low: low / stretch, high: high * stretch })
    }

    /// Returns the position of `value`: 0 at the lower end, 1 at the upper end.
    fn part(&self, value: f64) -> f64 {
        (value / self.low).ln() / (self.high / self.low).ln()
    }

    /// Returns the ticks: powers of ten, and on a short axis also two and five times these.
    fn ticks(&self) -> Vec<f64> {
        let steps: &[f64] = if self.high / self.low < 50.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let first = self.low.log10().floor() as i32;
        let last = self.high.log10().ceil() as i32;
        let all = (first..=last).flat_map(|e| steps.iter().map(move |s| s * 10f64.powi(e)));
        all.filter(|t| (self.low..=self.high).contains(t)).collect()
    }
}

/// Formats the value of a tick, such as `0.5` or `20`, without the rounding error of negative
/// powers of ten.
fn label(value: f64) -> String {
    number(round_significant(value, 3))
}

pub fn draw(model: &Model, layout: &Layout, painter: &mut Painter) {
    let theme = painter.theme;
    let Some(area) = layout.plot else { return };
    painter.panel(area, "convergence", false);
    let inner = area.inner(BORDER);
    let points = &model.convergence.points;
    let Some(last) = points.last() else {
        let text = "no estimate of the noise yet";
        let indent = usize::from(inner.width).saturating_sub(columns(text)) / 2;
        painter.row(inner, inner.height / 2).skip(indent).put(text, theme.dim());
        return;
    };
    let mut title = painter.edge(area, 0);
    title.skip(14).put_right(
        &format!(" {} levels ", text::number(last.noise_levels)),
        0,
        theme.text(),
    );
    let target = model.stop.noise_levels.filter(|t| *t > 0.0);
    let eta = model.snapshot.as_ref().and_then(|s| s.report.eta_seconds);
    let reached = match (target, eta) {
        (Some(target), Some(left)) if target < last.noise_levels => {
            Some((last.seconds + left.mean(), target))
        }
        _ => None,
    };
    let seconds = points.iter().map(|p| p.seconds).chain(reached.map(|(s, _)| s));
    let noise = points.iter().map(|p| p.noise_levels).chain(target);
    let (Some(x), Some(y)) = (Axis::around(seconds), Axis::around(noise)) else { return };
    let Some(plot) = axes(inner, &x, &y, painter) else { return };
    let place = |seconds: f64, noise: f64| (x.part(seconds), y.part(noise));
    Canvas::default()
        .marker(Marker::Braille)
        .x_bounds([0.0, 1.0])
        .y_bounds([0.0, 1.0])
        .paint(|canvas| {
            if let Some(target) = target {
                let ends = [0.0, 1.0].map(|x| (x, y.part(target)));
                dashes(ends, 0.5, theme.good()).for_each(|dash| canvas.draw(&dash));
            }
            if let Some((seconds, noise)) = reached {
                let ends = [place(last.seconds, last.noise_levels), place(seconds, noise)];
                dashes(ends, 0.4, theme.dim()).for_each(|dash| canvas.draw(&dash));
            }
            canvas.layer();
            for pair in points.windows(2) {
                let ends = [pair[0], pair[1]].map(|p| place(p.seconds, p.noise_levels));
                canvas.draw(&line(ends, theme.accent()));
            }
            let point = place(last.seconds, last.noise_levels);
            canvas.draw(&line([point; 2], theme.accent()));
        })
        .render(plot, painter.buffer);
}

/// Returns a line between two points. Only the colour of `style` is used.
fn line([(x1, y1), (x2, y2)]: [(f64, f64); 2], style: Style) -> Line {
    Line { x1, y1, x2, y2, color: style.fg.unwrap_or(Color::Reset) }
}

/// Returns the dashes between two points, which cover the fraction `covered` of the line.
fn dashes([a, b]: [(f64, f64); 2], covered: f64, style: Style) -> impl Iterator<Item = Line> {
    let at = move |part: f64| (a.0 + (b.0 - a.0) * part, a.1 + (b.1 - a.1) * part);
    (0..DASHES).map(move |i| {
        let start = i as f64 / DASHES as f64;
        line([start, start + covered / DASHES as f64].map(at), style)
    })
}

/// Number of dashes of a dashed line.
const DASHES: usize = 16;

/// Draws both axes. Returns the area between them, or `None` if there is no room.
fn axes(area: Rect, x: &Axis, y: &Axis, painter: &mut Painter) -> Option<Rect> {
    let theme = painter.theme;
    let ticks: Vec<_> = y.ticks().into_iter().map(|t| (t, label(t))).collect();
    let labels = ticks.iter().map(|(_, l)| columns(l)).max().unwrap_or(0) as u16;
    let left = labels + 2;
    if area.width < left + 8 || area.height < 4 {
        return None;
    }
    let plot =
        Rect { x: area.x + left, y: area.y, width: area.width - left - 1, height: area.height - 2 };
    let line = theme.border(false);
    for row in 0..plot.height {
        painter.row(Rect { x: plot.x - 1, width: 1, ..plot }, row).put("│", line);
    }
    let foot = Rect { x: plot.x - 1, width: plot.width + 1, ..area };
    painter.row(foot, plot.height).put("└", line).put(&"─".repeat(plot.width.into()), line);
    let mut free = plot.height;
    for (tick, text) in &ticks {
        let row = ((1.0 - y.part(*tick)) * f64::from(plot.height)) as u16;
        // Ticks go from the bottom to the top. A row gets at most one label.
        if row < free {
            let indent = usize::from(labels) - columns(text);
            painter.row(area, row).skip(indent).put(text, theme.dim());
            painter.row(Rect { x: plot.x - 1, width: 1, ..plot }, row).put("┤", line);
            free = row;
        }
    }
    let mut free = area.x;
    for tick in x.ticks() {
        let text = format!("{} s", label(tick));
        let column = plot.x + (x.part(tick) * f64::from(plot.width)) as u16;
        let start = column.saturating_sub(columns(&text) as u16 / 2).max(area.x);
        let end = start + columns(&text) as u16;
        if start >= free && end <= area.x + area.width && column < plot.x + plot.width {
            let label_area = Rect { x: start, width: end - start, ..area };
            painter.row(label_area, plot.height + 1).put(&text, theme.dim());
            painter.row(Rect { x: column, width: 1, ..area }, plot.height).put("┬", line);
            free = end + 1;
        }
    }
    Some(plot)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_include_values_and_have_ticks() {
        for values in [vec![0.02, 30.0], vec![1.0], vec![0.4, 0.5], vec![1e-3, 1e5]] {
            let axis = Axis::around(values.iter().copied()).unwrap();
            for value in &values {
                assert!((0.0..=1.0).contains(&axis.part(*value)), "{values:?} {axis:?}");
            }
            let ticks = axis.ticks();
            assert!(!ticks.is_empty() && ticks.is_sorted(), "{values:?} {ticks:?}");
        }
        assert_eq!(Axis::around([0.0, f64::NAN].into_iter()), None);
        assert_eq!(
            Axis { low: 0.3, high: 6.0 }.ticks().iter().map(|t| label(*t)).collect::<Vec<_>>(),
            ["0.5", "1", "2", "5"]
        );
        assert_eq!(
            Axis { low: 0.02, high: 60.0 }.ticks().iter().map(|t| label(*t)).collect::<Vec<_>>(),
            ["0.1", "1", "10"]
        );
    }
}
