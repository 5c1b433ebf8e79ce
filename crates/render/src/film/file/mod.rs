//! Film files: a film with all its integer sums, and what is needed to continue its render.
//!
//! All numbers are little-endian. A file consists of
//!
//! - the magic bytes `89 5A 4B 46 0D 0A 1A 0A`. A transfer in text mode changes them, as in PNG;
//! - the version of the format (u32);
//! - chunks. A chunk has a tag (four letters), the length of its contents in bytes (u64), its
//!   contents, and a CRC-32 (IEEE 802.3, u32) of tag, length and contents.
//!
//! | tag | contents |
//! |---|---|
//! | `HEAD` | width, height, number of light groups (u32 each); for each group its scale and its weights in red, green, blue (f64 each) and its name; seed (u64); precision; exposure in stops (f64); tone curve |
//! | `META` | number of entries (u32), then key and value of each, as in the metadata of pictures |
//! | others | contents that this module does not interpret, in the order of their tags |
//! | `TILE` | number of the first tile and number of tiles (u32 each), then the records of up to 64 consecutive tiles, row by row, in ascending order; tiles that no chunk names have no samples |
//! | `DONE` | number of tiles (u64), and the CRC-32 (u32) of all bytes before the first `TILE` chunk and the checksums of the `TILE` chunks; the end of the file |
//!
//! A text has its length in bytes (u32) before it. A tile record consists of
//!
//! - the numbers of samples per pixel in the replicates A and B (u32 each). If both are 0, the
//!   record ends here;
//! - the number of samples above the largest value that the film can store (u64);
//! - the number of invalid samples (u64);
//! - the integer sums in planes, in the order replicate, group, channel. A plane begins with the
//!   number of bytes that its largest sum needs (u8, 0 to 8). The sums of the pixels inside the
//!   picture follow row by row, each with this number of bytes.
//!
//! The file takes about 60 % of the film's size in memory. The compact encoding saves time, because
//! writing the other 40 % to disk would take longer.

mod decode;
mod encode;
pub(crate) mod estimate_record;
#[cfg(test)]
mod tests;
pub(crate) mod tile_record;

pub use decode::{Fields, FilmReader, is_film_file};
pub use encode::{EncodedFilm, text};

use crate::file_error::FileError;
use crate::film::display::Display;
use crate::film::light_weights::LightWeights;
use crate::film::store::{Film, Header};
use crate::memory_budget;
use std::collections::BTreeMap;
use std::path::Path;
use zerkalo_scene::process_memory::missing_memory;

/// First bytes of a film file.
const MAGIC: [u8; 8] = *b"\x89ZKF\r\n\x1a\n";
/// Version of the film file format.
const VERSION: u32 = 4;
/// Number of tiles in a `TILE` chunk, fewer in the last one.
const TILES_PER_CHUNK: usize = 64;
/// Largest width and height, in pixels, of a film that is read from a file.
const MAX_SIDE: usize = 1 << 17;

/// Tag of a film file's chunk: four ASCII letters.
pub type Tag = [u8; 4];

const HEAD: Tag = *b"HEAD";
const META: Tag = *b"META";
const TILES: Tag = *b"TILE";
const DONE: Tag = *b"DONE";

/// Contents of a film file before the tiles.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmFileHeader {
    pub film: Header,
    pub weights: LightWeights,
    pub group_names: Vec<String>,
    /// Display transform with which the noise of the picture was estimated.
    pub display: Display,
    /// Keys and values that describe the picture, as in picture files.
    pub metadata: Vec<(String, String)>,
    /// Further chunks by tag, other than `HEAD`, `META`, `TILE` and `DONE`.
    pub chunks: BTreeMap<Tag, Vec<u8>>,
}

/// Contents of a film file.
#[derive(Debug)]
pub struct SavedFilm {
    pub header: FilmFileHeader,
    pub film: Film,
}

impl FilmFileHeader {
    /// Creates an empty film for the file at `path`. Fails if there is not enough memory.
    pub fn empty_film(&self, path: &Path) -> Result<Film, FileError> {
        let Header { width, height, scales, .. } = &self.film;
        let (size, groups) = ([*width, *height].map(|n| n as u32), scales.len());
        let film = match missing_memory(memory_budget::needed(size, groups)) {
            Some(missing) => Err(format!("its film of {width} x {height} pixels {missing}")),
            None => Film::try_new(self.film.clone(), None)
                .map_err(|_| memory_budget::refused(size, groups)),
        };
        film.map_err(|what| FileError::new(path, what, "free some, or use a machine with more"))
    }

    /// Returns the name of the scene file, if the metadata have it.
    pub fn source(&self) -> Option<&str> {
        self.metadata.iter().find(|(key, _)| key == "Source").map(|(_, source)| source.as_str())
    }
}
