//! Plot of error against time in a measurement. Each experiment has a panel with logarithmic axes,
//! which shows the error curves of the default settings and of the experiment's variants.

use crate::measure::experiment;
use crate::measure::experiment::Experiment;
use crate::measure::result::{Measured, Measurement, median};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, register_font};
use std::error::Error;
use std::ops::Range;
use zerkalo_render::ErrorParts;

/// Font of plots, which are therefore the same on every machine. It is Ubuntu Light, reduced to
/// Latin, Greek and Cyrillic letters, figures and signs, without hinting.
const FONT: &[u8] = include_bytes!("font/light.ttf");

/// Width and height of a panel of the plot, in pixels.
const PANEL: (i32, i32) = (440, 374);
/// Height of the heading above all panels, in pixels.
const HEAD: i32 = 64;
/// Factor by which each axis extends beyond the smallest and the largest number shown on it.
const MARGIN: f64 = 1.15;

/// Colours of curves, distinguishable with any colour vision (Okabe and Ito 2008).
const COLORS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];
const DEFAULT: RGBColor = RGBColor(90, 90, 90);
const INK: RGBColor = RGBColor(40, 40, 40);
const GRID: RGBColor = RGBColor(226, 226, 226);
const TARGET: RGBColor = RGBColor(150, 150, 150);

/// Smallest part of an error that a plot shows, in 8-bit levels.
const SMALLEST_PART: f64 = 1e-3;

/// Name and points of a curve.
type Curve<'a> = (&'a str, Vec<(f64, f64)>);
type Drawn = Result<(), Box<dyn Error>>;

/// Draws the plot of error against time as SVG.
pub fn svg(measurement: &Measurement, title: &str) -> Result<String, Box<dyn Error>> {
    let (cols, rows) = grid(panels(measurement).len() + 1);
    let size = ((cols * PANEL.0) as u32, (HEAD + rows * PANEL.1) as u32);
    let mut text = String::new();
    draw(SVGBackend::with_string(&mut text, size), measurement, title)?;
    Ok(text)
}

/// Returns the panels of the plot: each experiment with its variants. Every panel also shows the
/// default settings, which have a panel of their own only if there are no experiments.
fn panels(measurement: &Measurement) -> Vec<(&'static Experiment, &[Measured])> {
    let changed = &measurement.measured[1..];
    let panels = changed.chunk_by(|a, b| a.variant.experiment == b.variant.experiment);
    match changed {
        [] => vec![(&experiment::DEFAULT, changed)],
        _ => panels.map(|variants| (variants[0].variant.experiment, variants)).collect(),
    }
}

/// Returns the number of columns and rows of a grid for `panels` panels of the plot.
fn grid(panels: usize) -> (i32, i32) {
    let cols = match panels {
        1 => 1,
        2 | 4 => 2,
        _ => 3,
    };
    (cols as i32, panels.div_ceil(cols) as i32)
}

/// Returns the points (seconds, RMSE in 8-bit levels) of a variant's error curve at which both
/// numbers are positive.
fn points(measured: &Measured) -> Vec<(f64, f64)> {
    let coordinates = |p: &crate::measure::Point| (median(&p.seconds), p.errors.rmse_levels);
    measured.points.iter().map(coordinates).filter(|(s, e)| *s > 0.0 && *e > 0.0).collect()
}

/// Returns the range of an axis that shows `values`; 0.1..10 without values.
fn range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, 0f64), |(l, h), v| (l.min(v), h.max(v)));
    if low.is_finite() { low / MARGIN..high * MARGIN } else { 0.1..10.0 }
}

/// Returns the tick marks of a logarithmic axis: 1, 2 and 5 times each power of ten, or only the
/// powers of ten if that makes more than nine. `plotters` itself marks only powers of ten.
fn ticks(range: &Range<f64>) -> Vec<f64> {
    let powers = range.start.log10().floor() as i32..=range.end.log10().ceil() as i32;
    let multiples = |steps: &[f64]| -> Vec<f64> {
        let ticks = powers.clone().flat_map(|k| steps.iter().map(move |m| m * 10f64.powi(k)));
        ticks.filter(|tick| range.contains(tick)).collect()
    };
    let ticks = multiples(&[1.0, 2.0, 5.0]);
    if ticks.len() > 9 { multiples(&[1.0]) } else { ticks }
}

/// Formats a tick mark without the digits of its rounding error.
fn label(tick: &f64) -> String {
    format!("{tick:.*}", (-tick.log10().floor()).max(0.0) as usize)
}

fn text<'a>(size: u32, color: RGBColor) -> TextStyle<'a> {
    ("sans-serif", size).into_font().color(&color)
}

