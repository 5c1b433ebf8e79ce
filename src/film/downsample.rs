//! Means of the film over the cells of a display, kept up to date tile by tile: a picture costs what
//! has changed since the last one, not what the film is large.

use crate::film::TILE;
use crate::film::box_filter::{Coverage, Thumbnail, coverage, fill_gaps};
use crate::film::film::Film;
use crate::film::light_weights::Replicates;
use crate::film::tile::Tile;

/// A raster of `cols` x `rows` cells that together cover a film. In each cell the mean of its sampled
/// pixels, weighted by the area that the cell covers of them.
pub struct IncrementalDownsample {
    layout: Layout,
    /// In the order of the film's tiles.
    parts: Vec<TilePart>,
}

/// How the film's pixels and the cells lie on each other.
struct Layout {
    cols: usize,
    rows: usize,
    size: [usize; 2],
    groups: usize,
    /// For each column of tiles and each row of tiles.
    across: Vec<Span>,
    down: Vec<Span>,
}

/// The cells that one column (row) of tiles lies on.
struct Span {
    /// The first cell.
    first: usize,
    /// Number of cells.
    len: usize,
    /// For each pixel, the cells that it lies on, counted from `first`, with the covered part of the
    /// pixel, 0..=1.
    pixels: Vec<Vec<(usize, f64)>>,
}

/// What a tile adds to the cells that it lies on.
#[derive(Default)]
struct TilePart {
    /// Epoch, counts and lattice of the tile when this was computed; equal ones mean equal contents.
    of: Option<(u64, [u32; 2], usize)>,
    /// `[row][column][area, group 0 red, ...]`: sums of area times mean; empty: nothing.
    sums: Vec<f64>,
}

/// A tile that has changed, to be taken in by [`DirtyTile::refresh`], on any thread.
pub struct DirtyTile<'a> {
    layout: &'a Layout,
    part: &'a mut TilePart,
    film: &'a Film,
    index: usize,
}

impl IncrementalDownsample {
    /// A raster for films like `film` (by size and groups); it has not seen any samples yet.
    pub fn new(film: &Film, cols: usize, rows: usize) -> Self {
        let size = [film.width(), film.height()];
        let spans = |pixels: usize, cells: usize| {
            let coverage = coverage(pixels, cells);
            (0..pixels.div_ceil(TILE)).map(|t| Span::new(t * TILE, pixels, &coverage)).collect()
        };
        let layout = Layout {
            cols,
            rows,
            size,
            groups: film.groups(),
            across: spans(size[0], cols),
            down: spans(size[1], rows),
        };
        let parts = (0..film.tile_count()).map(|_| TilePart::default()).collect();
        Self { layout, parts }
    }

    /// Whether this is a raster of `cols` x `rows` cells for films like `film`.
    pub fn is_for(&self, film: &Film, cols: usize, rows: usize) -> bool {
        let Layout { size, groups, .. } = self.layout;
        [self.layout.cols, self.layout.rows] == [cols, rows]
            && size == [film.width(), film.height()]
            && groups == film.groups()
    }

    /// The tiles that have changed since they were last refreshed. Always call this with the same
    /// film, which may have been restarted.
    pub fn stale<'a>(&'a mut self, film: &'a Film) -> Vec<DirtyTile<'a>> {
        let layout = &self.layout;
        let stale = |(index, part): (usize, &'a mut TilePart)| {
            let of = film.tile(index).map(|t| (film.epoch(), t.counts(), t.lattice_px()));
            let changed = of != part.of;
            part.of = of;
            changed.then_some(DirtyTile { layout, part, film, index })
        };
        self.parts.iter_mut().enumerate().filter_map(stale).collect()
    }

    /// The means. A cell without samples looks like the nearest one of its row that has some, a row
    /// without samples like the nearest row; without any samples all is black.
    pub fn thumbnail(&self) -> Thumbnail {
        let Layout { cols, rows, groups, .. } = self.layout;
        let stride = 3 * groups;
        let mut sums = vec![0.0f64; cols * rows * (stride + 1)];
        for (down, row) in self.layout.down.iter().zip(self.parts.chunks(self.layout.across.len()))
        {
            for (across, part) in self.layout.across.iter().zip(row) {
                let width = across.len * (stride + 1);
                for (y, line) in part.sums.chunks_exact(width.max(1)).enumerate() {
                    let start = ((down.first + y) * cols + across.first) * (stride + 1);
                    let cells = &mut sums[start..start + width];
                    cells.iter_mut().zip(line).for_each(|(sum, value)| *sum += value);
                }
            }
        }
        let mut means = Vec::with_capacity(cols * rows * stride);
        let mut known = Vec::with_capacity(cols * rows);
        for cell in sums.chunks_exact(stride + 1) {
            let area = cell[0];
            known.push(area > 0.0);
            let mean = |sum: &f64| if area > 0.0 { (sum / area) as f32 } else { 0.0 };
            means.extend(cell[1..].iter().map(mean));
        }
        fill_gaps(&mut means, &mut known, cols, rows, stride);
        Thumbnail::new([cols, rows], means, groups)
    }
}

