//! Plot of error against time in a measurement. Each experiment has a panel with logarithmic axes,
//! which shows the error curves of the default settings and of the experiment's variants.

use crate::measure::experiment::Experiment;
use crate::measure::result::{Measured, Measurement, median};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, register_font};
use std::error::Error;
use std::ops::Range;

/// Font of the text in plots, so that plots are the same on every machine. It is Ubuntu Light,
/// reduced to Latin, Greek and Cyrillic letters, figures and signs, without hinting.
const FONT: &[u8] = include_bytes!("font/light.ttf");

/// Width and height of a panel of the plot, in pixels.
const PANEL: (i32, i32) = (440, 374);
/// Height of the heading above all panels, in pixels.
const HEAD: i32 = 64;

/// Margins between the edges of a panel and its coordinate area, in pixels: left, right, top,
/// bottom.
const FRAME: [i32; 4] = [58, 22, 96, 50];

/// Factor by which each axis of the plot extends beyond the smallest and the largest number shown
/// on it.
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

/// Error curve of a render with one variant of the settings, in a panel of the plot.
struct Line<'a> {
    name: &'a str,
    color: RGBColor,
    /// Points of the curve (seconds, RMSE in 8-bit levels).
    points: Vec<(f64, f64)>,
}

type Drawn = Result<(), Box<dyn Error>>;
type Canvas<B> = DrawingArea<B, Shift>;

/// Returns the width and height of the plot of a measurement, in pixels.
pub fn size(measurement: &Measurement) -> (u32, u32) {
    let (cols, rows) = grid(panels(measurement).len());
    ((cols * PANEL.0) as u32, (HEAD + rows * PANEL.1) as u32)
}

/// Draws the plot of error against time as SVG.
///
/// # Errors
/// Returns the error of the drawing library.
pub fn svg(measurement: &Measurement, title: &str) -> Result<String, Box<dyn Error>> {
    let mut text = String::new();
    draw(SVGBackend::with_string(&mut text, size(measurement)), measurement, title)?;
    Ok(text)
}

/// Draws the plot of error against time as an RGB image of 8 bits per channel, row by row. Its
/// width and height are those of [`size`].
///
/// # Errors
/// Returns the error of the drawing library.
pub fn pixels(measurement: &Measurement, title: &str) -> Result<Vec<u8>, Box<dyn Error>> {
    let (width, height) = size(measurement);
    let mut bytes = vec![0; width as usize * height as usize * 3];
    draw(BitMapBackend::with_buffer(&mut bytes, (width, height)), measurement, title)?;
    Ok(bytes)
}

/// Returns the panels of the plot, each as an experiment and its variants. Every panel shows the
/// default settings, too. They have a panel of their own only if there are no experiments.
fn panels(measurement: &Measurement) -> Vec<(Experiment, Vec<&Measured>)> {
    let mut panels: Vec<(Experiment, Vec<&Measured>)> = Vec::new();
    for measured in measurement.measured.iter().skip(1) {
        match panels.last_mut() {
            Some((experiment, variants)) if *experiment == measured.experiment => {
                variants.push(measured)
            }
            _ => panels.push((measured.experiment, vec![measured])),
        }
    }
    if panels.is_empty() {
        panels.push((Experiment::Default, Vec::new()));
    }
    panels
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
    let coordinates =
        |p: &crate::measure::Point| (median(&measured.seconds(p)), p.errors.rmse_levels);
    measured.points.iter().map(coordinates).filter(|(s, e)| *s > 0.0 && *e > 0.0).collect()
}

