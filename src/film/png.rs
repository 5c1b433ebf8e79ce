//! PNG writer: displayed pictures in 8 or 16 bits per channel, sRGB, with text metadata.

use crate::film::display::quantised_16;
use crate::film::image_data::{Depth, ImageData, WriteSeek};
use crate::film::light_weights::Replicates;
use png::{
    BitDepth, ColorType, Compression, Encoder, EncodingError, ScaledFloat, SourceChromaticities,
    SrgbRenderingIntent,
};
use std::io;

pub(super) fn encode(picture: &ImageData, sink: &mut dyn WriteSeek) -> io::Result<()> {
    encode_to(picture, sink).map_err(|error| match error {
        EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    })
}

fn encode_to(picture: &ImageData, sink: &mut dyn WriteSeek) -> Result<(), EncodingError> {
    let film = picture.film;
    let too_large = |_| io::Error::new(io::ErrorKind::InvalidInput, "too large for a PNG file");
    let width = u32::try_from(film.width()).map_err(too_large)?;
    let height = u32::try_from(film.height()).map_err(too_large)?;
    let mut encoder = Encoder::new(sink, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(match picture.depth {
        Depth::Eight => BitDepth::Eight,
        Depth::Sixteen => BitDepth::Sixteen,
    });
    encoder.set_compression(Compression::Fast);
    // Gamma and chromaticities that the PNG specification gives for sRGB, for readers that ignore
    // the sRGB chunk.
    encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
    encoder.set_source_gamma(ScaledFloat::from_scaled(45_455));
    let xy = |x, y| (ScaledFloat::from_scaled(x), ScaledFloat::from_scaled(y));
    encoder.set_source_chromaticities(SourceChromaticities {
        white: xy(31_270, 32_900),
        red: xy(64_000, 33_000),
        green: xy(30_000, 60_000),
        blue: xy(15_000, 6_000),
    });
    for (key, value) in picture.metadata {
        // More programs read the older text chunk, but it can hold only Latin-1.
        if value.is_ascii() {
            encoder.add_text_chunk(key.clone(), value.clone())?;
        } else {
            encoder.add_itxt_chunk(key.clone(), value.clone())?;
        }
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels(picture))?;
    writer.finish()
}

/// Encodes rows of red, green, blue, 8 bits each, sRGB, as PNG.
///
/// # Errors
/// Fails if `rgb` has not 3 bytes for each pixel.
pub fn png_of_rgb([width, height]: [u32; 2], rgb: &[u8]) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb)?;
    writer.finish()?;
    Ok(bytes)
}

/// Returns the bytes of the picture: rows of red, green, blue. 16-bit values are big-endian, as PNG
/// requires.
fn pixels(picture: &ImageData) -> Vec<u8> {
    let (film, mut row) = (picture.film, Vec::new());
    let bytes_per_channel = match picture.depth {
        Depth::Eight => 1,
        Depth::Sixteen => 2,
    };
    let mut bytes = Vec::with_capacity(film.width() * film.height() * 3 * bytes_per_channel);
    let to_8 = picture.display.to_8();
    for y in 0..film.height() {
        film.row(y, Replicates::Both, picture.mix, &mut row);
        match picture.depth {
            Depth::Eight => row.iter().for_each(|rgb| bytes.extend(to_8(*rgb))),
            Depth::Sixteen => bytes.extend(
                row.iter()
                    .flat_map(|rgb| picture.display.codes(*rgb))
                    .flat_map(|value| quantised_16(value).to_be_bytes()),
            ),
        }
    }
    bytes
}
