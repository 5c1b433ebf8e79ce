//! Reader of film files. It compares every length with the length of the file before it allocates
//! memory.

use crate::file_error::{self, FileError, begins_with};
use crate::film::display::Display;
use crate::film::file::encode::CHECKSUM_BYTES;
use crate::film::file::{
    DONE, FilmFileHeader, HEAD, MAGIC, MAX_SIDE, META, SavedFilm, TILES, TILES_PER_CHUNK, Tag,
    VERSION, tile_record,
};
use crate::film::light_weights::LightWeights;
use crate::film::store::{Film, Header};
use crate::film::{MAX_FILM_GROUPS, TILE, Tile};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};
use zerkalo_scene::Tone;
use zerkalo_scene::value::truncated;
use zerkalo_world::Precision;

/// Number of bytes of the shortest tile record, which is the record of a tile without samples.
const RECORD_BYTES: usize = 8;
/// Number of bytes of tag and length of a chunk.
const CHUNK_START: u64 = 12;

/// Returns `true` if the file at `path` begins with the magic bytes of film files.
pub fn is_film_file(path: &Path) -> bool {
    begins_with(path, &MAGIC)
}

/// Reader of a film file. It has already read everything before the tiles.
#[derive(Debug)]
pub struct FilmReader<R> {
    input: Input<R>,
    /// Contents before the tiles.
    pub header: FilmFileHeader,
    /// Tag and length of the first chunk after the header, which is read with the tiles.
    next: Vec<u8>,
    checksums: crc32fast::Hasher,
}

/// Bytes of a film file that remain to be read.
#[derive(Debug)]
struct Input<R> {
    path: PathBuf,
    bytes: R,
    left: u64,
}

#[derive(Debug)]
struct Chunk {
    tag: Tag,
    contents: Vec<u8>,
    checksum: [u8; CHECKSUM_BYTES],
}

impl FilmReader<BufReader<File>> {
    /// Opens the film file at `path` and reads everything before the tiles.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let (file, length) = file_error::open(path)?;
        Self::new(path, BufReader::with_capacity(1 << 16, file), length)
    }
}

impl<R: Read> FilmReader<R> {
    /// Reads everything before the tiles from `bytes`, a film file of `length` bytes.
    pub fn new(path: &Path, bytes: R, length: u64) -> Result<Self, FileError> {
        let mut input = Input { path: path.to_path_buf(), bytes, left: length };
        let mut checksums = crc32fast::Hasher::new();
        let magic = input.take(MAGIC.len() as u64, "its first bytes")?;
        if magic != MAGIC {
            return Err(input.error(
                "it is not a film file",
                "name a file that `zerkalo render --checkpoint` has written",
            ));
        }
        let version = input.take(4, "its version")?;
        let version = u32::from_le_bytes([version[0], version[1], version[2], version[3]]);
        if version != VERSION {
            return Err(input.error(
                format!("it has version {version} of the format, and this program reads {VERSION}"),
                "use the program that wrote it, or render again",
            ));
        }
        checksums.update(&magic);
        checksums.update(&version.to_le_bytes());
        let mut start = input.take(CHUNK_START, "a part")?;
        let mut chunks = BTreeMap::new();
        while ![&TILES[..], &DONE].contains(&&start[..TILES.len()]) {
            let next = input.chunk(&start)?;
            checksums.update(&next.tag);
            checksums.update(&(next.contents.len() as u64).to_le_bytes());
            checksums.update(&next.contents);
            checksums.update(&next.checksum);
            if chunks.insert(next.tag, next.contents).is_some() {
                return Err(input.damaged("a part of it occurs twice"));
            }
            start = input.take(CHUNK_START, "a part")?;
        }
        let mut header = chunks
            .remove(&HEAD)
            .and_then(|head| decode_head(&mut Fields::new(&head)))
            .ok_or_else(|| input.damaged("its header has invalid values"))?;
        header.metadata = chunks
            .remove(&META)
            .and_then(|metadata| decode_metadata(&mut Fields::new(&metadata)))
            .ok_or_else(|| input.damaged("its metadata are not readable"))?;
        header.chunks = chunks;
        Ok(Self { input, header, next: start, checksums })
    }

    /// Reads header and film.
    pub fn read(self) -> Result<SavedFilm, FileError> {
        let mut film = self.header.empty_film(&self.input.path)?;
        let header = self.add_to(&mut film)?;
        Ok(SavedFilm { header, film })
    }

    /// Adds the samples of the file to `film`. After an error, `film` may contain some of them.
    pub fn add_to(self, film: &mut Film) -> Result<FilmFileHeader, FileError> {
        self.add_tiles(film, |_| true)
    }

