//! OpenEXR writer. Pictures are linear radiance in 32-bit floats, with additional channels for
//! replicates, light groups and sample count.
//!
//! `R G B` is the picture. `A.R ..` and `B.R ..` are the pictures of the replicates. `light_NAME.R
//! ..` is the contribution of a light group; the sum of all contributions is the picture. `count`
//! is the number of samples of a pixel.
//!
//! The file consists of tiles, so that programs can read a part of a large picture. The header is
//! written again at the end, with sorted attributes and the final metadata.

use crate::film::file::FilmFileHeader;
use crate::film::{Film, Replicates, Sums};
use crate::image_file::exr_header::sorted_header;
use crate::image_file::metadata::padded;
use crate::image_file::output::{Bands, Depth, WriteSeek, replace_start};
use exr::block::writer::ChunksWriter;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::compression::Compression;
use exr::error::Error;
use exr::math::{RoundingMode, Vec2};
use exr::meta::attribute::{
    AttributeValue, ChannelDescription, Chromaticities, LevelMode, LineOrder, SampleType, Text,
    TileDescription,
};
use exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use exr::meta::{BlockDescription, Headers};
use rayon::prelude::*;
use std::io::{self, Cursor};

/// Width and height of a tile of the file in pixels, multiples of those of a film tile.
const TILE: [usize; 2] = [64, 16];

/// Writes a picture, one row of tiles after another.
pub(super) fn encode(
    picture: &FilmFileHeader,
    _: Depth,
    bands: &mut dyn Bands,
    sink: &mut dyn WriteSeek,
) -> io::Result<()> {
    let layers = layer_names(&picture.group_names, picture.weights.weights.len());
    encode_to(picture, channels(&layers), bands, sink)
}

/// Writes a picture as [`encode`] does, with the channels `R G B` only.
pub(super) fn encode_without_layers(
    picture: &FilmFileHeader,
    _: Depth,
    bands: &mut dyn Bands,
    sink: &mut dyn WriteSeek,
) -> io::Result<()> {
    let mut channels = channels(&[]);
    channels.retain(|(_, source)| matches!(source, Source::Mixed(Replicates::Both, _)));
    encode_to(picture, channels, bands, sink)
}

/// Source of a channel's values. The last field of a variant is the colour (0 red, 1 green, 2
/// blue).
#[derive(Clone, Copy)]
enum Source {
    /// Radiance of all light groups together: the mean over the samples in these replicates.
    Mixed(Replicates, usize),
    /// Radiance of the light group with this number.
    Group(usize, usize),
    /// Number of samples in both replicates.
    Count,
}

fn encode_to(
    picture: &FilmFileHeader,
    channels: Vec<(String, Source)>,
    bands: &mut dyn Bands,
    sink: &mut dyn WriteSeek,
) -> io::Result<()> {
    try_encode(picture, &channels, bands, sink).map_err(|error| match error {
        Error::Io(error) => error,
        other => io::Error::other(other.to_string()),
    })
}

fn try_encode(
    picture: &FilmFileHeader,
    channels: &[(String, Source)],
    bands: &mut dyn Bands,
    sink: &mut dyn WriteSeek,
) -> Result<(), Error> {
    let headers = headers(picture, channels, &picture.metadata);
    exr::block::write(&mut *sink, headers, true, |meta, writer| {
        let blocks: Vec<_> =
            exr::block::enumerate_ordered_header_block_indices(&meta.headers).collect();
        for row in blocks.chunk_by(|a, b| a.1.pixel_position.y() == b.1.pixel_position.y()) {
            let [.., (_, last)] = row else { continue };
            let bottom = last.pixel_position.y() + last.pixel_size.height();
            for y in last.pixel_position.y()..bottom - 1 {
                bands.film_with_row(y)?;
            }
            let film = bands.film_with_row(bottom - 1)?;
            let compressed = |(number, index): &(usize, BlockIndex)| {
                let data = encode_block(picture, channels, film, index);
                let block = UncompressedBlock { index: *index, data };
                Ok((*number, block.compress_to_chunk(&meta.headers)?))
            };
            let chunks: Result<Vec<_>, Error> = row.par_iter().map(compressed).collect();
            for (number, chunk) in chunks? {
                writer.write_chunk(number, chunk)?;
            }
        }
        Ok(())
    })?;
    let last = bands.final_metadata();
    let [before, after] = [&picture.metadata, last.as_ref().unwrap_or(&picture.metadata)]
        .map(|metadata| header(picture, channels, metadata));
    Ok(replace_start(sink, &before?, &after?)?)
}

/// Returns the bytes of the file from its start to the end of the header, attributes sorted.
fn header(
    picture: &FilmFileHeader,
    channels: &[(String, Source)],
    metadata: &[(String, String)],
) -> Result<Vec<u8>, Error> {
    let mut file = Cursor::new(Vec::new());
    let headers = headers(picture, channels, metadata);
    match exr::block::write(&mut file, headers, true, |_, _| Err(Error::Aborted)) {
        Ok(()) | Err(Error::Aborted) => sorted_header(file.get_ref()).ok_or(Error::Aborted),
        Err(error) => Err(error),
    }
}

