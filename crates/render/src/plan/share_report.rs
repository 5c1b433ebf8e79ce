//! Report of a shard on its tiles, in the header of its part: what the next round is planned from.
//! The planner therefore reads no films.

use crate::film::file::{Fields, FilmFileHeader, tile_record};
use crate::film::{ByMeasure, Captures, Estimator, Tile, TileNoise};
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
            let error = if estimated { Some(decode_noise(&mut fields)?) } else { None };
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

pub(super) fn encode_noise(noise: &TileNoise, out: &mut Vec<u8>) {
    for pair in [noise.reported, noise.allocation, noise.squares] {
        [pair.linear, pair.levels].iter().for_each(|value| out.extend(value.to_le_bytes()));
    }
    for class in noise.captures.iter().flat_map(|captures| &captures.0) {
        let values = [class.once, class.twice, class.excess, class.contrast];
        values.iter().for_each(|value| out.extend(value.to_le_bytes()));
    }
    [noise.pixels, noise.samples].iter().for_each(|count| out.extend(count.to_le_bytes()));
}

fn decode_noise(fields: &mut Fields) -> Option<TileNoise> {
    let mut pair = || Some(ByMeasure { linear: fields.f64()?, levels: fields.f64()? });
    let [reported, allocation, squares] = [pair()?, pair()?, pair()?];
    let mut captures = [Captures::default(); 2];
    for class in captures.iter_mut().flat_map(|captures| &mut captures.0) {
        let mut value = || fields.u32().map(f32::from_bits);
        (class.once, class.twice) = (value()?, value()?);
        (class.excess, class.contrast) = (value()?, value()?);
    }
    let (pixels, samples) = (fields.u32()?, fields.u32()?);
    Some(TileNoise { reported, allocation, squares, captures, pixels, samples })
}