impl Span {
    /// Of the tile that begins at pixel `start` of `pixels`.
    fn new(start: usize, pixels: usize, coverage: &[Coverage]) -> Self {
        let end = (start + TILE).min(pixels);
        let touched =
            |cover: &Coverage| cover.first < end && cover.first + cover.parts.len() > start;
        let first = coverage.iter().position(touched).unwrap_or(0);
        let len = coverage[first.min(coverage.len())..].iter().take_while(|c| touched(c)).count();
        let cells_of = |pixel: usize| {
            let part = |i: usize| {
                let cover = &coverage[first + i];
                let part = *cover.parts.get(pixel.checked_sub(cover.first)?)?;
                (part > 0.0).then_some((i, part))
            };
            (0..len).filter_map(part).collect()
        };
        Self { first, len, pixels: (start..end).map(cells_of).collect() }
    }
}

impl DirtyTile<'_> {
    /// Takes in the tile as it is now.
    pub fn refresh(self) {
        let Self { layout, part, film, index } = self;
        let columns = film.tile_columns();
        let (across, down) = (&layout.across[index % columns], &layout.down[index / columns]);
        part.sums.clear();
        let Some(tile) = film.tile(index).filter(|tile| tile.any_sampled()) else { return };
        let cell = 1 + 3 * layout.groups;
        let width = across.len * cell;
        part.sums.resize(down.len * width, 0.0);
        let per_unit: Vec<f64> = film.scales().iter().flat_map(|s| [1.0 / s; 3]).collect();
        let mut line = vec![0.0; width];
        // Of a first sample on a lattice only the lattice has to be looked at.
        let step = if tile.counts() == [0; 2] { tile.lattice_px() } else { 1 };
        for (y, rows) in down.pixels.iter().enumerate().step_by(step) {
            line.fill(0.0);
            add_row(tile, y, step, across, &per_unit, &mut line);
            for (row, height) in rows {
                let sums = &mut part.sums[row * width..][..width];
                sums.iter_mut().zip(&line).for_each(|(sum, value)| *sum += height * value);
            }
        }
    }
}

/// Adds every `step`-th pixel of row `y` of a tile to a row of cells, as if they were of height 1.
fn add_row(tile: &Tile, y: usize, step: usize, across: &Span, per_unit: &[f64], line: &mut [f64]) {
    let cell = 1 + per_unit.len();
    for (x, columns) in across.pixels.iter().enumerate().step_by(step) {
        let sums = tile.sums(y * TILE + x);
        let count = sums.count(Replicates::Both);
        if count == 0 {
            continue;
        }
        let per_sample = 1.0 / f64::from(count);
        let [a, b] = sums.values;
        for (column, width) in columns {
            let sums = &mut line[column * cell..][..cell];
            sums[0] += width;
            let factor = width * per_sample;
            for (((sum, a), b), per_unit) in sums[1..].iter_mut().zip(a).zip(b).zip(per_unit) {
                *sum += (*a as f64 + *b as f64) * (per_unit * factor);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::testing::{each_tile, fill, film, white};

    /// Whatever was taken in when: the picture is that of a new raster.
    #[test]
    fn only_what_has_changed_is_read_again() {
        let mut film = film(70, 40, &[1.0, 2.0]);
        let mut raster = IncrementalDownsample::new(&film, 9, 7);
        let refresh = |raster: &mut IncrementalDownsample, film: &Film| {
            let stale = raster.stale(film);
            let count = stale.len();
            stale.into_iter().for_each(DirtyTile::refresh);
            assert_eq!(raster.thumbnail(), film.thumbnail(9, 7));
            count
        };
        assert_eq!(refresh(&mut raster, &film), 0, "nothing is there");
        fill(&mut film, 2, |x, y, r| vec![(x * 3 + y + r) as f64; 6]);
        assert_eq!(refresh(&mut raster, &film), 15);
        assert_eq!(refresh(&mut raster, &film), 0);
        for slot in film.slots(&[3, 14]) {
            let tile = slot.prepare();
            tile.add(1, 17, &[500; 6]);
            tile.advance(1, 1);
        }
        assert_eq!(refresh(&mut raster, &film), 2);
        film.restart();
        assert_eq!(refresh(&mut raster, &film), 15);
        each_tile(&mut film, |tile, _| {
            tile.add(0, 0, &[7; 6]);
            tile.set_lattice(8);
        });
        assert_eq!(refresh(&mut raster, &film), 15);
        assert!(raster.is_for(&film, 9, 7) && !raster.is_for(&film, 7, 9));
        assert_eq!(raster.thumbnail().mixed(&white(2)).len(), 63);
    }
}
