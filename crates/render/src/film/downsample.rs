//! Incremental downsampling of a window of the film to a smaller image, whose pixels are called
//! cells. Only tiles that have changed are read again.

use crate::film::TILE;
use crate::film::box_filter::{Coverage, coverage, fill_gaps};
use crate::film::detail::Window;
use crate::film::light_weights::{LightWeights, Replicates};
use crate::film::store::Film;
use crate::film::tile::Tile;
use rayon::prelude::*;

/// Film downsampled to a smaller image: the mean radiance of each cell in each light group. A
/// change of light weights needs no access to the film.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Thumbnail {
    /// Number of cells in a row.
    pub cols: usize,
    /// Number of rows of cells.
    pub rows: usize,
    /// Mean radiance of each cell for light weights of 1, `[row][column][group][channel]`.
    means: Vec<f32>,
    groups: usize,
}

impl Thumbnail {
    /// Averages `film` over `cols` x `rows` equal cells. The value of a cell is the mean of its
    /// sampled pixels, weighted by their areas inside the cell.
    ///
    /// A cell without samples gets the value of the nearest sampled cell of its row. A row without
    /// samples gets the values of the nearest sampled row. A film without samples is black.
    pub fn of_film(film: &Film, cols: usize, rows: usize) -> Self {
        let whole = Window::whole([film.header.width, film.header.height]);
        let mut downsample = IncrementalDownsample::new(film, whole, cols, rows);
        downsample.update(film, None);
        downsample.thumbnail()
    }

    /// Returns the radiance of each cell under the light weights `weights`, `[row][column]`.
    pub fn mixed(&self, weights: &LightWeights) -> Vec<[f32; 3]> {
        assert_eq!(weights.weights.len(), self.groups, "weights for the groups of the film");
        let weights: Vec<_> = weights.weights.iter().map(|w| w.map(|w| w as f32)).collect();
        let cell = |means: &[f32]| {
            let mut sum = [0.0; 3];
            for (mean, weight) in means.chunks_exact(3).zip(&weights) {
                (0..3).for_each(|c| sum[c] += mean[c] * weight[c]);
            }
            sum
        };
        self.means.chunks_exact(3 * self.groups).map(cell).collect()
    }
}

/// Cache of the contributions of a film's tiles to the cells of a smaller image.
pub struct IncrementalDownsample {
    layout: Layout,
    parts: Vec<TilePart>,
}

/// Geometry of a downsampling: `cols` x `rows` cells over `window` of a film of `size` pixels.
struct Layout {
    cols: usize,
    rows: usize,
    size: [usize; 2],
    window: Window,
    groups: usize,
    /// Cells that each column of tiles overlaps.
    across: Vec<Span>,
    /// Cells that each row of tiles overlaps.
    down: Vec<Span>,
}

/// Cells that one column or row of film tiles overlaps.
struct Span {
    first: usize,
    len: usize,
    /// For each pixel along the axis, the cells that overlap it: the cell's index, counted from
    /// `first`, and the fraction of the pixel that the cell covers.
    pixels: Vec<Vec<(usize, f64)>>,
}

/// Contribution of a film tile to the cells that it overlaps.
#[derive(Default)]
struct TilePart {
    /// Epoch of the film, and counts and lattice of the tile, at the latest refresh. `None` if the
    /// tile had no samples.
    version: Option<(u64, [u32; 2], usize)>,
    /// Sums for each cell, `[row][column][area, group 0 red, ...]`: the area of the sampled pixels
    /// inside the cell, then the area of each pixel times its mean radiance. Empty without samples.
    sums: Vec<f64>,
}

impl IncrementalDownsample {
    /// Creates the cache for `cols` x `rows` cells over `window` of an empty film of the size of
    /// `film`.
    pub fn new(film: &Film, window: Window, cols: usize, rows: usize) -> Self {
        let size = [film.header.width, film.header.height];
        let spans = |axis: usize, cells: usize| {
            let mut coverage = coverage(window.size[axis], cells);
            coverage.iter_mut().for_each(|cover| cover.first += window.origin[axis]);
            let pixels = size[axis];
            (0..pixels.div_ceil(TILE)).map(|t| Span::new(t * TILE, pixels, &coverage)).collect()
        };
        let layout = Layout {
            cols,
            rows,
            size,
            window,
            groups: film.groups(),
            across: spans(0, cols),
            down: spans(1, rows),
        };
        let parts = (0..film.tile_count()).map(|_| TilePart::default()).collect();
        Self { layout, parts }
    }

    /// Returns `true` if this cache is for `cols` x `rows` cells over `window` of a film like `film`.
    pub fn is_for(&self, film: &Film, window: Window, cols: usize, rows: usize) -> bool {
        let Layout { size, groups, .. } = self.layout;
        [self.layout.cols, self.layout.rows] == [cols, rows]
            && size == [film.header.width, film.header.height]
            && window == self.layout.window
            && groups == film.groups()
    }

