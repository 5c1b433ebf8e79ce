//! Images for textures, from PNG and JPEG files.

use crate::asset::error::AssetError;
use crate::asset::file::FileContents;
use crate::value::{Fnv1a64, linear_from_srgb};
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use std::sync::LazyLock;

/// Largest number of pixels in a row or column of a texture image.
pub const MAX_SIDE: u32 = 32_768;

/// Largest number of pixels of a texture image: 64 Mi. An image of this size takes at most 402 MB
/// of memory after decoding, and at most 940 MB during decoding.
pub const MAX_PIXELS: u64 = 1 << 26;

/// Largest number of pixels per byte of an image file. PNG has the largest ratio: at most eight
/// pixels per byte of uncompressed data, times the factor of at most 1032 by which deflate
/// compresses this data. A JPEG has at most 64 pixels per bit, which is 512 per byte. A Radiance
/// file in the old encoding has at most 65536 pixels per 8 bytes, which is 8192 per byte.
const PIXELS_PER_BYTE: u64 = 8 * 1032;

/// Pixels of a texture image with 8 or 16 bits per channel, as in the file. A grey pixel is one
/// number, a coloured pixel three.
#[derive(Clone, Debug, PartialEq)]
enum Texels {
    Bytes(Vec<u8>),
    Words(Vec<u16>),
}

/// Texture image, decoded in the bit depth of its file: 1 to 6 bytes per pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    size: [u32; 2],
    channels: usize,
    texels: Texels,
}

/// Returns a table of linear light from 0 to 1, indexed by sRGB level from 0 (black) to `last`
/// (white).
fn linear_table(last: u16) -> Vec<f32> {
    let linear = |level| linear_from_srgb(f64::from(level) / f64::from(last)) as f32;
    (0..=last).map(linear).collect()
}

static BYTES: LazyLock<Vec<f32>> = LazyLock::new(|| linear_table(255));
static WORDS: LazyLock<Vec<f32>> = LazyLock::new(|| linear_table(65535));

impl Image {
    /// Adds the size and the pixels of the image to `hash`.
    pub fn hash_contents(&self, hash: &mut Fnv1a64) {
        self.size.iter().for_each(|n| hash.update(&n.to_le_bytes()));
        hash.update(&[self.channels as u8]);
        match &self.texels {
            Texels::Bytes(bytes) => hash.update(bytes),
            Texels::Words(words) => words.iter().for_each(|w| hash.update(&w.to_le_bytes())),
        }
    }

    /// Decodes an image file in memory. The format is determined by the first bytes of the file.
    ///
    /// # Errors
    /// Fails if the file is not a valid image.
    pub(super) fn parse(source: &FileContents) -> Result<Self, AssetError> {
        let reader = ImageReader::new(Cursor::new(&source.bytes[..])).with_guessed_format();
        let mut reader = reader.map_err(|e| decode_error(source, &ImageError::IoError(e)))?;
        if !matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::Jpeg)) {
            return Err(source.fault("this is neither a PNG nor a JPEG", "a PNG or JPEG image"));
        }
        let mut limits = Limits::default();
        limits.max_alloc = Some(MAX_PIXELS * 8);
        reader.limits(limits);
        let mut decoder = reader.into_decoder().map_err(|e| decode_error(source, &e))?;
        check_size(source, decoder.dimensions().into(), MAX_SIDE, MAX_PIXELS)?;
        let orientation = decoder.orientation().map_err(|e| decode_error(source, &e))?;
        let mut image =
            DynamicImage::from_decoder(decoder).map_err(|e| decode_error(source, &e))?;
        image.apply_orientation(orientation);
        let size = [image.width(), image.height()];
        let (channels, texels) = match image {
            DynamicImage::ImageLuma8(i) => (1, Texels::Bytes(i.into_raw())),
            DynamicImage::ImageLuma16(i) => (1, Texels::Words(i.into_raw())),
            DynamicImage::ImageRgb8(i) => (3, Texels::Bytes(i.into_raw())),
            DynamicImage::ImageRgb16(i) => (3, Texels::Words(i.into_raw())),
            // The alpha channel is dropped.
            i @ DynamicImage::ImageLumaA8(_) => (1, Texels::Bytes(i.into_luma8().into_raw())),
            i @ DynamicImage::ImageLumaA16(_) => (1, Texels::Words(i.into_luma16().into_raw())),
            i @ DynamicImage::ImageRgba16(_) => (3, Texels::Words(i.into_rgb16().into_raw())),
            i => (3, Texels::Bytes(i.into_rgb8().into_raw())),
        };
        Ok(Self { size, channels, texels })
    }

    /// Returns width and height in pixels, each at least 1.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Returns the memory of the pixels in bytes.
    pub fn bytes(&self) -> usize {
        match &self.texels {
            Texels::Bytes(t) => t.len(),
            Texels::Words(t) => 2 * t.len(),
        }
    }

    /// Returns the linear light, 0..=1, of the pixel in column `x` and row `y`, counted from the
    /// top. The numbers of the file are interpreted as sRGB levels.
    ///
    /// # Panics
    /// Panics if the image has no such pixel.
    pub fn color(&self, x: u32, y: u32) -> [f32; 3] {
        let index = self.index(x, y);
        let channel = |c: usize| match &self.texels {
            Texels::Bytes(t) => BYTES[usize::from(t[index + c])],
            Texels::Words(t) => WORDS[usize::from(t[index + c])],
        };
        if self.channels == 1 { [channel(0); 3] } else { [channel(0), channel(1), channel(2)] }
    }

    /// Returns the height, 0..=1, that the image has as a height map at the pixel in column `x` and
    /// row `y`, counted from the top. The numbers of the file are interpreted without sRGB
    /// decoding. The height of a coloured pixel is the mean of its channels.
    ///
    /// # Panics
    /// Panics if the image has no such pixel.
    pub fn height(&self, x: u32, y: u32) -> f32 {
        let index = self.index(x, y);
        let level = |i: usize| match &self.texels {
            Texels::Bytes(t) => f32::from(t[i]) / 255.0,
            Texels::Words(t) => f32::from(t[i]) / 65535.0,
        };
        (index..index + self.channels).map(level).sum::<f32>() / self.channels as f32
    }

    fn index(&self, x: u32, y: u32) -> usize {
        assert!(x < self.size[0] && y < self.size[1], "no pixel {x}, {y}");
        (y as usize * self.size[0] as usize + x as usize) * self.channels
    }
}