fn draw(backend: SVGBackend, measurement: &Measurement, title: &str) -> Drawn {
    // An error means that the font is registered already.
    let _ = register_font("sans-serif", FontStyle::Normal, FONT);
    let root = backend.into_drawing_area();
    root.fill(&WHITE)?;
    let (head, body) = root.split_vertically(HEAD);
    head.draw_text(title, &text(20, INK), (24, 14))?;
    let words = "Error against time: lower and further left is better";
    head.draw_text(words, &text(14, DEFAULT), (24, 40))?;
    let panels = panels(measurement);
    let (cols, rows) = grid(panels.len() + 1);
    let mut areas = body.split_evenly((rows as usize, cols as usize)).into_iter();
    for ((experiment, variants), area) in panels.iter().zip(&mut areas) {
        let all = std::iter::once(measurement.default()).chain(*variants);
        let curves = all.map(|measured| (measured.variant.name.as_str(), points(measured)));
        panel(&area, &measurement.targets, experiment.title, curves.collect())?;
    }
    if let Some(area) = areas.next() {
        panel(&area, &[], "Parts of the error, default settings", parts(measurement.default()))?;
    }
    root.present()?;
    Ok(())
}

/// Returns the curves of the whole error and of its parts: points (seconds, 8-bit levels).
fn parts(measured: &Measured) -> Vec<Curve<'static>> {
    let curve = |name, part: fn(&ErrorParts) -> Option<f64>| {
        let all = measured.points.iter();
        let point = |p: &crate::measure::Point| {
            Some((median(&p.seconds), p.parts.as_ref().and_then(part)?))
        };
        let shown = |(seconds, levels): &(f64, f64)| *seconds > 0.0 && *levels >= SMALLEST_PART;
        (name, all.filter_map(point).filter(shown).collect())
    };
    vec![
        curve("error", |parts| Some(parts.total()).filter(|total| total.is_finite())),
        curve("noise", |parts| Some(parts.noise)),
        curve("rounding", |parts| parts.rounding),
        curve("cut paths, bound", |parts| parts.cut_paths.filter(|cut| cut.is_finite())),
        curve("8 bits", |parts| Some(parts.quantization)),
    ]
}

/// Draws a panel of `curves`, with lines at `targets` that are visible.
fn panel(
    area: &DrawingArea<SVGBackend, Shift>,
    targets: &[f64],
    title: &str,
    curves: Vec<Curve>,
) -> Drawn {
    let numbers = || curves.iter().flat_map(|(_, points)| points);
    let (seconds, levels) = (range(numbers().map(|p| p.0)), range(numbers().map(|p| p.1)));
    let mut chart = ChartBuilder::on(area)
        .caption(title, text(15, INK))
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(52)
        .build_cartesian_2d(
            seconds.clone().log_scale().with_key_points(ticks(&seconds)),
            levels.clone().log_scale().with_key_points(ticks(&levels)),
        )?;
    chart
        .configure_mesh()
        .bold_line_style(GRID)
        .axis_style(INK)
        .label_style(text(13, INK))
        .axis_desc_style(text(13, DEFAULT))
        .x_desc("seconds of tracing")
        .y_desc("RMSE as displayed, 8-bit levels")
        .x_label_formatter(&label)
        .y_label_formatter(&label)
        .draw()?;
    for target in targets.iter().filter(|target| levels.contains(target)) {
        let line = [(seconds.start, *target), (seconds.end, *target)];
        chart.draw_series(DashedLineSeries::new(line, 4, 4, TARGET.into()))?;
        let unit = if *target == 1.0 { "level" } else { "levels" };
        // Curves fall from the upper left, so there is room below them at the left edge.
        let small = text(12, TARGET).pos(Pos::new(HPos::Left, VPos::Bottom));
        let name = Text::new(format!(" {target} {unit}"), line[0], small);
        chart.draw_series(std::iter::once(name))?;
    }
    let colors = std::iter::once(&DEFAULT).chain(COLORS.iter().cycle());
    for ((name, points), color) in curves.into_iter().zip(colors) {
        let style = color.stroke_width(if *color == DEFAULT { 4 } else { 2 });
        let dots = points.clone().into_iter().map(|point| Circle::new(point, 3, color.filled()));
        chart.draw_series(dots)?;
        chart
            .draw_series(LineSeries::new(points, style))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .label_font(text(13, INK))
        .draw()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_at_most_nine() {
        let labels = |range| ticks(&range).iter().map(label).collect::<Vec<_>>();
        assert_eq!(labels(0.13..2.4), ["0.2", "0.5", "1", "2"]);
        assert_eq!(labels(0.001..2e4).first().unwrap(), "0.001");
        assert_eq!(labels(0.001..2e4).last().unwrap(), "10000");
        assert!(labels(0.001..2e4).len() <= 9);
    }

    #[test]
    fn panels_fill_a_grid() {
        assert_eq!([1, 2, 3, 4, 5, 10].map(grid), [(1, 1), (2, 1), (3, 1), (2, 2), (3, 2), (3, 4)]);
    }
}
