//! Film: storage of samples as tiles of integer sums. After a restart, such as by an edit, a tile
//! is cleared only when it is next written.

use crate::film::TILE;
use crate::film::display::Display;
use crate::film::light_weights::{LightWeights, Replicates, Sums};
use crate::film::noise::{Estimator, Noise};
use crate::film::tile::{MAX_FILM_GROUPS, Tile};
use std::collections::TryReserveError;
use std::ops::Range;
use zerkalo_world::Precision;

/// Least size, in bytes, of a film whose tiles are all allocated before the first sample.
const RESERVED_FROM: u64 = 64 << 20;

/// Properties of a film. Only films with equal properties can be added.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Width of the film in pixels, at least 1.
    pub width: usize,
    /// Height of the film in pixels, at least 1.
    pub height: usize,
    /// Scale of each light group: samples are multiplied by it before they are rounded to integers.
    /// It is a power of two, so that the product is exact.
    pub scales: Vec<f64>,
    /// Random seed of all samples.
    pub seed: u64,
    /// Floating-point precision of the samples, single or double.
    pub precision: Precision,
}

impl Header {
    /// Returns `true` if `scale` is a power of two and a normal number.
    pub(super) fn is_valid_scale(scale: f64) -> bool {
        scale.is_normal() && scale > 0.0 && scale.to_bits() << 12 == 0
    }

    /// Returns the number of tiles.
    pub(crate) fn tiles(&self) -> usize {
        self.width.div_ceil(TILE) * self.height.div_ceil(TILE)
    }

    /// Returns width and height of the part of a tile that is inside the picture.
    pub(crate) fn extent(&self, tile: usize) -> [usize; 2] {
        let columns = self.width.div_ceil(TILE);
        let [x, y] = [tile % columns * TILE, tile / columns * TILE];
        [(self.width - x).min(TILE), (self.height - y).min(TILE)]
    }

    /// Returns width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height].map(|n| n as u32)
    }
}

/// Integer sums of samples for every pixel, light group, channel and replicate. The radiance of a
/// pixel in a light group is its sum divided by the group's scale and by the number of samples.
#[derive(Debug)]
pub struct Film {
    pub header: Header,
    /// Row of the picture in which the film begins, a multiple of [`TILE`].
    pub first_row: usize,
    /// Counter of restarts. The contents of a tile are unchanged as long as the epoch,
    /// [`Tile::counts`] and [`Tile::lattice_px`] are unchanged.
    pub(super) epoch: u64,
    tiles: Vec<Tile>,
}

/// Exclusive access of one thread to a film tile.
#[derive(Debug)]
pub struct TileHandle<'a> {
    /// Column and row of the tile's upper left pixel in the picture.
    pub origin: [usize; 2],
    tile: &'a mut Tile,
    epoch: u64,
}

impl<'a> TileHandle<'a> {
    /// Returns the tile for writing. Allocates it first, or clears it if it was written before the
    /// film's latest restart.
    pub fn prepare(self) -> &'a mut Tile {
        self.tile.clear_if_stale(self.epoch);
        self.tile
    }
}

impl Film {
    /// Creates a film without samples.
    ///
    /// # Panics
    /// Panics if width, height or the number of groups is 0, if there are more than
    /// [`MAX_FILM_GROUPS`] groups, or if a scale is not a power of two.
    pub fn new(header: Header) -> Self {
        Self::try_new(header, None).expect("memory for the tiles of a film")
    }

    /// Creates a film without samples, which reuses the memory of `previous`. All memory of a large
    /// film is allocated here.
    ///
    /// # Errors
    /// Fails if there is too little memory.
    ///
    /// # Panics
    /// See [`Film::new`].
    pub fn try_new(header: Header, previous: Option<Self>) -> Result<Self, TryReserveError> {
        let mut film = Self::without_memory(header)?;
        if let Some(previous) = previous {
            // Caches that compare epochs must not mistake the new film for the old one.
            film.epoch = previous.epoch + 1;
            for (tile, old) in film.tiles.iter_mut().zip(previous.tiles) {
                tile.sums = old.sums;
            }
        }
        // The tiles of a small film are allocated when they are first written, so that the first
        // picture appears sooner.
        if Self::memory_bytes(film.header.size(), film.groups()) >= RESERVED_FROM {
            film.tiles.iter_mut().try_for_each(Tile::reserve)?;
        }
        Ok(film)
    }

    /// Returns the bytes that the sums of a film take. A tile at the edge of the picture takes as
    /// many as any other.
    pub fn memory_bytes(size: [u32; 2], groups: usize) -> u64 {
        let [columns, rows] = size.map(|n| u64::from(n).div_ceil(TILE as u64));
        columns * rows * (Tile::sums_len(groups) * size_of::<i64>()) as u64
    }