    /// Adds the tiles for which `wanted` returns `true`, given their numbers in `film`, which may be
    /// a band of the picture.
    pub(crate) fn add_tiles(
        self,
        film: &mut Film,
        wanted: impl Fn(usize) -> bool,
    ) -> Result<FilmFileHeader, FileError> {
        film.check_header(&Header { height: film.header.height, ..self.header.film.clone() })
            .map_err(|what| self.input.error(what, "name a file of the same render"))?;
        let first = film.first_row / TILE * film.tile_columns();
        self.each_tile(first..first + film.tile_count(), |number, tile| {
            if wanted(number - first) {
                film.add_at(number - first, tile);
            }
        })
    }

    /// Reads header and tiles. Most of the time of reading a film is that of decoding them, which
    /// several threads can do for several files.
    pub(crate) fn tiles(self) -> Result<(FilmFileHeader, Vec<(usize, Tile)>), FileError> {
        let mut tiles = Vec::new();
        let all = 0..self.header.film.tiles();
        let header = self.each_tile(all, |number, tile| tiles.push((number, tile)))?;
        Ok((header, tiles))
    }

    /// Calls `each` with the tiles of `band` that have samples, and their numbers in the picture.
    fn each_tile(
        self,
        band: Range<usize>,
        mut each: impl FnMut(usize, Tile),
    ) -> Result<FilmFileHeader, FileError> {
        let picture = self.header.film.clone();
        let groups = picture.scales.len();
        self.visit_tiles(|fields, numbers| {
            if numbers.start >= band.end || numbers.end <= band.start {
                return Some(());
            }
            for number in numbers {
                if let Some(rest) = fields.0.strip_prefix(&[0; RECORD_BYTES]) {
                    fields.0 = rest;
                    continue;
                }
                let mut tile = Tile::blank(groups, picture.extent(number));
                tile_record::decode(&mut tile, groups, fields)?;
                if band.contains(&number) {
                    each(number, tile);
                }
            }
            fields.is_empty().then_some(())
        })
    }

    /// Reads the file to its end and verifies all checksums.
    pub fn verify(self) -> Result<FilmFileHeader, FileError> {
        self.visit_tiles(|_, _| Some(()))
    }

    /// Calls `visit` with the records of each `TILE` chunk and the numbers of its tiles; `visit`
    /// returns `None` for an invalid record. Verifies all checksums. Returns the header.
    fn visit_tiles(
        self,
        mut visit: impl FnMut(&mut Fields, Range<usize>) -> Option<()>,
    ) -> Result<FilmFileHeader, FileError> {
        let Self { mut input, header, next, mut checksums } = self;
        let mut next = input.chunk(&next)?;
        let all = header.film.tiles();
        let mut tiles = 0;
        while next.tag == TILES {
            let mut fields = Fields::new(&next.contents);
            let numbers = fields.u32().zip(fields.u32());
            let numbers =
                numbers.map(|(first, count)| first as usize..(first as usize + count as usize));
            let numbers =
                numbers.filter(|n| n.start >= tiles && n.len() <= TILES_PER_CHUNK && n.end <= all);
            let visited = numbers.and_then(|numbers| {
                visit(&mut fields, numbers.clone()).map(|()| tiles = numbers.end)
            });
            if visited.is_none() {
                return Err(input.damaged(format!("a tile from {tiles} on has invalid values")));
            }
            checksums.update(&next.checksum);
            let start = input.take(CHUNK_START, "a part")?;
            next = input.chunk(&start)?;
        }
        let mut done = Fields::new(&next.contents);
        let expected = (all as u64, checksums.finalize());
        if next.tag != DONE || done.u64().zip(done.u32()) != Some(expected) || !done.is_empty() {
            return Err(input.damaged("its parts do not belong together"));
        }
        if input.left != 0 {
            return Err(input.damaged(format!("{} bytes follow its end", input.left)));
        }
        Ok(header)
    }
}

