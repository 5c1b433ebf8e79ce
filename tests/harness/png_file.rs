//! PNG files that tests write and read.

use super::*;
use png::{BitDepth, ColorType, Decoder, Encoder, Transformations};
use std::io::Cursor;

/// Image of red, green and blue levels from 0 to 255.
#[derive(Clone, Debug)]
pub struct RgbImage {
    pub width: u32,
    pub height: u32,
    /// Pixels of the image, row by row from the top.
    pub pixels: Vec<[u8; 3]>,
}

impl RgbImage {
    /// Creates an image from a function of column and row. The rows are made from the top, each
    /// from left to right.
    pub fn from_fn(width: u32, height: u32, mut pixel: impl FnMut(u32, u32) -> [u8; 3]) -> Self {
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Self { width, height, pixels: places.map(|(x, y)| pixel(x, y)).collect() }
    }

    /// Returns the pixel in column `x` and row `y`, counted from the top.
    pub fn pixel(&self, x: u32, y: u32) -> [u8; 3] {
        assert!(x < self.width);
        self.pixels[(y * self.width + x) as usize]
    }

    /// Writes the image to a PNG file.
    pub fn save(&self, path: &Path) {
        PngImage::from(self).save(path);
    }
}

/// Contents of a PNG file.
#[derive(Clone, Debug)]
pub struct PngImage {
    pub width: u32,
    pub height: u32,
    pub color: ColorType,
    pub depth: BitDepth,
    /// Levels of all channels, row by row from the top. Levels of 16 bits are two bytes, the higher
    /// one first.
    pub levels: Vec<u8>,
}

impl PngImage {
    /// Reads a PNG file. Palettes become colours, and levels have 8 or 16 bits.
    pub fn open(path: &Path) -> Result<Self, String> {
        let bytes = fs::read(path).map_err(|error| error.to_string())?;
        let mut decoder = Decoder::new(Cursor::new(bytes));
        decoder.set_transformations(Transformations::EXPAND);
        let mut reader = decoder.read_info().map_err(|error| error.to_string())?;
        let mut levels = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut levels).map_err(|error| error.to_string())?;
        let (color, depth) = (frame.color_type, frame.bit_depth);
        Ok(Self { width: frame.width, height: frame.height, color, depth, levels })
    }

    /// Returns the bytes of a PNG file with this image.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(self.color);
        encoder.set_depth(self.depth);
        encoder.write_header().unwrap().write_image_data(&self.levels).unwrap();
        bytes
    }

    /// Writes the image to a PNG file.
    pub fn save(&self, path: &Path) {
        fs::write(path, self.bytes()).unwrap();
    }
}

impl From<&RgbImage> for PngImage {
    fn from(image: &RgbImage) -> Self {
        Self {
            width: image.width,
            height: image.height,
            color: ColorType::Rgb,
            depth: BitDepth::Eight,
            levels: image.pixels.as_flattened().to_vec(),
        }
    }
}
