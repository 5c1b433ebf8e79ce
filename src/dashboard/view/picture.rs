//! Conversion of snapshots to rasters of half cells, and drawing of the picture's cells.

use crate::dashboard::message::DisplayChannel;
use crate::dashboard::model::{CompareView, Model};
use crate::dashboard::overlay::Overlay;
use crate::dashboard::view::legend::Legend;
use crate::film::{Display, LinearImage, TILE};
use crate::render::session::{Snapshot, State};
use crate::terminal::Area;
use crate::terminal::cells::{
    CellColor, PictureCell, PictureCells, Raster, Scale, depth, difference, normals, objects,
};
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use std::sync::Arc;

/// Converter of models to rasters. It caches the resampled pinned picture.
#[derive(Debug, Default)]
pub struct PictureView {
    legend: Option<Legend>,
    pinned: Option<PinnedCache>,
}

/// The pinned picture, resampled to the size of the raster.
#[derive(Debug)]
struct PinnedCache {
    /// Picture at its own resolution.
    picture: Arc<LinearImage>,
    /// Width and height of the raster.
    size: [usize; 2],
    /// Linear radiance of each half cell, row-major.
    radiance: Vec<[f32; 3]>,
}

/// Returns `true` if the picture changes only by user input, or rarely: rendering has ended or is
/// paused, files are watched, or the pinned picture or an exported image is visible.
pub fn is_settled(model: &Model) -> bool {
    if let Some(Overlay::ViewerImage(_)) = model.overlay {
        return true;
    }
    let resting = |s: &Snapshot| matches!(s.report.state, State::Finished(_) | State::Paused);
    model.watch.is_some()
        || model.snapshot.as_ref().is_some_and(|s| resting(s))
        || model.comparison.shown == CompareView::Pinned
}

impl PictureView {
    /// Returns the legend of the last raster. Returns `None` if the raster has no colour scale.
    pub fn legend(&self) -> Option<&Legend> {
        self.legend.as_ref()
    }

    /// Returns a raster of `size` (width and height in half cells) that shows the selected channel
    /// or comparison. The raster is empty if the data is missing.
    pub fn raster(&mut self, model: &Model, size: [usize; 2]) -> Raster {
        self.legend = None;
        let raster = match (model.comparison.shown, model.channel) {
            (CompareView::Pinned, _) => {
                self.pinned(model, size).map(|pinned| displayed(pinned, &model.display, size))
            }
            (CompareView::Difference, _) => self.difference(model, size),
            (CompareView::Live, channel) => self.live(model, channel, size),
        };
        raster.unwrap_or_default()
    }

    fn live(&mut self, model: &Model, channel: DisplayChannel, size: [usize; 2]) -> Option<Raster> {
        let snapshot = model.snapshot.as_deref()?;
        match channel {
            DisplayChannel::Beauty => {
                let (radiance, from) = live_radiance(model, snapshot)?;
                Some(resized(displayed(&radiance, &model.display, from), size))
            }
            DisplayChannel::Noise => {
                let noise = &snapshot.tiles.noise_codes;
                self.tiles(model, snapshot, "8-bit levels of noise", size, |i| {
                    noise.get(i).map(|n| f64::from(*n))
                })
            }
            DisplayChannel::Samples => {
                let spp = &snapshot.tiles.spp;
                self.tiles(model, snapshot, "samples per pixel", size, |i| {
                    spp.get(i).map(|n| f64::from(*n))
                })
            }
            DisplayChannel::Objects | DisplayChannel::Normals | DisplayChannel::Depth => {
                let buffer = snapshot.first_hits.as_deref()?;
                let (columns, rows, texels) = (buffer.columns, buffer.rows, buffer.texels());
                let hit = |i: usize| texels.get(i).filter(|s| s.object.is_some());
                let all = columns * rows;
                let raster = match channel {
                    DisplayChannel::Objects => {
                        let ids: Vec<_> = (0..all).map(|i| hit(i).and_then(|s| s.object)).collect();
                        objects(columns, rows, &ids)
                    }
                    DisplayChannel::Normals => {
                        let found: Vec<_> = (0..all).map(|i| hit(i).map(|s| s.normal)).collect();
                        normals(columns, rows, &found)
                    }
                    _ => {
                        let found: Vec<_> = (0..all).map(|i| hit(i).map(|s| s.depth)).collect();
                        let (raster, scale) = depth(columns, rows, &found);
                        self.legend = Some(Legend::magnitude(scale, "from the eye"));
                        raster
                    }
                };
                Some(resized(raster, size))
            }
        }
    }