/// Checks the size of an image of `width` x `height` pixels in the file `source`. Neither side may
/// exceed `max_side`. The number of pixels must be from 1 to `max_pixels`. It must also be at most
/// [`PIXELS_PER_BYTE`] times the length of the file in bytes.
pub(super) fn check_size(
    source: &FileContents,
    [width, height]: [u32; 2],
    max_side: u32,
    max_pixels: u64,
) -> Result<(), AssetError> {
    let pixels = u64::from(width) * u64::from(height);
    let size = format!("the image has {width} x {height} pixels");
    if width.max(height) > max_side || pixels > max_pixels || pixels == 0 {
        let least = if pixels == 0 { "at least one, " } else { "" };
        let expected = format!("{least}at most {max_side} a side and {max_pixels} altogether");
        return Err(source.fault(size, &expected));
    }
    if pixels > PIXELS_PER_BYTE * source.bytes.len() as u64 {
        let found = format!("{size}, more than its {} bytes can hold", source.bytes.len());
        return Err(source.fault(found, "a whole image"));
    }
    Ok(())
}

fn decode_error(source: &FileContents, error: &ImageError) -> AssetError {
    source.fault(format!("the image cannot be read: {error}"), "a PNG or JPEG image")
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Luma, Rgba};
    use std::path::PathBuf;

    fn file(image: DynamicImage, format: ImageFormat) -> FileContents {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        FileContents { path: PathBuf::from("a.png"), bytes: bytes.into_inner() }
    }

    #[test]
    fn pixels_keep_values_of_file() {
        let mut rgba = image::RgbaImage::from_pixel(3, 2, Rgba([255, 0, 0, 7]));
        rgba.put_pixel(2, 1, Rgba([128, 255, 0, 255]));
        let image = Image::parse(&file(rgba.into(), ImageFormat::Png)).unwrap();
        assert_eq!(image.size(), [3, 2]);
        assert_eq!(image.bytes(), 18);
        assert_eq!(image.color(0, 0), [1.0, 0.0, 0.0]);
        assert!((image.color(2, 1)[0] - 0.215_86).abs() < 1e-5);
        assert!((image.height(2, 1) - (128.0 + 255.0) / 765.0).abs() < 1e-6);
        let grey = image::ImageBuffer::from_fn(2, 2, |x, y| Luma([(x + 2 * y) as u16 * 1000]));
        let image = Image::parse(&file(grey.into(), ImageFormat::Png)).unwrap();
        assert_eq!(image.height(1, 1), 3000.0 / 65535.0);
        assert_eq!(image.bytes(), 8);
    }

    #[test]
    fn jpeg_is_decoded() {
        let rgb = image::RgbImage::from_pixel(20, 10, image::Rgb([200, 100, 50]));
        let image = Image::parse(&file(rgb.into(), ImageFormat::Jpeg)).unwrap();
        assert_eq!(image.size(), [20, 10]);
        let [r, g, b] = image.color(10, 5);
        assert!((r - BYTES[200]).abs() < 0.02 && r > g && g > b);
    }

    /// Returns a PNG file of one pixel whose header declares `side` x `side` pixels. The checksum
    /// of the header is valid.
    fn png_declaring(side: u32) -> FileContents {
        let mut source = file(image::GrayImage::new(1, 1).into(), ImageFormat::Png);
        source.bytes[16..20].copy_from_slice(&side.to_be_bytes());
        source.bytes[20..24].copy_from_slice(&side.to_be_bytes());
        let crc = source.bytes[12..29].iter().fold(u32::MAX, |mut crc, byte| {
            crc ^= u32::from(*byte);
            for _ in 0..8 {
                crc = crc >> 1 ^ (0xEDB8_8320 & (crc & 1).wrapping_neg());
            }
            crc
        });
        source.bytes[29..33].copy_from_slice(&(!crc).to_be_bytes());
        source
    }

    #[test]
    fn oversized_image_is_rejected_before_decoding() {
        for (side, words) in
            [(60_000, "60000 x 60000"), (8_000, "more than its"), (u32::MAX >> 1, "cannot be read")]
        {
            let error = Image::parse(&png_declaring(side)).unwrap_err();
            assert!(error.found.contains(words), "{side}: {error}");
        }
        let text = FileContents { path: PathBuf::from("a.png"), bytes: b"no image".to_vec() };
        assert!(Image::parse(&text).unwrap_err().found.contains("neither"));
        let mut half = file(image::GrayImage::new(50, 50).into(), ImageFormat::Png);
        half.bytes.truncate(60);
        assert!(Image::parse(&half).is_err());
    }
}
