//! Conversion of snapshots to rasters, and drawing of the picture's cells.

use crate::dashboard::view::false_color::{NO_HIT, Scale, difference, normal_color, object_color};
use crate::dashboard::view::histogram::Histogram;
use crate::dashboard::view::legend::Legend;
use crate::dashboard::view::marks;
use crate::dashboard::{DisplayChannel, Layout, Model, Overlay};
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use std::cmp::Ordering;
use std::sync::Arc;
use zerkalo_render::film::{Display, LinearImage, TILE, Window};
use zerkalo_render::session::{Snapshot, State};
use zerkalo_terminal::cells::Raster;
use zerkalo_world::FirstHit;

/// Columns and rows of texels, and the window of the film that they show.
type Place = ([usize; 2], Window);

/// Converter of the model to rasters, images in the texels of cells.
#[derive(Debug, Default)]
pub struct PictureView {
    /// Legend of the last raster; `None` if it needs none.
    pub legend: Option<Legend>,
    /// Histogram of the last raster if it is visible.
    pub histogram: Option<Histogram>,
    pinned: Option<PinnedCache>,
}

/// Pinned picture at the size on the screen.
#[derive(Debug)]
struct PinnedCache {
    picture: Arc<LinearImage>,
    size: Place,
    radiance: Vec<[f32; 3]>,
}

/// Returns `true` if the picture changes rarely or only by user input: if the render rests, films
/// are watched, or the pinned picture or an exported image is visible.
pub fn is_settled(model: &Model) -> bool {
    if let Some(Overlay::ViewerImage(_)) = model.overlay {
        return true;
    }
    let resting = |s: &Snapshot| matches!(s.report.state, State::Finished(_) | State::Paused);
    model.watch.is_some()
        || model.snapshot.as_ref().is_some_and(|s| resting(s))
        || model.channel == DisplayChannel::Pinned
}

impl PictureView {
    /// Returns the selected channel in the texels of `layout`, with outlines. Returns
    /// `None` if the channel's data are missing.
    pub fn raster(&mut self, model: &Model, layout: &Layout) -> Option<Raster> {
        let size = (layout.texels, layout.window);
        let mut raster = self.channel(model, size)?;
        let snapshot = model.snapshot.as_deref().filter(|_| model.histogram);
        let live = snapshot.and_then(|snapshot| beauty(model, snapshot, size));
        self.histogram = live.map(|live| Histogram::of(&live));
        for (mask, window) in model.outlined() {
            marks::outline(&mut raster, &resized(mask, window, size));
        }
        Some(raster)
    }

    /// Returns the selected channel in `size`, or `None` if its data are missing.
    fn channel(&mut self, model: &Model, size: Place) -> Option<Raster> {
        self.legend = None;
        let snapshot = model.snapshot.as_deref()?;
        match model.channel {
            DisplayChannel::Beauty => beauty(model, snapshot, size),
            DisplayChannel::Noise => {
                let noise = &snapshot.tiles.noise_levels;
                self.tiles(snapshot, "8-bit levels of noise", size, noise)
            }
            DisplayChannel::Samples => {
                self.tiles(snapshot, "samples per pixel", size, &snapshot.tiles.spp)
            }
            DisplayChannel::Objects => {
                hit_colors(snapshot, size, |hit| hit.object.map_or(NO_HIT, object_color))
            }
            DisplayChannel::Normals => hit_colors(snapshot, size, |hit| normal_color(hit.normal)),
            DisplayChannel::Depth => {
                let hits = snapshot.first_hits.as_deref()?.texels.iter();
                let depths = hits.filter(|hit| hit.object.is_some()).map(|hit| hit.depth.into());
                let scale = Scale { reversed: true, ..Scale::logarithmic(depths) };
                self.legend = Some(Legend::magnitude(scale, "from the eye"));
                hit_colors(snapshot, size, |hit| scale.color(hit.depth.into()))
            }
            DisplayChannel::Pinned => self.pinned(model, size),
            DisplayChannel::Difference => self.difference(model, snapshot, size),
            DisplayChannel::SideBySide => {
                let [live, pinned] = [beauty(model, snapshot, size)?, self.pinned(model, size)?];
                Some(side_by_side(&pinned, &live))
            }
            DisplayChannel::Wipe => {
                let [live, pinned] = [beauty(model, snapshot, size)?, self.pinned(model, size)?];
                let [width, height] = size.0;
                let border = ((0.5 + model.pictures.border) * width as f64) as usize;
                let border = border.min(width.saturating_sub(1));
                Some(Raster::from_fn(width, height, |i| match (i % width).cmp(&border) {
                    Ordering::Less => pinned.pixels[i],
                    Ordering::Equal => [255; 3],
                    Ordering::Greater => live.pixels[i],
                }))
            }
        }
    }