    /// Creates a film whose tiles have no memory for sums yet.
    fn without_memory(header: Header) -> Result<Self, TryReserveError> {
        let Header { width, height, scales, .. } = &header;
        assert!(*width > 0 && *height > 0, "a film of {width} x {height} pixels");
        assert!(!scales.is_empty(), "a film without light groups");
        assert!(scales.len() <= MAX_FILM_GROUPS, "a film of {} light groups", scales.len());
        for scale in scales {
            assert!(
                Header::is_valid_scale(*scale),
                "a film scale of {scale}, which is not a power of two"
            );
        }
        let [columns, rows] = [width.div_ceil(TILE), height.div_ceil(TILE)];
        let mut tiles = Vec::new();
        tiles.try_reserve_exact(columns * rows)?;
        tiles.extend((0..columns * rows).map(|t| Tile::cleared(scales.len(), header.extent(t))));
        Ok(Self { epoch: 1, tiles, header, first_row: 0 })
    }

    /// Returns this film as a band of a picture that begins in row `first_row`. Methods count rows
    /// from the beginning of the band.
    ///
    /// # Panics
    /// Panics if `first_row` is not a multiple of [`TILE`].
    pub fn starting_at(self, first_row: usize) -> Self {
        assert!(first_row.is_multiple_of(TILE), "a band from row {first_row}");
        Self { first_row, ..self }
    }

    /// Returns the number of light groups.
    pub fn groups(&self) -> usize {
        self.header.scales.len()
    }

    /// Discards all samples.
    pub fn restart(&mut self) {
        self.epoch += 1;
    }

    /// Returns the number of tiles, which are numbered row by row.
    pub fn tile_count(&self) -> usize {
        self.tiles.len()
    }

    /// Returns the number of tiles in a row of tiles.
    pub fn tile_columns(&self) -> usize {
        self.header.width.div_ceil(TILE)
    }

    /// Returns tile `index`; `None` if it was not written since the last restart.
    pub fn tile(&self, index: usize) -> Option<&Tile> {
        Some(&self.tiles[index]).filter(|tile| tile.epoch == self.epoch)
    }

    /// Returns the number of pixels of tile `index` that are inside the picture.
    pub fn tile_pixels(&self, index: usize) -> u64 {
        let [width, height] = self.tiles[index].extent;
        (width * height) as u64
    }

    /// Returns [`Tile::counts`] of tile `index`.
    pub fn counts(&self, index: usize) -> [u32; 2] {
        self.tile(index).map_or([0; 2], |tile| tile.counts)
    }

    /// Returns the samples per pixel of tile `index`, over both replicates.
    pub fn spp(&self, index: usize) -> u32 {
        let [a, b] = self.counts(index);
        a.saturating_add(b)
    }

    /// Iterates over the tiles written since the last restart, with their numbers.
    pub fn touched(&self) -> impl Iterator<Item = (usize, &Tile)> {
        self.tiles.iter().enumerate().filter(|(_, tile)| tile.epoch == self.epoch)
    }

