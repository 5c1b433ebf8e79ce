//! PNG reader, for the dashboard's display of finished pictures.

use crate::image_file::check_pixels;
use image::codecs::png::PngDecoder;
use image::{DynamicImage, ImageDecoder, Limits, RgbImage};
use std::io::BufReader;
use std::path::Path;
use zerkalo_scene::disk::open_regular;

/// Reads a PNG file as 8-bit sRGB. Transparency is ignored.
pub fn read_png(path: &Path) -> Result<RgbImage, String> {
    let file = open_regular(path).map_err(|error| error.to_string())?;
    let decoder = PngDecoder::with_limits(BufReader::new(file), Limits::default());
    let decoder = decoder.map_err(|error| error.to_string())?;
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    // The levels of the file, and those of the picture.
    check_pixels(pixels, decoder.total_bytes() + 3 * pixels)?;
    let image = DynamicImage::from_decoder(decoder).map_err(|error| error.to_string())?;
    Ok(image.into_rgb8())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image_file::png_of_rgb;

    #[test]
    fn written_png_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let levels: Vec<u8> = (0..5 * 3 * 3).map(|i| (i * 37 % 256) as u8).collect();
        std::fs::write(&path, png_of_rgb([5, 3], &levels, None).unwrap()).unwrap();
        let image = read_png(&path).unwrap();
        assert_eq!((image.dimensions(), image.into_raw()), ((5, 3), levels));
        // A truncated file gives an error, or the complete picture if fewer than 16 bytes are
        // missing. The last 16 bytes are the checksum of the image data and the empty last chunk.
        let whole = std::fs::read(&path).unwrap();
        for length in 0..whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            assert!(read_png(&path).is_err() || length > whole.len() - 16, "{length}");
        }
        assert!(read_png(&folder.path().join("none.png")).is_err());
    }
}