    /// Returns a raster that shows one value per tile in false colour, on a logarithmic scale.
    /// `value` returns the value of the tile with a given index.
    fn tiles(
        &mut self,
        model: &Model,
        snapshot: &Snapshot,
        unit: &'static str,
        [width, height]: [usize; 2],
        value: impl Fn(usize) -> Option<f64>,
    ) -> Option<Raster> {
        let tiles = &snapshot.tiles;
        let all = tiles.columns * tiles.rows;
        let values: Vec<f64> = (0..all).map(&value).collect::<Option<_>>()?;
        let mut scale = Scale::logarithmic(values.iter().copied());
        // The scale spans at most a factor of 1000.
        scale.low = scale.low.max(1e-3 * scale.high);
        self.legend = Some(Legend::magnitude(scale, unit));
        let film = model.scene().film.size.map(|n| n as usize);
        let tile = |at: usize, cells: usize, pixels: usize, tiles: usize| {
            ((2 * at + 1) * pixels / (2 * cells) / TILE).min(tiles.saturating_sub(1))
        };
        (all > 0).then(|| {
            Raster::from_fn(width, height, |i| {
                let column = tile(i % width, width, film[0], tiles.columns);
                let row = tile(i / width, height, film[1], tiles.rows);
                scale.color(values[row * tiles.columns + column])
            })
        })
    }

    fn pinned(&mut self, model: &Model, size: [usize; 2]) -> Option<&[[f32; 3]]> {
        let (picture, _) = model.comparison.pinned.as_ref()?;
        let same =
            |cached: &PinnedCache| Arc::ptr_eq(&cached.picture, picture) && cached.size == size;
        if !self.pinned.as_ref().is_some_and(same) {
            let radiance = picture.resampled(size[0], size[1]);
            self.pinned = Some(PinnedCache { picture: Arc::clone(picture), size, radiance });
        }
        self.pinned.as_ref().map(|cached| &*cached.radiance)
    }

    /// Returns a false-colour raster of the difference in luma, live minus pinned, in 8-bit levels.
    /// The scale ends at the largest absolute difference, rounded up.
    fn difference(&mut self, model: &Model, size: [usize; 2]) -> Option<Raster> {
        let snapshot = model.snapshot.as_deref()?;
        let (live, from) = live_radiance(model, snapshot)?;
        let live = resized(displayed(&live, &model.display, from), size);
        let pinned = displayed(self.pinned(model, size)?, &model.display, size);
        let (mut squares, mut largest) = (0.0, 0.0f64);
        let mut lumas = Vec::with_capacity(live.pixels.len());
        for (live, pinned) in live.pixels.iter().zip(&pinned.pixels) {
            let change = [0, 1, 2].map(|c| f64::from(live[c]) - f64::from(pinned[c]));
            squares +=
                (change[0] * change[0] + change[1] * change[1] + change[2] * change[2]) / 3.0;
            // Luma weights of Rec. 709.
            let luma = 0.2126 * change[0] + 0.7152 * change[1] + 0.0722 * change[2];
            largest = largest.max(luma.abs());
            lumas.push(luma);
        }
        let rms = (squares / lumas.len().max(1) as f64).sqrt();
        let end = round_up(largest.max(1.0));
        self.legend = Some(Legend::difference(end, rms));
        Some(Raster::from_fn(size[0], size[1], |i| difference(lumas[i] / end)))
    }
}

/// Rounds `value` up to one of 1, 2, 5, 10, 20, 50, …
fn round_up(value: f64) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|m| m * decade).find(|v| *v >= value).unwrap_or(10.0 * decade)
}

