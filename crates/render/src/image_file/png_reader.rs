//! PNG reader, for the display of finished pictures in the dashboard.

use png::{ColorType, Decoder, Transformations};
use std::io::BufReader;
use std::path::Path;
use zerkalo_scene::disk::open_regular;

/// Largest number of pixels of a PNG file that is read: 8192 x 8192. Larger files are refused,
/// because the whole picture is read into memory.
const MAX_PIXELS: u64 = 1 << 26;

/// Reads a PNG file. Returns its size (width, height) and its pixels in 8-bit sRGB,
/// `[row][column]`. Transparency is ignored.
///
/// # Errors
/// Fails if the file cannot be read or is too large.
pub fn read_png(path: &Path) -> Result<([usize; 2], Vec<[u8; 3]>), String> {
    let file = open_regular(path).map_err(|error| error.to_string())?;
    let mut decoder = Decoder::new(BufReader::new(file));
    decoder.set_transformations(Transformations::EXPAND | Transformations::STRIP_16);
    let mut reader = decoder.read_info().map_err(|error| error.to_string())?;
    let (width, height) = reader.info().size();
    let count = u64::from(width) * u64::from(height);
    if count > MAX_PIXELS {
        return Err(format!("it has {count} pixels; expected at most {MAX_PIXELS}"));
    }
    let bytes = reader.output_buffer_size().ok_or("it is too large")?;
    let mut levels = vec![0; bytes];
    reader.next_frame(&mut levels).map_err(|error| error.to_string())?;
    let pixels = match reader.output_color_type().0 {
        ColorType::Rgb => levels.as_chunks::<3>().0.to_vec(),
        ColorType::Rgba => {
            levels.as_chunks::<4>().0.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect()
        }
        ColorType::GrayscaleAlpha => {
            levels.as_chunks::<2>().0.iter().map(|[y, _]| [*y; 3]).collect()
        }
        // Indexed colours do not occur here, because the decoder expands palettes.
        ColorType::Grayscale | ColorType::Indexed => levels.iter().map(|y| [*y; 3]).collect(),
    };
    Ok(([width as usize, height as usize], pixels))
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
        std::fs::write(&path, png_of_rgb([5, 3], &levels).unwrap()).unwrap();
        let (size, pixels) = read_png(&path).unwrap();
        assert_eq!((size, pixels.as_flattened()), ([5, 3], &levels[..]));
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
