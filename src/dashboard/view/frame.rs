//! Border of the picture's panel, with file name, mode and settings of the display.

use crate::dashboard::text::{columns, cut, number};
use crate::dashboard::view::is_active;
use crate::dashboard::view::legend::Legend;
use crate::dashboard::view::painter::Painter;
use crate::dashboard::{DisplayChannel, Focus, Layout, Mode, Model};
use ratatui::style::Modifier;
use zerkalo_render::film::TILE;
use zerkalo_scene::Tone;

pub fn draw(model: &Model, layout: &Layout, legend: Option<&Legend>, painter: &mut Painter) {
    let theme = painter.theme;
    let area = layout.picture;
    let bottom = area.height.saturating_sub(1);
    if model.fullscreen {
        return;
    }
    let focused = is_active(model, Focus::Picture);
    painter.panel(area, "", focused);
    let mut row = painter.edge(area, 0);
    for (text, loud) in chips(model).iter().rev() {
        let style = if *loud { theme.warn() } else { theme.dim() };
        // At least 12 columns remain for the file name.
        let fits = columns(text) + 15 <= row.left();
        let text = if fits { text } else { text.split(" · ").next().unwrap_or(text) };
        row.put_right(&format!(" {text} "), 13, style);
        row.put_right("─", 12, theme.border(focused));
    }
    let name = if focused { theme.accent() } else { theme.text() };
    let name = name.add_modifier(Modifier::BOLD);
    let unsaved = if model.is_unsaved() { 2 } else { 0 };
    let room = row.left().saturating_sub(2 + unsaved);
    row.put(" ", name).put(&cut(&title(model), room), name);
    if unsaved > 0 {
        row.put(" ●", theme.warn());
    }
    row.put(" ", name);
    if let Some(mode) = mode(model) {
        painter.edge(area, bottom).put(&format!(" {mode} "), theme.accent());
    }
    if let Some(legend) = legend {
        legend.draw(painter.edge(area, bottom));
    }
}

/// Returns the name of the scene's file, or that of a scene without a file.
fn title(model: &Model) -> String {
    let file = &model.file;
    match &file.path {
        _ if model.watch.is_some() => file.name.clone(),
        Some(_) if file.is_new => format!("{} (new)", file.name),
        Some(_) => file.name.clone(),
        None => format!("{} (no file)", file.name.trim_end_matches(".toml")),
    }
}

/// Returns the texts in the upper border: channel, exposure, tone curve and zoom, each unless
/// it is the default. A text with `true` is emphasised.
fn chips(model: &Model) -> Vec<(String, bool)> {
    let mut chips = Vec::new();
    let name = model.channel.name();
    match (model.channel, model.compared()) {
        (DisplayChannel::Beauty, _) => {}
        (channel, Some(picture)) if channel.compares() => {
            chips.push((format!("{name} · {}", picture.description()), true));
        }
        _ => chips.push((name.to_string(), true)),
    }
    let exposure = model.display.exposure_ev;
    if exposure != 0.0 {
        let sign = if exposure > 0.0 { "+" } else { "−" };
        chips.push((format!("{sign}{} EV", number(exposure.abs())), false));
    }
    match model.zoom.map(|zoom| zoom.steps) {
        None => {}
        Some(steps @ ..0) => chips.push((format!("zoom 1:{}", 1 << -steps), false)),
        Some(steps) => chips.push((format!("zoom {}:1", 1 << steps), false)),
    }
    if let Some(noise) = region_noise(model) {
        chips.push((format!("region {} levels · Alt-r ends it", number(noise)), true));
    }
    if model.display.tone != Tone::Clip {
        chips.push((model.display.tone.name().to_string(), false));
    }
    if model.free_view.is_some() {
        chips.push(("view, not the camera · H keeps it, h leaves it".to_string(), true));
    }
    chips
}

/// Returns the noise of the region that is rendered, in 8-bit levels.
fn region_noise(model: &Model) -> Option<f64> {
    let (region, tiles) = (model.region?, &model.snapshot.as_ref()?.tiles);
    let ends = [0, 1].map(|i| (region.origin[i] + region.size[i]).div_ceil(TILE));
    let rows = region.origin[1] / TILE..ends[1].min(tiles.rows);
    let numbers = rows.flat_map(|y| {
        (region.origin[0] / TILE..ends[0].min(tiles.columns)).map(move |x| y * tiles.columns + x)
    });
    let squares: Vec<_> = numbers
        .filter_map(|tile| Some(f64::from(*tiles.noise_levels.get(tile)?).powi(2)))
        .collect();
    Some((squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt())
}

/// Describes the mode; `None` in the default mode.
fn mode(model: &Model) -> Option<String> {
    let selected = || {
        let place = model.place_of_selection().map(|p| p.to_array().map(number).join(" "));
        let place = place.map_or(String::new(), |place| format!(" · {place}"));
        format!("{}{place}", model.selection.title(model.scene()))
    };
    Some(match model.mode {
        Mode::Orbit if !model.drag.is_some_and(|drag| drag.moves) => return None,
        Mode::Orbit | Mode::Move => format!("moving {}", selected()),
        Mode::Rotate => format!("rotating {}", selected()),
        Mode::Fly => "flying".to_string(),
        Mode::Probe => "probing".to_string(),
    })
}