    /// Returns a raster of one value for each tile of the film, in false colour on a logarithmic
    /// scale. `values` has the tiles row by row.
    fn tiles<T: Copy + Into<f64>>(
        &mut self,
        snapshot: &Snapshot,
        unit: &'static str,
        ([width, height], window): Place,
        values: &[T],
    ) -> Option<Raster> {
        let tiles = &snapshot.tiles;
        let all = tiles.columns * tiles.rows;
        let values: Vec<f64> = values.get(..all)?.iter().map(|value| (*value).into()).collect();
        let mut scale = Scale::logarithmic(values.iter().copied());
        // The scale spans at most a factor of 1000.
        scale.low = scale.low.max(1e-3 * scale.high);
        self.legend = Some(Legend::magnitude(scale, unit));
        let tile = |axis: usize, at: usize, cells: usize, tiles: usize| {
            (window.pixel(axis, at, cells) / TILE).min(tiles.saturating_sub(1))
        };
        (all > 0).then(|| {
            Raster::from_fn(width, height, |i| {
                let column = tile(0, i % width, width, tiles.columns);
                let row = tile(1, i / width, height, tiles.rows);
                scale.color(values[row * tiles.columns + column])
            })
        })
    }

    fn pinned(&mut self, model: &Model, size: Place) -> Option<Raster> {
        let picture = &model.compared()?.image;
        let same =
            |cached: &PinnedCache| Arc::ptr_eq(&cached.picture, picture) && cached.size == size;
        if !self.pinned.as_ref().is_some_and(same) {
            // A picture of another size shows the same part.
            let film = model.scene().film.size.map(|n| n.max(1) as usize);
            let scaled = |n: [usize; 2]| [0, 1].map(|i| n[i] * picture.size[i] / film[i]);
            let ([cols, rows], Window { origin, size: pixels }) = size;
            let window = Window { origin: scaled(origin), size: scaled(pixels) };
            let radiance = picture.resampled(window, cols, rows);
            self.pinned = Some(PinnedCache { picture: Arc::clone(picture), size, radiance });
        }
        self.pinned.as_ref().map(|cached| displayed(&cached.radiance, &model.display, size.0))
    }

    /// Returns a raster of the difference in luma, live minus pinned, in false colour. The scale
    /// ends at the 99 % quantile of the differences, rounded up by [`round_up`].
    fn difference(&mut self, model: &Model, snapshot: &Snapshot, size: Place) -> Option<Raster> {
        let live = beauty(model, snapshot, size)?;
        let pinned = self.pinned(model, size)?;
        let mut squares = 0.0;
        let mut lumas = Vec::with_capacity(live.pixels.len());
        for (live, pinned) in live.pixels.iter().zip(&pinned.pixels) {
            let change = [0, 1, 2].map(|c| f64::from(live[c]) - f64::from(pinned[c]));
            squares +=
                (change[0] * change[0] + change[1] * change[1] + change[2] * change[2]) / 3.0;
            // Luma weights of Rec. 709.
            let luma = 0.2126 * change[0] + 0.7152 * change[1] + 0.0722 * change[2];
            lumas.push(luma);
        }
        let rms = (squares / lumas.len().max(1) as f64).sqrt();
        let mut sizes: Vec<f64> = lumas.iter().map(|luma| luma.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        // A few bright pixels, such as the edge of a lamp, do not darken the rest.
        let quantile = sizes.get(sizes.len() * 99 / 100).copied().unwrap_or(0.0);
        let end = round_up(quantile.max(1.0));
        self.legend = Some(Legend::difference(end, rms));
        let [columns, rows] = size.0;
        Some(Raster::from_fn(columns, rows, |i| difference(lumas[i] / end)))
    }
}

/// Rounds up to one of 1, 2, 5, 10, 20, 50, …
fn round_up(value: f64) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|m| m * decade).find(|v| *v >= value).unwrap_or(10.0 * decade)
}

/// Returns two pictures beside each other in half their size.
fn side_by_side(left: &Raster, right: &Raster) -> Raster {
    let (width, height) = (left.width, left.height);
    let half = [(width / 2).max(1), height / 2];
    Raster::from_fn(width, height, |i| {
        let (x, y) = (i % width, (i / width).wrapping_sub((height - half[1]) / 2));
        if y >= half[1] || x / half[0] > 1 {
            return [0; 3];
        }
        let picture = if x < half[0] { left } else { right };
        let first = 2 * y * width + x % half[0] * 2;
        let four =
            [0, 1, width, width + 1].map(|n| picture.pixels[(first + n).min(width * height - 1)]);
        [0, 1, 2].map(|c| (four.iter().map(|rgb| u32::from(rgb[c])).sum::<u32>() / 4) as u8)
    })
}