/// Returns the headers of the file's parts, of which there is only one.
fn headers(
    picture: &FilmFileHeader,
    channels: &[(String, Source)],
    metadata: &[(String, String)],
) -> Headers {
    let size = Vec2(picture.film.width, picture.film.height);
    let mut image = ImageAttributes::with_size(size);
    image.chromaticities = Some(Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.3, 0.6),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.329),
    });
    let mut layer = LayerAttributes::default();
    for (key, value) in metadata {
        layer.other.insert(text(key), AttributeValue::Text(text(&padded(value))));
    }
    let descriptions = channels
        .iter()
        .map(|(name, source)| {
            let kind = if let Source::Count = source { SampleType::U32 } else { SampleType::F32 };
            ChannelDescription::named(text(name), kind)
        })
        .collect();
    let tiles = TileDescription {
        tile_size: Vec2(TILE[0], TILE[1]),
        level_mode: LevelMode::Singular,
        rounding_mode: RoundingMode::Down,
    };
    let header = Header::new(text("picture"), size, descriptions)
        // Noisy pictures compress poorly: ZIP reduces 108 MB of 1920x1080 pixels to 71 MB in 3.4 s,
        // RLE to 100 MB in 0.55 s. Files are copied over slow lines.
        .with_encoding(Compression::ZIP16, BlockDescription::Tiles(tiles), LineOrder::Increasing)
        .with_shared_attributes(image)
        .with_attributes(layer);
    Headers::from_elem(header, 1)
}

fn text(text: &str) -> Text {
    Text::new_or_none(text).unwrap_or_else(|| Text::from_bytes_unchecked(text.bytes().collect()))
}

/// Returns all channels, sorted by name as the format requires.
fn channels(group_layers: &[String]) -> Vec<(String, Source)> {
    let mut channels = vec![("count".to_string(), Source::Count)];
    for (c, color) in ["R", "G", "B"].into_iter().enumerate() {
        channels.push((color.to_string(), Source::Mixed(Replicates::Both, c)));
        channels.push((format!("A.{color}"), Source::Mixed(Replicates::A, c)));
        channels.push((format!("B.{color}"), Source::Mixed(Replicates::B, c)));
        for (group, layer) in group_layers.iter().enumerate() {
            channels.push((format!("{layer}.{color}"), Source::Group(group, c)));
        }
    }
    channels.sort_by(|(a, _), (b, _)| a.as_bytes().cmp(b.as_bytes()));
    channels
}

/// Returns a unique layer name for each light group, of ASCII letters, digits, `_` and `-`. A group
/// without a name is named by its number.
fn layer_names(names: &[String], groups: usize) -> Vec<String> {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    let mut layers: Vec<String> = Vec::new();
    for group in 0..groups {
        let name: String = match names.get(group).filter(|name| !name.is_empty()) {
            Some(name) => name.chars().map(plain).take(100).collect(),
            None => group.to_string(),
        };
        let candidates = std::iter::once(format!("light_{name}"))
            .chain((2..).map(|n| format!("light_{name}_{n}")));
        let unique = candidates.into_iter().find(|candidate| !layers.contains(candidate));
        layers.extend(unique);
    }
    layers
}

/// Returns the values of the pixels of a tile of the file, `[row][channel][column]`. `film` holds
/// all of them.
fn encode_block(
    picture: &FilmFileHeader,
    channels: &[(String, Source)],
    film: &Film,
    block: &BlockIndex,
) -> Vec<u8> {
    let (Vec2(left, top), Vec2(width, height)) = (block.pixel_position, block.pixel_size);
    let per_unit = &picture.weights.radiance_per_step(&film.header.scales);
    let mut bytes = vec![0; width * height * channels.len() * 4];
    for (y, row) in (top..).zip(bytes.chunks_exact_mut(width * channels.len() * 4)) {
        film.visit_row(y - film.first_row, left..left + width, |x, sums| {
            let means = [Replicates::Both, Replicates::A, Replicates::B]
                .map(|replicates| sums.mean(replicates, per_unit));
            for ((_, source), values) in channels.iter().zip(row.chunks_exact_mut(width * 4)) {
                let value = match *source {
                    Source::Mixed(replicates, c) => {
                        (means[replicates as usize][c] as f32).to_ne_bytes()
                    }
                    Source::Group(group, c) => {
                        group_mean(&sums, per_unit, 3 * group + c).to_ne_bytes()
                    }
                    Source::Count => sums.count(Replicates::Both).to_ne_bytes(),
                };
                values[(x - left) * 4..][..4].copy_from_slice(&value);
            }
        });
    }
    bytes
}

/// Returns the mean over a pixel's samples of integer sum `i`, in radiance; 0 without samples. Sums
/// are in the order `[group][channel]`.
fn group_mean(sums: &Sums, per_unit: &[f64], i: usize) -> f32 {
    match sums.count(Replicates::Both) {
        0 => 0.0,
        count => (sums.value(Replicates::Both, i) * per_unit[i] / f64::from(count)) as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::testing::{fill, film, header};
    use crate::image_file::{ImageOutput, read_exr};
    use exr::meta::MetaData;

    #[test]
    fn tiles_hold_the_pixels_of_their_place() {
        let size = [2 * TILE[0] + 2, 2 * TILE[1] + 5];
        let mut film = film(size[0], size[1], &[1.0]);
        let value = |x: usize, y: usize| (1000 * y + x) as f64;
        fill(&mut film, 2, |x, y, _| vec![2.0 * value(x, y); 3]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let output = ImageOutput::from_path(&path).unwrap();
        output.write(&header(&film), Depth::Eight, &mut &film).unwrap();
        let meta = MetaData::read_from_file(&path, true).unwrap();
        let BlockDescription::Tiles(tiles) = meta.headers[0].blocks else { panic!("{meta:?}") };
        assert_eq!(tiles.tile_size, Vec2(TILE[0], TILE[1]));
        assert_eq!(meta.headers[0].chunk_count, 9);
        let read = read_exr(&path).unwrap();
        assert_eq!(read.size, size);
        for (i, pixel) in read.pixels.iter().enumerate() {
            let (x, y) = (i % size[0], i / size[0]);
            assert_eq!(*pixel, [value(x, y); 3], "{x} {y}");
        }
    }
}
