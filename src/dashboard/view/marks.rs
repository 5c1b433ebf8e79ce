//! Drawing of the selection's outline and of the marks of lights over the picture.

use crate::dashboard::view::painter::Painter;
use crate::dashboard::{Layout, Model};
use ratatui::style::Modifier;
use zerkalo_scene::edit::Target;
use zerkalo_terminal::cells::{Oklab, Raster};
use zerkalo_world::FirstHit;

/// Colours of the outline. In each pixel, the first one is preferred.
const OUTLINE: [[u8; 3]; 2] = [[255, 172, 60], [20, 20, 24]];
/// Least difference in OKLab of the outline from the picture.
const CONTRAST: f32 = 0.2;

/// Returns a function that returns `true` if the first hit of a camera ray is on the selection.
pub fn is_selected(model: &Model) -> impl Fn(&FirstHit) -> bool {
    let all = match &model.selection {
        Target::Part(i, _) => Target::Object(*i).solids(model.scene()),
        _ => Vec::new(),
    };
    let own = model.selection.solids(model.scene());
    let is_own = move |part: u32| all.get(part as usize).is_some_and(|solid| own.contains(solid));
    move |hit| is_on(model, hit, &is_own)
}

fn is_on(model: &Model, hit: &FirstHit, is_own_part: impl Fn(u32) -> bool) -> bool {
    let Some(index) = hit.object.map(|object| object as usize) else { return false };
    match &model.selection {
        Target::Object(selected) => *selected == index,
        Target::Part(selected, _) => *selected == index && is_own_part(hit.part),
        Target::Material(name) => {
            model.scene().objects.get(index).is_some_and(|object| object.names_material(name))
        }
        Target::Camera
        | Target::View(_)
        | Target::Group(_)
        | Target::Light(_)
        | Target::Settings(_) => false,
    }
}

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
    }
}