/// Logarithmic axis of a plot, which maps numbers to pixel coordinates.
struct Axis {
    numbers: Range<f64>,
    pixels: (i32, i32),
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, pixels: (i32, i32)) -> Self {
        let (low, high) = values.fold((f64::INFINITY, 0f64), |(l, h), v| (l.min(v), h.max(v)));
        let numbers = if low.is_finite() { low / MARGIN..high * MARGIN } else { 0.1..10.0 };
        Self { numbers, pixels }
    }

    fn at(&self, value: f64) -> i32 {
        let share =
            (value / self.numbers.start).ln() / (self.numbers.end / self.numbers.start).ln();
        self.pixels.0 + (share * f64::from(self.pixels.1 - self.pixels.0)).round() as i32
    }

    /// Returns the tick marks of the axis: round numbers in its range, each with its label. The
    /// numbers are 1, 2 and 5 times each power of ten. If more than nine of these are in the range,
    /// only the powers of ten are returned.
    fn ticks(&self) -> Vec<(f64, String)> {
        let Range { start, end } = self.numbers;
        let powers = start.log10().floor() as i32..=end.log10().ceil() as i32;
        let multiples = |steps: &'static [u32]| {
            powers.clone().flat_map(move |k| steps.iter().map(move |m| (*m, k)))
        };
        let number = |(m, k): (u32, i32)| f64::from(m) * 10f64.powi(k);
        let inside = |tick: &(u32, i32)| (start..=end).contains(&number(*tick));
        let label = |tick: (u32, i32)| {
            (number(tick), format!("{:.*}", (-tick.1).max(0) as usize, number(tick)))
        };
        let mut ticks: Vec<_> = multiples(&[1, 2, 5]).filter(inside).collect();
        if ticks.len() > 9 {
            ticks = multiples(&[1]).filter(inside).collect();
        }
        ticks.into_iter().map(label).collect()
    }
}

fn text<'a>(size: u32, color: RGBColor, h: HPos, v: VPos) -> TextStyle<'a> {
    ("sans-serif", size).into_font().color(&color).pos(Pos::new(h, v))
}

fn draw<B: DrawingBackend>(backend: B, measurement: &Measurement, title: &str) -> Drawn
where
    B::ErrorType: 'static,
{
    // An error means that the font is registered already.
    let _ = register_font("sans-serif", FontStyle::Normal, FONT);
    let root = backend.into_drawing_area();
    root.fill(&WHITE)?;
    root.draw_text(title, &text(20, INK, HPos::Left, VPos::Top), (24, 14))?;
    let words = "Error against time: lower and further left is better";
    root.draw_text(words, &text(14, DEFAULT, HPos::Left, VPos::Top), (24, 40))?;
    let panels = panels(measurement);
    let (cols, _) = grid(panels.len());
    for (i, (experiment, variants)) in (0..).zip(&panels) {
        let corner = (i % cols * PANEL.0, HEAD + i / cols * PANEL.1);
        panel(&root, corner, measurement, *experiment, variants)?;
    }
    root.present()?;
    Ok(())
}

