//! PNG writer: displayed pictures in 8 or 16 bits per channel, sRGB, with text metadata.

use crate::film::file::FilmFileHeader;
use crate::film::{Film, Replicates, quantised_16};
use crate::image_file::metadata::padded;
use crate::image_file::output::{Bands, Depth, WriteSeek, replace_start};
use png::{
    BitDepth, ColorType, Compression, Encoder, EncodingError, ScaledFloat, SourceChromaticities,
    SrgbRenderingIntent, Writer,
};
use rayon::prelude::*;
use std::io::{self, Write};
use std::ops::Range;

/// Largest number of bytes of image data in a chunk.
const CHUNK_BYTES: usize = 1 << 18;
/// Number of rows that are encoded together.
const STRIP_ROWS: usize = 64;
/// Number of bytes of the last chunk, which has no data.
const END_CHUNK_BYTES: usize = 12;

/// Writes a picture row by row.
pub(super) fn encode(
    header: &FilmFileHeader,
    depth: Depth,
    bands: &mut dyn Bands,
    sink: &mut dyn WriteSeek,
) -> io::Result<()> {
    encode_to(header, depth, bands, sink).map_err(|error| match error {
        EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    })
}

fn encode_to(
    header: &FilmFileHeader,
    depth: Depth,
    bands: &mut dyn Bands,
    sink: &mut dyn WriteSeek,
) -> Result<(), EncodingError> {
    let mut writer = start(header, depth, &header.metadata, &mut *sink)?;
    let mut stream = writer.stream_writer_with_size(CHUNK_BYTES)?;
    let mut y = 0;
    while y < header.film.height {
        let mut film = bands.film_with_row(y)?;
        let rows = y..(y + STRIP_ROWS).min(film.first_row + film.header.height);
        for y in rows.clone().skip(1) {
            film = bands.film_with_row(y)?;
        }
        y = rows.end;
        for row in encode_rows(header, depth, film, rows) {
            stream.write_all(&row)?;
        }
    }
    stream.finish()?;
    writer.finish()?;
    if let Some(last) = bands.final_metadata() {
        let [before, after] = [&header.metadata, &last].map(|m| preamble(header, depth, m));
        replace_start(sink, &before?, &after?)?;
    }
    Ok(())
}

/// Returns all bytes before the image data.
fn preamble(
    header: &FilmFileHeader,
    depth: Depth,
    metadata: &[(String, String)],
) -> Result<Vec<u8>, EncodingError> {
    let mut bytes = Vec::new();
    // The writer adds the last chunk when it is dropped.
    drop(start(header, depth, metadata, &mut bytes)?);
    bytes.truncate(bytes.len() - END_CHUNK_BYTES);
    Ok(bytes)
}

/// Writes the part before the image data.
fn start<W: Write>(
    header: &FilmFileHeader,
    depth: Depth,
    metadata: &[(String, String)],
    sink: W,
) -> Result<Writer<W>, EncodingError> {
    let mut encoder = Encoder::new(sink, header.film.width as u32, header.film.height as u32);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(match depth {
        Depth::Eight => BitDepth::Eight,
        Depth::Sixteen => BitDepth::Sixteen,
    });
    encoder.set_compression(Compression::Fast);
    // Readers that ignore the sRGB chunk use these values, which the PNG specification gives for
    // sRGB.
    encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
    encoder.set_source_gamma(ScaledFloat::from_scaled(45_455));
    let xy = |x, y| (ScaledFloat::from_scaled(x), ScaledFloat::from_scaled(y));
    encoder.set_source_chromaticities(SourceChromaticities {
        white: xy(31_270, 32_900),
        red: xy(64_000, 33_000),
        green: xy(30_000, 60_000),
        blue: xy(15_000, 6_000),
    });
    for (key, value) in metadata {
        // More programs read tEXt than iTXt, but tEXt holds only Latin-1.
        if value.is_ascii() {
            encoder.add_text_chunk(key.clone(), padded(value))?;
        } else {
            encoder.add_itxt_chunk(key.clone(), padded(value))?;
        }
    }
    encoder.write_header()
}

/// Encodes `rgb`, the bytes of 8-bit sRGB pixels row by row, as PNG. Pixels of the colour
/// `transparent` are transparent.
///
/// # Errors
/// Fails if the length of `rgb` is not 3 bytes per pixel.
pub fn png_of_rgb(
    [width, height]: [u32; 2],
    rgb: &[u8],
    transparent: Option<[u8; 3]>,
) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
    if let Some([r, g, b]) = transparent {
        encoder.set_trns(vec![0, r, 0, g, 0, b]);
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb)?;
    writer.finish()?;
    Ok(bytes)
}

/// Encodes rows of the picture, on the threads of the current pool if there is one. 16-bit levels
/// are big-endian.
fn encode_rows(
    header: &FilmFileHeader,
    depth: Depth,
    film: &Film,
    rows: Range<usize>,
) -> Vec<Vec<u8>> {
    let to_8 = header.display.to_8();
    let encode = |y: usize| -> Vec<u8> {
        let row = film.row(y - film.first_row, Replicates::Both, &header.weights);
        match depth {
            Depth::Eight => row.into_iter().flat_map(&to_8).collect(),
            Depth::Sixteen => row
                .into_iter()
                .flat_map(|rgb| header.display.levels(rgb))
                .flat_map(|value| quantised_16(value).to_be_bytes())
                .collect(),
        }
    };
    match rayon::current_thread_index() {
        Some(_) => rows.into_par_iter().map(encode).collect(),
        None => rows.map(encode).collect(),
    }
}