    /// Reads the tiles that have changed since the previous call, on the threads of `pool` if there
    /// is one. Returns their number. All calls must pass the same film.
    pub fn update(&mut self, film: &Film, pool: Option<&rayon::ThreadPool>) -> usize {
        let layout = &self.layout;
        let mut stale: Vec<(usize, &mut TilePart)> = self.parts.iter_mut().enumerate().collect();
        stale.retain_mut(|(index, part)| {
            let version = film.tile(*index).map(|t| (film.epoch, t.counts, t.lattice_px));
            std::mem::replace(&mut part.version, version) != version
        });
        let changed = stale.len();
        let refresh = |(index, part): (usize, &mut TilePart)| part.refresh(layout, film, index);
        match pool.filter(|_| changed > 0) {
            Some(pool) => pool.install(|| stale.into_par_iter().for_each(refresh)),
            None => stale.into_iter().for_each(refresh),
        }
        changed
    }

    /// Returns the smaller image, from the cached contributions.
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
        fill_gaps(&mut means, &known, cols, rows, stride);
        Thumbnail { cols, rows, means, groups }
    }
}

impl Span {
    /// Finds the cells that one column or row of tiles, which begins at pixel `start`, overlaps
    /// along an axis of `pixels` pixels. `coverage` has the pixels of each cell along this axis.
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

impl TilePart {
    /// Reads the current samples of tile `index`.
    fn refresh(&mut self, layout: &Layout, film: &Film, index: usize) {
        let columns = film.tile_columns();
        let (across, down) = (&layout.across[index % columns], &layout.down[index / columns]);
        self.sums.clear();
        let Some(tile) = film.tile(index).filter(|tile| tile.any_sampled()) else { return };
        if across.len * down.len == 0 {
            return;
        }
        let cell = 1 + 3 * layout.groups;
        let width = across.len * cell;
        self.sums.resize(down.len * width, 0.0);
        let per_unit: Vec<f64> = film.header.scales.iter().flat_map(|s| [1.0 / s; 3]).collect();
        let mut line = vec![0.0; width];
        // In the first pass, only the pixels of the lattice have a sample.
        let step = if tile.counts == [0; 2] { tile.lattice_px } else { 1 };
        for (y, rows) in down.pixels.iter().enumerate().step_by(step) {
            line.fill(0.0);
            add_row(tile, y, step, across, &per_unit, &mut line);
            for (row, height) in rows {
                let sums = &mut self.sums[row * width..][..width];
                sums.iter_mut().zip(&line).for_each(|(sum, value)| *sum += height * value);
            }
        }
    }
}

/// Adds every `step`-th pixel in row `y` of a tile to `line`, the values of one row of cells, laid
/// out as in [`TilePart::sums`]. The values are not yet multiplied by the covered height.
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
    use crate::film::testing::{TestFilm, each_tile, fill, film, white};
    use crate::film::tile::lattice_pixels;
    use proptest::prelude::*;

    #[test]
    fn only_changed_tiles_are_refreshed_and_the_picture_is_that_of_a_new_raster() {
        let mut film = film(70, 40, &[1.0, 2.0]);
        let whole = Window::whole([70, 40]);
        let mut raster = IncrementalDownsample::new(&film, whole, 9, 7);
        let refresh = |raster: &mut IncrementalDownsample, film: &Film| {
            let count = raster.update(film, None);
            assert_eq!(raster.thumbnail(), Thumbnail::of_film(film, 9, 7));
            count
        };
        assert_eq!(refresh(&mut raster, &film), 0, "no samples yet");
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
        assert!(raster.is_for(&film, whole, 9, 7) && !raster.is_for(&film, whole, 7, 9));
        let part = Window { origin: [17, 9], size: [40, 30] };
        assert!(!raster.is_for(&film, part, 9, 7));
        let mut part = IncrementalDownsample::new(&film, part, 40, 30);
        part.update(&film, None);
        let (part, whole) = (part.thumbnail(), Thumbnail::of_film(&film, 70, 40));
        let (part, whole) = (part.mixed(&white(2)), whole.mixed(&white(2)));
        assert_eq!(part[40 * 20 + 30], whole[70 * (9 + 20) + 17 + 30]);
        assert_eq!(raster.thumbnail().mixed(&white(2)).len(), 63);
    }