/// Returns the latest picture, with the present weights of the light groups.
fn beauty(model: &Model, snapshot: &Snapshot, size: Place) -> Option<Raster> {
    let picture = snapshot.picture.as_ref()?;
    let newest = snapshot.weights_for(model.seen());
    let radiance = picture.mixed(newest.as_ref().unwrap_or(&snapshot.weights));
    let live = displayed(&radiance, &model.display, [picture.cols, picture.rows]);
    Some(resized(live, snapshot.window, size))
}

/// Returns a raster of the first hits in the colours that `color` returns. Rays without a hit have
/// the colour [`NO_HIT`].
fn hit_colors(
    snapshot: &Snapshot,
    size: Place,
    color: impl Fn(&FirstHit) -> [u8; 3],
) -> Option<Raster> {
    let hits = snapshot.first_hits.as_deref()?;
    let pixel = |i: usize| match &hits.texels[i] {
        hit if hit.object.is_some() => color(hit),
        _ => NO_HIT,
    };
    Some(resized(Raster::from_fn(hits.columns, hits.rows, pixel), hits.window, size))
}

fn displayed(radiance: &[[f32; 3]], display: &Display, [width, height]: [usize; 2]) -> Raster {
    let to_8 = display.to_8();
    Raster::from_fn(width, height, |i| to_8(radiance[i].map(f64::from)))
}

/// Scales an image of the window `from` of the film to `place` without interpolation. Until the
/// session returns an image of `place`, the image at hand is shown, whose edge continues outside.
fn resized(raster: Raster, from: Window, (size, window): Place) -> Raster {
    let old = [raster.width, raster.height];
    if (old, from) == (size, window) || raster.pixels.is_empty() {
        return raster;
    }
    let texel = |axis: usize, at: usize| {
        let pixel = window.pixel(axis, at, size[axis]).saturating_sub(from.origin[axis]);
        (pixel * old[axis] / from.size[axis].max(1)).min(old[axis] - 1)
    };
    Raster::from_fn(size[0], size[1], |i| {
        raster.pixels[texel(1, i / size[0]) * old[0] + texel(0, i % size[0])]
    })
}

/// Draws `cells` into `area` from its upper left corner.
pub fn paint(cells: &Buffer, area: Rect, buffer: &mut Buffer) {
    for at in area.intersection(buffer.area).positions() {
        if let Some(cell) = cells.cell((at.x - area.x, at.y - area.y)) {
            buffer[at] = cell.clone();
        }
    }
}

/// Returns the rectangle into which [`paint`] drew `cells`, and a row-major mask that is `true`
/// where nothing was drawn over them.
pub fn visible_mask(cells: &Buffer, area: Rect, buffer: &Buffer) -> (Rect, Vec<bool>) {
    let Rect { x, y, width, height } = area;
    let (width, height) = (width.min(cells.area.width), height.min(cells.area.height));
    let place = Rect { x, y, width, height }.intersection(buffer.area);
    let mask = place.positions().map(|at| buffer[at] == cells[(at.x - x, at.y - y)]);
    (place, mask.collect())
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
        let film = Window::whole([100, 50]);
        let new = resized(old.clone(), film, ([4, 2], film));
        let reds = |raster: Raster| raster.pixels.iter().map(|p| p[0]).collect::<Vec<_>>();
        assert_eq!(reds(new), [0, 0, 1, 1, 0, 0, 1, 1]);
        let part = Window { origin: [40, 0], size: [20, 10] };
        assert_eq!(reds(resized(old, film, ([4, 1], part))), [0, 0, 1, 1]);
        assert_eq!(resized(Raster::default(), film, ([4, 2], film)), Raster::default());
    }

    #[test]
    fn display_matches_film_exposure_and_tone_curve() {
        let display = Display { exposure_ev: 1.25, ..Display::default() };
        let radiance = [[0.01, 0.2, 3.0], [0.5, 0.0, 0.1]];
        let raster = displayed(&radiance, &display, [2, 1]);
        for (pixel, radiance) in raster.pixels.iter().zip(radiance) {
            assert_eq!(*pixel, display.to_8()(radiance.map(f64::from)));
        }
    }
}