/// Draws the plot panel of one experiment: the curves of the default settings and of `variants`.
/// `corner` is the upper left corner of the panel.
fn panel<'a, B: DrawingBackend>(
    root: &Canvas<B>,
    corner: (i32, i32),
    measurement: &'a Measurement,
    experiment: Experiment,
    variants: &[&'a Measured],
) -> Drawn
where
    B::ErrorType: 'static,
{
    let [left, right, top, bottom] = FRAME;
    let (x0, x1) = (corner.0 + left, corner.0 + PANEL.0 - right);
    let (y0, y1) = (corner.1 + PANEL.1 - bottom, corner.1 + top);
    let colors = std::iter::once(&DEFAULT).chain(COLORS.iter().cycle());
    let all = measurement.measured.first().into_iter().chain(variants.iter().copied());
    let line = |(measured, color): (&'a Measured, &RGBColor)| Line {
        name: &measured.name,
        color: *color,
        points: points(measured),
    };
    let lines: Vec<Line> = all.zip(colors).map(line).collect();
    let numbers = || lines.iter().flat_map(|line| line.points.iter().copied());
    let seconds = Axis::new(numbers().map(|p| p.0), (x0, x1));
    let levels = Axis::new(numbers().map(|p| p.1), (y0, y1));

    let heading = text(15, INK, HPos::Left, VPos::Top);
    root.draw_text(experiment.title(), &heading, (x0 - 34, corner.1 + 8))?;
    legend(root, (x0 - 34, corner.1 + 38), x1, &lines)?;
    let path = |from, to, color: &RGBColor| PathElement::new([from, to], color.stroke_width(1));
    for (tick, label) in seconds.ticks() {
        let x = seconds.at(tick);
        root.draw(&path((x, y0), (x, y1), &GRID))?;
        root.draw_text(&label, &text(13, INK, HPos::Center, VPos::Top), (x, y0 + 6))?;
    }
    for (tick, label) in levels.ticks() {
        let y = levels.at(tick);
        root.draw(&path((x0, y), (x1, y), &GRID))?;
        root.draw_text(&label, &text(13, INK, HPos::Right, VPos::Center), (x0 - 8, y))?;
    }
    // Curves fall from the upper left, so there is room below them for the labels of targets at the
    // left edge.
    let small = text(12, TARGET, HPos::Left, VPos::Bottom);
    for target in measurement.targets.iter().filter(|t| levels.numbers.contains(t)) {
        let y = levels.at(*target);
        for x in (x0..x1).step_by(8) {
            root.draw(&path((x, y), ((x + 4).min(x1), y), &TARGET))?;
        }
        let unit = if *target == 1.0 { "level" } else { "levels" };
        root.draw_text(&format!("{target} {unit}"), &small, (x0 + 4, y - 2))?;
    }
    root.draw(&path((x0, y0), (x1, y0), &INK))?;
    root.draw(&path((x0, y0), (x0, y1), &INK))?;
    let axis = text(13, DEFAULT, HPos::Right, VPos::Top);
    root.draw_text("seconds of tracing", &axis, (x1, y0 + 26))?;
    let axis = text(13, DEFAULT, HPos::Left, VPos::Top);
    root.draw_text("RMSE as displayed, 8-bit levels", &axis, (x0 - 34, y1 - 26))?;
    for Line { color, points, .. } in &lines {
        let vertices: Vec<(i32, i32)> =
            points.iter().map(|(s, e)| (seconds.at(*s), levels.at(*e))).collect();
        let width = if *color == DEFAULT { 4 } else { 2 };
        root.draw(&PathElement::new(vertices.clone(), color.stroke_width(width)))?;
        for point in vertices {
            root.draw(&Circle::new(point, 3, color.filled()))?;
        }
    }
    Ok(())
}

/// Draws the legend of a plot panel: a line in the colour of each curve, followed by the name of
/// the curve. The first row starts at `corner`. Rows are wrapped at the x coordinate `end`.
fn legend<B: DrawingBackend>(
    root: &Canvas<B>,
    corner: (i32, i32),
    end: i32,
    lines: &[Line],
) -> Drawn
where
    B::ErrorType: 'static,
{
    const SWATCH: i32 = 18;
    let style = text(13, INK, HPos::Left, VPos::Center);
    let (mut x, mut y) = corner;
    for Line { name, color, .. } in lines {
        let width = SWATCH + 5 + root.estimate_text_size(name, &style)?.0 as i32;
        if x + width > end && x > corner.0 {
            (x, y) = (corner.0, y + 17);
        }
        let stroke = color.stroke_width(if *color == DEFAULT { 4 } else { 2 });
        root.draw(&PathElement::new([(x, y), (x + SWATCH, y)], stroke))?;
        root.draw_text(name, &style, (x + SWATCH + 5, y))?;
        x += width + 14;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_at_most_nine() {
        let labels = |numbers| {
            let axis = Axis { numbers, pixels: (0, 100) };
            axis.ticks().into_iter().map(|(_, label)| label).collect::<Vec<_>>()
        };
        assert_eq!(labels(0.13..2.4), ["0.2", "0.5", "1", "2"]);
        assert_eq!(labels(0.001..2e4).first().unwrap(), "0.001");
        assert_eq!(labels(0.001..2e4).last().unwrap(), "10000");
        assert!(labels(0.001..2e4).len() <= 9);
    }

    #[test]
    fn axis_maps_logarithms_evenly() {
        let axis = Axis { numbers: 0.01..100.0, pixels: (100, 500) };
        assert_eq!([0.01, 1.0, 10.0, 100.0].map(|v| axis.at(v)), [100, 300, 400, 500]);
    }

    #[test]
    fn panels_fill_a_grid() {
        assert_eq!([1, 2, 3, 4, 5, 10].map(grid), [(1, 1), (2, 1), (3, 1), (2, 2), (3, 2), (3, 4)]);
    }
}