    /// Returns the mean of each cell of the downsampled picture, computed for comparison from the
    /// overlap of every pixel with every cell.
    fn brute_force(film: &Film, cols: usize, rows: usize, mix: &LightWeights) -> Vec<[f64; 3]> {
        let (width, height) = (film.header.width, film.header.height);
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let values: Vec<[f64; 3]> = pixels.map(|(x, y)| film.pixel(x, y, mix)).collect();
        // Pixels that overlap a cell, each with the length of the overlap.
        let overlaps = |cell: usize, cells: usize, pixels: usize| -> Vec<(usize, f64)> {
            let edge = |c: usize| c as f64 * pixels as f64 / cells as f64;
            let overlap = |p: usize| edge(cell + 1).min((p + 1) as f64) - edge(cell).max(p as f64);
            (0..pixels).map(|p| (p, overlap(p))).filter(|(_, length)| *length > 0.0).collect()
        };
        let cell = |col, row| {
            let (mut sum, mut area) = ([0.0; 3], 0.0);
            for (y, tall) in overlaps(row, rows, height) {
                for (x, wide) in overlaps(col, cols, width) {
                    let value = values[y * width + x];
                    (0..3).for_each(|c| sum[c] += wide * tall * value[c]);
                    area += wide * tall;
                }
            }
            sum.map(|s| s / area)
        };
        (0..rows)
            .flat_map(|row| (0..cols).map(move |col| (col, row)))
            .map(|(c, r)| cell(c, r))
            .collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn cells_hold_area_weighted_means(
            width in 1usize..40, height in 1usize..40, cols in 1usize..50, rows in 1usize..50,
        ) {
            let mut film = film(width, height, &[1024.0, 1.0]);
            fill(&mut film, 2, |x, y, r| {
                let v = (x * 7 + y * 13 + r * 5) as f64;
                vec![v, v % 11.0, 1.0, v % 3.0, 2.0, v % 17.0]
            });
            let mix = LightWeights { weights: vec![[1.0, 0.5, 2.0], [0.0, 1.0, 0.25]] };
            let got = Thumbnail::of_film(&film, cols, rows).mixed(&mix);
            let expected = brute_force(&film, cols, rows, &mix);
            prop_assert_eq!(got.len(), expected.len());
            for (got, expected) in got.iter().zip(&expected) {
                for c in 0..3 {
                    let (got, expected) = (f64::from(got[c]), expected[c]);
                    prop_assert!((got - expected).abs() <= 1e-6 * expected.abs() + 1e-6);
                }
            }
        }
    }

    /// Adds the first sample, of value x + 100 y, to the pixels whose x and y are multiples of
    /// `step_px`. Pixels whose x and y are multiples of `before_px`, the step of the previous call,
    /// are left out. In the first call `before_px` is 0; no pixel is left out then.
    fn first_samples(film: &mut Film, before_px: usize, step_px: usize) {
        each_tile(film, |tile, [x0, y0]| {
            let [width, height] = tile.extent;
            for pixel in lattice_pixels(before_px, step_px) {
                let (x, y) = (pixel % TILE, pixel / TILE);
                if x < width && y < height {
                    tile.add(0, pixel, &[((x0 + x) + 100 * (y0 + y)) as i64; 3]);
                }
            }
            tile.set_lattice(step_px);
        });
    }

    #[test]
    fn first_lattice_fills_every_cell() {
        let mut film = film(32, 24, &[1.0]);
        let value = |film: &Film, cols: usize, rows: usize, col: usize, row: usize| {
            Thumbnail::of_film(film, cols, rows).mixed(&white(1))[row * cols + col][0]
        };
        assert_eq!(value(&film, 8, 6, 7, 5), 0.0);
        first_samples(&mut film, 0, 8);
        assert_eq!(film.samples(), 12);
        // Cells have 4x4 pixels, and samples are 8 pixels apart. In each direction, every second
        // cell therefore has a sample. The others take the value of a neighbour.
        for (col, row) in (0..6).flat_map(|row| (0..8).map(move |col| (col, row))) {
            let expected = (col / 2 * 8 + 100 * (row / 2 * 8)) as f32;
            assert_eq!(value(&film, 8, 6, col, row), expected, "{col} {row}");
        }
        // A single cell holds the mean of all samples.
        assert_eq!(value(&film, 1, 1, 0, 0), 12.0 + 800.0);
        first_samples(&mut film, 8, 2);
        assert_eq!(value(&film, 8, 6, 1, 1), 5.0 + 500.0);
        first_samples(&mut film, 2, 1);
        assert_eq!(film.samples(), 32 * 24);
        assert_eq!(value(&film, 32, 24, 31, 23), 31.0 + 2300.0);
    }

    #[test]
    fn rows_without_samples_take_the_nearest_row() {
        // The upper half of the film has samples. The lower half has none and gets the values of
        // the last row with samples.
        let mut film = film(32, 32, &[1.0]);
        for slot in film.slots(&[1, 0]) {
            let value = (slot.origin[0] / TILE) as i64 + 3;
            let tile = slot.prepare();
            (0..256).for_each(|p| tile.add(0, p, &[value; 3]));
            tile.advance(0, 1);
        }
        let picture = Thumbnail::of_film(&film, 4, 4).mixed(&white(1));
        for row in picture.chunks(4) {
            assert_eq!(row, [[3.0; 3], [3.0; 3], [4.0; 3], [4.0; 3]]);
        }
    }

    #[test]
    fn raster_without_cells_is_empty() {
        assert!(Thumbnail::of_film(&film(4, 4, &[1.0]), 0, 5).mixed(&white(1)).is_empty());
    }
}
