//! Writer of film files.

use crate::film::TILE;
use crate::film::file::{
    DONE, FilmFileHeader, HEAD, MAGIC, META, TILES, TILES_PER_CHUNK, Tag, VERSION, tile_record,
};
use crate::film::store::Film;
use rayon::prelude::*;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use zerkalo_scene::disk::{Existing, WriteError, replace_file};

/// Number of bytes of the checksum at the end of a chunk.
pub(super) const CHECKSUM_BYTES: usize = 4;

impl FilmFileHeader {
    /// Encodes the part of the film file before the tiles.
    pub(super) fn encode(&self) -> Vec<u8> {
        let mut out = [&MAGIC[..], &VERSION.to_le_bytes()].concat();
        out.extend(chunk(HEAD, |head| self.encode_head(head)));
        out.extend(chunk(META, |meta| {
            meta.extend((self.metadata.len() as u32).to_le_bytes());
            for (key, value) in &self.metadata {
                text(key, meta);
                text(value, meta);
            }
        }));
        for (tag, contents) in &self.chunks {
            debug_assert!(![HEAD, META, TILES, DONE].contains(tag), "a chunk with a fixed tag");
            out.extend(chunk(*tag, |out| out.extend(contents)));
        }
        out
    }

    fn encode_head(&self, out: &mut Vec<u8>) {
        let film = &self.film;
        for n in [film.width, film.height, film.scales.len()] {
            out.extend((n as u32).to_le_bytes());
        }
        for (group, scale) in film.scales.iter().enumerate() {
            out.extend(scale.to_le_bytes());
            let weights = self.weights.weights.get(group).unwrap_or(&[1.0; 3]);
            weights.iter().for_each(|weight| out.extend(weight.to_le_bytes()));
            text(self.group_names.get(group).map_or("", String::as_str), out);
        }
        out.extend(film.seed.to_le_bytes());
        text(film.precision.name(), out);
        out.extend(self.display.exposure_ev.to_le_bytes());
        text(self.display.tone.name(), out);
    }
}

/// Film file encoded as bytes, so that another thread can write it.
pub struct EncodedFilm {
    /// Header, `TILE` chunks, `DONE` chunk.
    pub pieces: Vec<Vec<u8>>,
}

impl EncodedFilm {
    /// Encodes `film`, the picture of `header` or a band of it, on the threads of `pool` if there is
    /// one.
    pub fn new(header: &FilmFileHeader, film: &Film, pool: Option<&rayon::ThreadPool>) -> Self {
        let mut pieces = vec![header.encode()];
        let all = header.film.tiles();
        let first = film.first_row / TILE * film.tile_columns();
        let held = |tile: usize| film.counts(tile) != [0; 2];
        // A part of a film has no chunks of the tiles that it lacks.
        let chunks: Vec<usize> = (0..film.tile_count())
            .step_by(TILES_PER_CHUNK)
            .filter(|tile| (*tile..film.tile_count().min(tile + TILES_PER_CHUNK)).any(held))
            .collect();
        let encode = |tile: usize| encode_tiles(film, first, tile);
        match pool {
            Some(pool) => pool.install(|| pieces.par_extend(chunks.into_par_iter().map(encode))),
            None => pieces.extend(chunks.into_iter().map(encode)),
        }
        pieces.push(encode_end(all, &pieces));
        Self { pieces }
    }

    /// Writes the file at `path`, in one step. `existing` decides if a file there may be replaced.
    /// After an error an existing file is unchanged. Returns the file with its lock.
    pub fn write(&self, path: &Path, existing: Existing) -> Result<File, WriteError> {
        replace_file(path, existing, |file| {
            self.pieces.iter().try_for_each(|piece| file.write_all(piece))
        })
    }
}

/// Encodes the `TILE` chunk from tile `first` of `film` on, a band that begins with tile `offset` of
/// the picture. A tile in its first pass is written as one without samples.
fn encode_tiles(film: &Film, offset: usize, first: usize) -> Vec<u8> {
    let count = (film.tile_count() - first).min(TILES_PER_CHUNK);
    chunk(TILES, |out| {
        out.extend(((offset + first) as u32).to_le_bytes());
        out.extend((count as u32).to_le_bytes());
        (first..first + count).for_each(|tile| tile_record::encode(film.tile(tile), out));
    })
}

/// Encodes the last chunk of the file of a film with `tiles` tiles. `pieces` are the encoded header
/// and tile chunks.
fn encode_end(tiles: usize, pieces: &[Vec<u8>]) -> Vec<u8> {
    let mut checksum = crc32fast::Hasher::new();
    // The checksum covers the whole header, but only the own checksum of each tile chunk.
    for (i, piece) in pieces.iter().enumerate() {
        let start = if i == 0 { 0 } else { piece.len() - CHECKSUM_BYTES };
        checksum.update(&piece[start..]);
    }
    let checksum = checksum.finalize();
    chunk(DONE, |out| {
        out.extend((tiles as u64).to_le_bytes());
        out.extend(checksum.to_le_bytes());
    })
}

/// Appends a text after its length in bytes (u32).
pub fn text(text: &str, out: &mut Vec<u8>) {
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text.as_bytes());
}

/// Encodes a chunk, whose contents `contents` appends to a buffer.
fn chunk(tag: Tag, contents: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut out = [&tag[..], &[0; 8]].concat();
    contents(&mut out);
    let length = (out.len() - 12) as u64;
    out[4..12].copy_from_slice(&length.to_le_bytes());
    let checksum = crc32fast::hash(&out);
    out.extend(checksum.to_le_bytes());
    out
}