/// Returns the linear radiance of the snapshot's picture, mixed from its light groups with the
/// current lights, and the width and height of the picture.
fn live_radiance(model: &Model, snapshot: &Snapshot) -> Option<(Vec<[f32; 3]>, [usize; 2])> {
    let picture = snapshot.picture.as_ref()?;
    let newest = snapshot.mix_for(model.scene());
    let mixed = picture.mixed(newest.as_ref().unwrap_or(&snapshot.mix));
    Some((mixed, [picture.cols, picture.rows]))
}

/// Applies the display transform to linear radiance.
fn displayed(radiance: &[[f32; 3]], display: &Display, [width, height]: [usize; 2]) -> Raster {
    let to_8 = display.to_8();
    Raster::from_fn(width, height, |i| to_8(radiance[i].map(f64::from)))
}

/// Scales a raster to the given size without interpolation. After a resize it is applied to the old
/// picture until the next snapshot.
fn resized(raster: Raster, [width, height]: [usize; 2]) -> Raster {
    if [raster.width, raster.height] == [width, height] || raster.pixels.is_empty() {
        return raster;
    }
    Raster::from_fn(width, height, |i| {
        let (x, y) = (i % width * raster.width / width, i / width * raster.height / height);
        raster.pixels[y * raster.width + x]
    })
}

/// Draws `cells` into `area` from its upper left corner. Cells outside of `area` are omitted.
pub fn paint(cells: &PictureCells, area: Area, buffer: &mut Buffer) {
    for row in 0..area.height.min(cells.rows) {
        for column in 0..area.width.min(cells.columns) {
            let Some(cell) = cells.cell(column, row) else { continue };
            if let Some(to) = buffer.cell_mut((area.x + column, area.y + row)) {
                let [fg, bg] = colors(cell);
                to.set_char(cell.glyph);
                to.set_style(Style::new().fg(fg).bg(bg));
            }
        }
    }
}

/// Returns the rectangle of the screen that [`paint`] drew `cells` into, and a row-major mask of
/// the cells that still show the picture because nothing was drawn over them.
pub fn visible_mask(cells: &PictureCells, area: Area, buffer: &Buffer) -> (Rect, Vec<bool>) {
    let Area { x, y, width, height } = area;
    let (width, height) = (width.min(cells.columns), height.min(cells.rows));
    let place = Rect { x, y, width, height }.intersection(buffer.area);
    let visible_mask = place.positions().map(|at| {
        let (Some(cell), now) = (cells.cell(at.x - x, at.y - y), &buffer[at]) else {
            return false;
        };
        let same_glyph = now.symbol().chars().eq([cell.glyph]);
        same_glyph && [now.fg, now.bg] == colors(cell) && now.modifier.is_empty()
    });
    (place, visible_mask.collect())
}

fn colors(cell: &PictureCell) -> [Color; 2] {
    [cell.fg, cell.bg].map(|ink| match ink {
        CellColor::Plain => Color::Reset,
        CellColor::Rgb([r, g, b]) => Color::Rgb(r, g, b),
        CellColor::Indexed(index) => Color::Indexed(index),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_end_at_round_numbers() {
        assert_eq!(
            [1.0, 1.5, 4.0, 9.0, 30.0, 255.0].map(round_up),
            [1.0, 2.0, 5.0, 10.0, 50.0, 500.0]
        );
    }

    #[test]
    fn old_pictures_are_stretched() {
        let old = Raster::from_fn(2, 1, |i| [i as u8; 3]);
        let new = resized(old, [4, 2]);
        let reds: Vec<_> = new.pixels.iter().map(|p| p[0]).collect();
        assert_eq!(reds, [0, 0, 1, 1, 0, 0, 1, 1]);
        assert_eq!(resized(Raster::default(), [4, 2]), Raster::default());
    }

    #[test]
    fn display_matches_film_exposure_and_tone_curve() {
        let display = Display { exposure_ev: 1.25, ..Display::default() };
        let radiance = [[0.01, 0.2, 3.0], [0.5, 0.0, 0.1]];
        let raster = displayed(&radiance, &display, [2, 1]);
        for (pixel, radiance) in raster.pixels.iter().zip(radiance) {
            assert_eq!(*pixel, display.codes_8(radiance.map(f64::from)));
        }
    }
}