    /// Returns handles of tiles, in the order of `indices`.
    ///
    /// # Panics
    ///
    /// Panics if an index occurs twice or is not below [`Film::tile_count`].
    pub fn slots(&mut self, indices: &[usize]) -> Vec<TileHandle<'_>> {
        let mut order: Vec<usize> = (0..indices.len()).collect();
        order.sort_unstable_by_key(|i| indices[*i]);
        let (columns, epoch, first_row) = (self.tile_columns(), self.epoch, self.first_row);
        let mut handles: Vec<Option<TileHandle>> = indices.iter().map(|_| None).collect();
        let mut remaining = self.tiles.as_mut_slice();
        let mut first = 0;
        for i in order {
            let index = indices[i];
            assert!(index >= first, "tile {index} is named twice");
            let (tile, after) =
                remaining[index - first..].split_first_mut().expect("tile in range");
            let origin = [index % columns * TILE, first_row + index / columns * TILE];
            handles[i] = Some(TileHandle { origin, tile, epoch });
            (remaining, first) = (after, index + 1);
        }
        handles.into_iter().flatten().collect()
    }

    /// Returns the number of samples of all pixels and both replicates.
    pub fn samples(&self) -> u64 {
        let samples_of_tile = |tile: &Tile| {
            let [width, height] = tile.extent;
            let counts = tile.counts.map(u64::from);
            let lattice = match tile.lattice_px {
                0 => 0,
                step => width.div_ceil(step) * height.div_ceil(step),
            };
            (counts[0] + counts[1]) * (width * height) as u64 + lattice as u64
        };
        self.touched().map(|(_, tile)| samples_of_tile(tile)).sum()
    }

    /// Returns the radiance of the pixels in row `y`: the mean over the samples in `replicates`,
    /// black without samples.
    pub fn row(&self, y: usize, replicates: Replicates, weights: &LightWeights) -> Vec<[f64; 3]> {
        let mut row = vec![[0.0; 3]; self.header.width];
        let per_unit = weights.radiance_per_step(&self.header.scales);
        self.visit_row(y, 0..self.header.width, |x, sums| {
            row[x] = sums.mean(replicates, &per_unit)
        });
        row
    }

    /// Calls `f` with the column and the integer sums of each pixel of row `y` in `columns`, which
    /// begin at a multiple of [`TILE`]. Tiles without samples are skipped.
    pub fn visit_row(&self, y: usize, columns: Range<usize>, mut f: impl FnMut(usize, Sums)) {
        for left in columns.clone().step_by(TILE) {
            let index = y / TILE * self.tile_columns() + left / TILE;
            let Some(tile) = self.tile(index) else { continue };
            for x in left..columns.end.min(left + TILE) {
                f(x, tile.sums(y % TILE * TILE + x % TILE));
            }
        }
    }

    /// Returns the estimated error of the picture. `None` if a tile has no samples, or unequal
    /// numbers of samples in A and B.
    pub fn noise(&self, weights: &LightWeights, display: &Display) -> Option<Noise> {
        let estimator = Estimator::new(&self.header.scales, weights, display);
        let noise_of_tile = |index| self.tile(index).and_then(|tile| estimator.tile(tile));
        Noise::of_tiles((0..self.tile_count()).map(noise_of_tile))
    }

    /// Returns the estimated error of the tiles that have samples, as [`Self::noise`] does.
    pub fn noise_of_sampled(&self, weights: &LightWeights, display: &Display) -> Option<Noise> {
        let estimator = Estimator::new(&self.header.scales, weights, display);
        let sampled = self.touched().filter(|(_, tile)| tile.counts != [0; 2]);
        Noise::of_tiles(sampled.map(|(_, tile)| estimator.tile(tile)))
    }

    /// Returns the number of samples that are NaN or negative.
    pub fn bad_samples(&self) -> u64 {
        self.touched().map(|(_, tile)| tile.bad_samples).sum()
    }

    /// Returns the number of samples above the largest value that the film can store.
    pub fn saturated_samples(&self) -> u64 {
        self.touched().map(|(_, tile)| tile.saturated_samples).sum()
    }

    /// Returns the number of pixels with a sum that has reached `i64::MAX`.
    pub fn saturated_pixels(&self) -> u64 {
        self.touched().map(|(_, tile)| tile.saturated_pixels()).sum()
    }

    /// Discards the samples of tile `index`.
    pub(crate) fn clear_tile(&mut self, index: usize) {
        self.tiles[index].epoch = 0;
    }

    /// Replaces the samples of tile `index` by those of the same tile of `film`.
    pub(crate) fn copy_tile(&mut self, index: usize, film: &Self) {
        if let Some(tile) = film.tile(index) {
            self.tiles[index] = tile.clone();
            self.tiles[index].epoch = self.epoch;
        }
    }

    /// Adds the samples of `tile` to tile `index`, which has the same extent.
    pub(crate) fn add_at(&mut self, index: usize, tile: Tile) {
        let ours = &mut self.tiles[index];
        if ours.epoch == self.epoch {
            ours.add_tile(&tile);
        } else {
            *ours = tile;
            ours.epoch = self.epoch;
        }
    }

    /// Checks that a film with the properties `theirs` can be added to this film.
    ///
    /// # Errors
    /// Fails if a property differs.
    pub fn check_header(&self, theirs: &Header) -> Result<(), String> {
        let properties = |h: &Header| -> [(&'static str, String); 4] {
            [
                ("size", format!("{}x{}", h.width, h.height)),
                ("light group scales", format!("{:?}", h.scales)),
                ("seed", h.seed.to_string()),
                ("precision", h.precision.name().to_string()),
            ]
        };
        let ours = properties(&self.header);
        let different = ours.into_iter().zip(properties(theirs)).find(|(a, b)| a != b);
        different.map_or(Ok(()), |((property, ours), (_, theirs))| {
            Err(format!(
                "these films cannot be added: {property} {ours} here, {theirs} there; \
                 only films of the same scene, size, seed and precision can"
            ))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::testing::{TestFilm, fill, film, white};

    #[test]
    fn tiles_cover_the_film() {
        let mut film = film(33, 17, &[1.0]);
        assert_eq!((film.tile_count(), film.tile_columns()), (6, 3));
        let places = film.slots(&[5, 1]).into_iter().map(|slot| (slot.origin, slot.tile.extent));
        assert_eq!(places.collect::<Vec<_>>(), [([32, 16], [1, 1]), ([16, 0], [16, 16])]);
        assert_eq!(film.touched().count(), 0);
    }

    #[test]
    fn slots_have_the_order_of_the_indices() {
        let mut film = film(48, 32, &[1.0]);
        let slots = film.slots(&[4, 0, 5, 2]);
        let order: Vec<_> = slots.iter().map(|slot| slot.origin).collect();
        assert_eq!(order, [[16, 16], [0, 0], [32, 16], [32, 0]]);
        // Only the prepared tile counts as touched.
        slots.into_iter().nth(2).unwrap().prepare().advance(0, 3);
        let touched: Vec<_> = film.touched().map(|(i, tile)| (i, tile.counts)).collect();
        assert_eq!(touched, [(5, [3, 0])]);
        assert_eq!(film.samples(), 3 * 256);
    }

    #[test]
    #[should_panic(expected = "tile 2 is named twice")]
    fn no_tile_is_handed_out_twice() {
        film(48, 32, &[1.0]).slots(&[2, 1, 2]);
    }

    #[test]
    fn restart_discards_all_samples() {
        let (mut film, empty) = (film(20, 20, &[1.0]), film(20, 20, &[1.0]).bytes());
        fill(&mut film, 2, |x, _, _| vec![x as f64; 3]);
        let full = film.bytes();
        film.restart();
        assert_eq!((film.samples(), film.bytes()), (0, empty));
        fill(&mut film, 2, |x, _, _| vec![x as f64; 3]);
        assert_eq!(film.bytes(), full);
    }

    #[test]
    fn reused_memory_holds_no_samples() {
        let value = |x: usize| vec![x as f64 + 1.0; 3];
        let mut old = film(40, 40, &[1.0]);
        fill(&mut old, 2, |x, _, _| value(x));
        let expected = |width, height, groups: usize| {
            let header = film(width, height, &vec![4.0; groups]).header.clone();
            let mut fresh = Film::new(header.clone());
            fill(&mut fresh, 1, |x, _, _| value(x).repeat(groups));
            (header, fresh.bytes())
        };
        // The new films have fewer, more and equally many tiles compared with the old film, and
        // more and fewer light groups.
        for (width, height, groups) in [(20, 20, 1), (70, 30, 3), (70, 30, 2), (40, 40, 1)] {
            let (header, bytes) = expected(width, height, groups);
            old = Film::try_new(header, Some(old)).unwrap();
            assert_eq!((old.samples(), old.touched().count()), (0, 0));
            fill(&mut old, 1, |x, _, _| value(x).repeat(groups));
            assert_eq!(old.bytes(), bytes, "{width} x {height}, {groups} groups");
        }
    }

    #[test]
    fn films_with_different_headers_cannot_be_added() {
        let mut ours = film(20, 20, &[1.0]);
        fill(&mut ours, 2, |x, _, _| vec![x as f64; 3]);
        let before = ours.bytes();
        let altered = |change: fn(&mut Header)| {
            let mut header = ours.header.clone();
            change(&mut header);
            Film::new(header)
        };
        let others = [
            (altered(|h| h.width = 19), "size 20x20 here, 19x20 there"),
            (altered(|h| h.scales = vec![2.0]), "scales [1.0] here, [2.0] there"),
            (altered(|h| h.scales = vec![1.0, 1.0]), "[1.0] here, [1.0, 1.0] there"),
            (altered(|h| h.seed = 2), "seed 1 here, 2 there"),
            (altered(|h| h.precision = Precision::Double), "precision single here, double there"),
        ];
        for (other, difference) in others {
            let message = ours.add(&other).unwrap_err();
            assert!(message.contains(difference), "{message}");
        }
        assert_eq!(ours.bytes(), before);
        ours.add(&film(20, 20, &[1.0])).unwrap();
        assert_eq!(ours.bytes(), before);
    }

    #[test]
    fn first_sample_cannot_be_added_twice() {
        let lattice = || {
            let mut film = film(16, 16, &[1.0]);
            film.slots(&[0]).remove(0).prepare().set_lattice(8);
            film
        };
        let ours = lattice();
        let mut others = film(16, 16, &[1.0]);
        fill(&mut others, 4, |_, _, _| vec![4.0; 3]);
        others.add(&ours).unwrap();
        assert_eq!(others.samples(), 2 * 4 * 256 + 4);
        assert_eq!(others.pixel(8, 8, &white(1)), [8.0 / 9.0; 3]);
        assert_eq!(others.pixel(9, 8, &white(1)), [1.0; 3]);
    }

    #[test]
    #[should_panic(expected = "not a power of two")]
    fn scales_are_powers_of_two() {
        film(1, 1, &[3.0]);
    }
}