/// Decodes the `HEAD` chunk of a film file. Returns `None` if a field is invalid.
fn decode_head(fields: &mut Fields) -> Option<FilmFileHeader> {
    let [width, height, groups] = [fields.u32()?, fields.u32()?, fields.u32()?].map(|n| n as usize);
    let sides = 1..=MAX_SIDE;
    let possible = sides.contains(&width)
        && sides.contains(&height)
        && (1..=MAX_FILM_GROUPS).contains(&groups);
    if !possible {
        return None;
    }
    let (mut scales, mut weights, mut group_names) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..groups {
        let scale = fields.f64()?;
        if !Header::is_valid_scale(scale) {
            return None;
        }
        scales.push(scale);
        let weight = [fields.f64()?, fields.f64()?, fields.f64()?];
        if !weight.iter().all(|w| w.is_finite() && *w >= 0.0) {
            return None;
        }
        weights.push(weight);
        group_names.push(fields.text()?);
    }
    let (seed, precision) = (fields.u64()?, Precision::from_name(&fields.text()?)?);
    let exposure_ev = fields.f64()?;
    let tone = Tone::from_name(&fields.text()?)?;
    (exposure_ev.is_finite() && fields.is_empty()).then(|| FilmFileHeader {
        film: Header { width, height, scales, seed, precision },
        weights: LightWeights { weights },
        group_names,
        display: Display { exposure_ev, tone },
        metadata: Vec::new(),
        chunks: BTreeMap::new(),
    })
}

/// Decodes the `META` chunk. Returns `None` if it is invalid.
fn decode_metadata(fields: &mut Fields) -> Option<Vec<(String, String)>> {
    let count = fields.u32()?;
    let entries = (0..count).map(|_| Some((fields.text()?, fields.text()?)));
    let entries = entries.collect::<Option<Vec<_>>>()?;
    fields.is_empty().then_some(entries)
}

impl<R: Read> Input<R> {
    fn error(&self, what: impl Into<String>, remedy: &str) -> FileError {
        FileError::new(&self.path, what, remedy)
    }

    fn damaged(&self, what: impl Into<String>) -> FileError {
        self.error(
            format!("it is damaged or was altered: {}", what.into()),
            "copy it again, or use an older one",
        )
    }

    /// Reads `length` bytes, which error messages call `part`.
    fn take(&mut self, length: u64, part: &str) -> Result<Vec<u8>, FileError> {
        let cut = |input: &Self| {
            let what = format!("it ends in the middle of {part}: it was not copied as a whole");
            input.error(what, "copy it again, or use an older one")
        };
        if length > self.left {
            return Err(cut(self));
        }
        let mut bytes = Vec::new();
        let size = usize::try_from(length).unwrap_or(usize::MAX);
        if bytes.try_reserve_exact(size).is_err() {
            let what = format!("{part} takes {length} bytes of memory, which the system refuses");
            return Err(self.error(what, "use a machine with more memory"));
        }
        bytes.resize(size, 0);
        match self.bytes.read_exact(&mut bytes) {
            Ok(()) => {}
            // The file has become shorter since it was opened.
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Err(cut(self)),
            Err(error) => return Err(self.error(error.to_string(), "check the disk")),
        }
        self.left -= length;
        Ok(bytes)
    }

    /// Reads the chunk that begins with `start` and verifies its checksum.
    fn chunk(&mut self, start: &[u8]) -> Result<Chunk, FileError> {
        let (tag, length) = start.split_at(4);
        let tag: Tag = [tag[0], tag[1], tag[2], tag[3]];
        let name = truncated(&String::from_utf8_lossy(&tag)).to_string();
        let length = Fields::new(length).u64().unwrap_or(u64::MAX);
        let contents = self.take(length, &format!("the part {name}"))?;
        let checksum = self.take(CHECKSUM_BYTES as u64, &format!("the part {name}"))?;
        let mut expected = crc32fast::Hasher::new();
        expected.update(start);
        expected.update(&contents);
        if checksum != expected.finalize().to_le_bytes() {
            return Err(self.damaged(format!("the checksum of its part {name} is wrong")));
        }
        let checksum = [checksum[0], checksum[1], checksum[2], checksum[3]];
        Ok(Chunk { tag, contents, checksum })
    }
}

/// Reader of little-endian numbers and texts in a byte string. Methods return `None` if there are
/// too few bytes or the value is invalid.
pub struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    /// Creates a reader of the fields in `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// Returns `true` if no bytes are left to read.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Reads `length` bytes.
    pub fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(taken)
    }

    pub fn u8(&mut self) -> Option<u8> {
        self.take(1).map(|bytes| bytes[0])
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.take(4).and_then(|bytes| bytes.try_into().ok()).map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Option<u64> {
        self.take(8).and_then(|bytes| bytes.try_into().ok()).map(u64::from_le_bytes)
    }

    pub fn f64(&mut self) -> Option<f64> {
        self.u64().map(f64::from_bits)
    }

    /// Reads a UTF-8 text after its length in bytes (u32).
    pub fn text(&mut self) -> Option<String> {
        let length = self.u32()? as usize;
        String::from_utf8(self.take(length)?.to_vec()).ok()
    }
}
