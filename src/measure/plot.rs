//! Error against time, drawn: log-log, one line a variation.

use super::result::{Measured, Measurement, median};
use epaint_default_fonts::UBUNTU_LIGHT;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use std::error::Error;

/// Width and height of a drawing, in pixels.
pub const SIZE: (u32, u32) = (1000, 640);

/// Axes' ends are this much beyond the data.
const MARGIN: f64 = 1.25;

/// The drawing as SVG.
///
/// # Errors
/// What the drawing library says.
pub fn svg(measurement: &Measurement, title: &str) -> Result<String, Box<dyn Error>> {
    let mut text = String::new();
    draw(SVGBackend::with_string(&mut text, SIZE), measurement, title)?;
    Ok(text)
}

/// The drawing as rows of red, green, blue, 8 bits each, [`SIZE`] pixels.
///
/// # Errors
/// What the drawing library says.
pub fn pixels(measurement: &Measurement, title: &str) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut bytes = vec![0; SIZE.0 as usize * SIZE.1 as usize * 3];
    draw(BitMapBackend::with_buffer(&mut bytes, SIZE), measurement, title)?;
    Ok(bytes)
}

/// (seconds, codes) of the points that have both.
fn points(measured: &Measured) -> Vec<(f64, f64)> {
    let of = |p: &super::Point| (median(&p.seconds), p.errors.rmse_codes);
    measured.points.iter().map(of).filter(|(s, e)| *s > 0.0 && *e > 0.0).collect()
}

fn draw<B: DrawingBackend>(
    backend: B,
    measurement: &Measurement,
    title: &str,
) -> Result<(), Box<dyn Error>>
where
    B::ErrorType: 'static,
{
    // Drawings look alike on every machine; a font that is registered already stays.
    let _ = register_font("sans-serif", FontStyle::Normal, UBUNTU_LIGHT);
    let lines: Vec<(&Measured, Vec<(f64, f64)>)> = measurement
        .measured
        .iter()
        .map(|m| (m, points(m)))
        .filter(|(_, p)| !p.is_empty())
        .collect();
    let all = || lines.iter().flat_map(|(_, points)| points.iter().copied());
    let range = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::INFINITY, 0f64), |(l, h), v| (l.min(v), h.max(v)));
        if low.is_finite() { low / MARGIN..high * MARGIN } else { 0.1..10.0 }
    };
    let seconds = range(&mut all().map(|p| p.0));
    let codes = range(&mut all().map(|p| p.1));

    let root = backend.into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 22))
        .margin(16)
        .x_label_area_size(48)
        .y_label_area_size(64)
        .build_cartesian_2d(seconds.clone().log_scale(), codes.log_scale())?;
    chart
        .configure_mesh()
        .x_desc("seconds of tracing")
        .y_desc("RMSE as displayed, 8-bit codes")
        .label_style(("sans-serif", 15))
        .light_line_style(BLACK.mix(0.04))
        .bold_line_style(BLACK.mix(0.12))
        .draw()?;
    for target in &measurement.targets {
        let line = [(seconds.start, *target), (seconds.end, *target)];
        chart.draw_series(LineSeries::new(line, BLACK.mix(0.25)))?;
    }
    for (i, (measured, points)) in lines.iter().enumerate() {
        let color = Palette99::pick(i).to_rgba();
        let label = match measured.topic {
            super::Topic::Default => measured.name.clone(),
            topic => format!("{}: {}", topic.name(), measured.name),
        };
        chart
            .draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(2)))?
            .label(label)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
        let dots = points.iter().map(|p| Circle::new(*p, 3, color.filled()));
        chart.draw_series(dots)?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerLeft)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.2))
        .label_font(("sans-serif", 15))
        .draw()?;
    root.present()?;
    Ok(())
}
