//! Drawing of the selection's outline and of the marks of lights over the picture.

use crate::dashboard::view::painter::Painter;
use crate::dashboard::{Layout, Model};
use ratatui::style::Modifier;
use zerkalo_render::film::{Detail, Window};
use zerkalo_scene::edit::Target;
use zerkalo_terminal::cells::{Oklab, Raster};

/// Colours of the outline. In each pixel, the first one is preferred.
const OUTLINE: [[u8; 3]; 2] = [[255, 172, 60], [20, 20, 24]];
/// Least difference in OKLab of the outline from the picture.
const CONTRAST: f32 = 0.2;

/// Draws a line around the part of the picture in which `mask` is white.
pub fn outline(raster: &mut Raster, mask: &Raster) {
    let (width, pixels) = (raster.width, &mask.pixels);
    let inside = |i: usize| pixels.get(i) == Some(&[255; 3]);
    for i in 0..raster.pixels.len() {
        let x = i % width;
        let beside = x > 0 && inside(i - 1) || x + 1 < width && inside(i + 1);
        if !inside(i) && (beside || i >= width && inside(i - width) || inside(i + width)) {
            let color = Oklab::of(raster.pixels[i]);
            let shows = |line: &[u8; 3]| Oklab::of(*line).distance(color) > CONTRAST;
            raster.pixels[i] = OUTLINE.into_iter().find(shows).unwrap_or(OUTLINE[0]);
        }
    }
}

/// Returns the pixels of `detail` with a line around the part in which `mask`, an image of `window`
/// of the film, is white. The line is smooth between the pixels of the mask.
pub fn outlined(detail: &Detail, mask: &Raster, window: Window) -> Vec<[u8; 3]> {
    let (of, [width, height]) = (detail.window, detail.size);
    let most = [mask.width, mask.height].map(|n| n.saturating_sub(1));
    // Position in the mask: the pixel before it along `axis`, the one after, and the share of that.
    let between = |axis: usize, at: usize| {
        let film = of.origin[axis] as f64
            + (at as f64 + 0.5) * of.size[axis] as f64 / detail.size[axis] as f64;
        let share = (film - window.origin[axis] as f64) / window.size[axis] as f64;
        let at = (share * (most[axis] + 1) as f64 - 0.5).clamp(0.0, most[axis] as f64);
        (at as usize, (at as usize + 1).min(most[axis]), at.fract())
    };
    let white = |x: usize, y: usize| f64::from(mask.pixels[y * mask.width + x][0]);
    let columns: Vec<_> = (0..width).map(|x| between(0, x)).collect();
    let rows: Vec<_> = (0..height).map(|y| between(1, y)).collect();
    let mask = Raster::from_fn(width, height, |i| {
        let ((left, right, x), (top, low, y)) = (columns[i % width], rows[i / width]);
        let across = |row| white(left, row) * (1.0 - x) + white(right, row) * x;
        [if across(top) * (1.0 - y) + across(low) * y > 127.0 { 255 } else { 0 }; 3]
    });
    let mut raster = Raster { width, height, pixels: detail.pixels.clone() };
    outline(&mut raster, &mask);
    raster.pixels
}

/// Draws the marks of the lights.
pub fn draw(model: &Model, layout: &Layout, painter: &mut Painter) {
    let theme = painter.theme;
    for mark in model.light_marks(layout) {
        let Some(light) = model.scene().lights.get(mark.light) else { continue };
        let most = light.color.0.into_iter().fold(f64::MIN_POSITIVE, f64::max);
        let color = light
            .color
            .0
            .map(|c| zerkalo_render::film::quantised_8(255.0 * (c / most).powf(1.0 / 2.2)));
        let style = match model.selection == Target::Light(mark.light) {
            true => theme.selected(true),
            false => theme.swatch(color).unwrap_or_default().patch(theme.badge()),
        };
        let style = style.add_modifier(Modifier::BOLD);
        let glyph = if light.on { '●' } else { '○' };
        for (glyph, cell) in mark.arrow.into_iter().chain([(glyph, mark.cell)]) {
            let is_inside = layout.image.contains((cell[0], cell[1]).into());
            if let Some(cell) = painter.buffer.cell_mut((cell[0], cell[1])).filter(|_| is_inside) {
                cell.reset();
                cell.set_char(glyph).set_style(style);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outline_surrounds_mask_in_a_colour_that_shows() {
        let orange = |i: usize| if i < 10 { [255, 172, 60] } else { [30; 3] };
        let mut raster = Raster::from_fn(5, 4, orange);
        let before = raster.clone();
        let mask = Raster::from_fn(5, 4, |i| if [7, 12].contains(&i) { [255; 3] } else { [0; 3] });
        outline(&mut raster, &mask);
        let changed: Vec<_> = (0..20).filter(|i| raster.pixels[*i] != before.pixels[*i]).collect();
        assert_eq!(changed, [2, 6, 8, 11, 13, 17]);
        assert_eq!([raster.pixels[2], raster.pixels[17]], [OUTLINE[1], OUTLINE[0]]);
        // Around a mask of 2 x 2 pixels, of which one is white, the corner is cut.
        let window = Window::whole([16, 16]);
        let detail =
            Detail { window, size: [16, 16], pixels: vec![[30; 3]; 256], ..Detail::default() };
        let mask = Raster::from_fn(2, 2, |i| if i == 0 { [255; 3] } else { [0; 3] });
        let pixels = outlined(&detail, &mask, window);
        let edge = |y: usize| (0..16).find(|x| pixels[16 * y + x] == OUTLINE[0]);
        assert_eq!([0, 3, 6, 7].map(edge), [Some(8), Some(8), Some(6), Some(5)]);
    }
}
