//! Report of a shard on its tiles, in the header of its part: what the next round is planned from.
//! The planner therefore reads no films.

use crate::film::file::{Fields, FilmFileHeader, estimate_record, tile_record};
use crate::film::{Estimator, Tile, TileNoise};
use std::collections::BTreeMap;

/// Tag of the chunk with the report: the number of the first tile (u32), then a record of each tile:
/// rays (u64), `1` if it is glossy (u8), `1` if its error estimate follows (u8), and the estimate.
pub(super) const REPORT_TAG: [u8; 4] = *b"RPRT";
/// Tag of the chunk with the sums of tiles that other shards trace, too, each as its number (u32) and
/// its record in film files.
pub(super) const CUTS_TAG: [u8; 4] = *b"CUTS";

/// Results of a tile in one round.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TileReport {
    /// Rays traced in this round.
    pub rays: u64,
    /// `true` if a path has made a random choice.
    pub glossy: bool,
    /// Estimate of the tile's error. `None` in a part that is unfinished or has only some of its
    /// samples.
    pub error: Option<TileNoise>,
}

/// Reports on the tiles of a shard.
#[derive(Debug, Default)]
pub struct ShareReport {
    pub first: usize,
    pub tiles: Vec<TileReport>,
}

impl ShareReport {
    /// Reads the report in the header of a part. Returns `None` if there is none.
    pub fn of_header(header: &FilmFileHeader) -> Option<Self> {
        let mut fields = Fields::new(header.chunks.get(&REPORT_TAG)?);
        let first = fields.u32()? as usize;
        let mut tiles = Vec::new();
        while !fields.is_empty() {
            let rays = fields.u64()?;
            let [glossy, estimated] = [fields.u8()? == 1, fields.u8()? == 1];
            let error = if estimated { Some(estimate_record::decode(&mut fields)?) } else { None };
            tiles.push(TileReport { rays, glossy, error });
        }
        Some(Self { first, tiles })
    }
}

/// Sums of the reports of all shards of a round.
pub(super) struct RoundReport {
    pub tiles: Vec<TileReport>,
    cuts: BTreeMap<usize, Tile>,
}

impl RoundReport {
    pub fn new(tiles: usize) -> Self {
        Self { tiles: vec![TileReport::default(); tiles], cuts: BTreeMap::new() }
    }

    /// Adds the report in the header of a part. Returns `None` if it is invalid.
    pub fn add(&mut self, header: &FilmFileHeader) -> Option<()> {
        let report = ShareReport::of_header(header)?;
        let sums = self.tiles.get_mut(report.first..report.first + report.tiles.len())?;
        for (sum, tile) in sums.iter_mut().zip(&report.tiles) {
            sum.rays += tile.rays;
            sum.glossy |= tile.glossy;
            sum.error = sum.error.or(tile.error);
        }
        let mut fields = Fields::new(header.chunks.get(&CUTS_TAG)?);
        let picture = &header.film;
        while !fields.is_empty() {
            let number = fields.u32()? as usize;
            if number >= self.tiles.len() {
                return None;
            }
            let mut tile = Tile::blank(picture.scales.len(), picture.extent(number));
            tile_record::decode(&mut tile, picture.scales.len(), &mut fields)?;
            match self.cuts.get_mut(&number) {
                Some(sum) => sum.add_tile(&tile),
                None => drop(self.cuts.insert(number, tile)),
            }
        }
        Some(())
    }

    /// Returns the reports, with the errors of cut tiles.
    pub fn finish(mut self, estimator: &Estimator) -> Vec<TileReport> {
        for (number, tile) in &self.cuts {
            self.tiles[*number].error = estimator.tile(tile);
        }
        self.tiles
    }
}
