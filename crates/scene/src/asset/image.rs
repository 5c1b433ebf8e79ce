//! Images for textures, from PNG and JPEG files.

use crate::asset::error::AssetError;
use crate::asset::file::FileContents;
use crate::asset::memory::ImageMemory;
use crate::value::{Fnv1a64, linear_from_srgb};
use image::codecs::png::PngDecoder;
use image::metadata::Orientation;
use image::{ColorType, DynamicImage, GrayImage, ImageDecoder, ImageError, Limits, RgbImage};
use std::error::Error;
use std::fmt::Display;
use std::io::Cursor;
use std::sync::LazyLock;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Largest number of pixels in a row or column of a texture image.
pub const MAX_SIDE: u32 = 32_768;

/// Largest number of pixels of a texture image: 64 Mi. An image of this size takes at most 402 MB
/// of memory after decoding, and at most 1.1 GB during decoding.
pub const MAX_PIXELS: u64 = 1 << 26;

/// Largest number of pixels per byte of a valid image file. PNG has the most: eight pixels per byte
/// of uncompressed data, times 1032, the largest compression ratio of deflate. A JPEG has at most
/// 512, a Radiance file in the old encoding 8192.
const PIXELS_PER_BYTE: u64 = 8 * 1032;

/// Format of an image file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ImageFormat {
    Png,
    Jpeg,
    Hdr,
    OpenExr,
}

impl ImageFormat {
    /// Determines the format by the first bytes of a file; `None` if it is none of these formats.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        let formats: [(&[u8], Self); 4] = [
            (b"\x89PNG\r\n\x1a\n", Self::Png),
            (b"\xff\xd8\xff", Self::Jpeg),
            (b"#?", Self::Hdr),
            (b"\x76\x2f\x31\x01", Self::OpenExr),
        ];
        formats.into_iter().find_map(|(start, format)| bytes.starts_with(start).then_some(format))
    }
}

/// Levels of the pixels, row by row, with the bit depth of the file: one level per pixel of a grey
/// image, three per pixel of a coloured one.
#[derive(Clone, Debug, PartialEq)]
enum Texels {
    Bytes(Vec<u8>),
    Words(Vec<u16>),
}

/// Texture image: 1 to 6 bytes per pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    size: [u32; 2],
    channels: usize,
    texels: Texels,
    /// Notes for the user about damage of the file: sentences without a period.
    pub notes: Vec<String>,
}

/// Returns the linear light, 0..=1, of the sRGB levels from 0 to `last` (white).
fn linear_table(last: u16) -> Vec<f32> {
    let linear = |level| linear_from_srgb(f64::from(level) / f64::from(last)) as f32;
    (0..=last).map(linear).collect()
}

/// Linear light of the levels of 8 bits.
static BYTES: LazyLock<Vec<f32>> = LazyLock::new(|| linear_table(255));
/// Linear light of the levels of 16 bits.
static WORDS: LazyLock<Vec<f32>> = LazyLock::new(|| linear_table(65535));

impl Image {
    /// Adds size and pixels to `hash`.
    pub fn hash_contents(&self, hash: &mut Fnv1a64) {
        self.size.iter().for_each(|n| hash.update(&n.to_le_bytes()));
        hash.update(&[self.channels as u8]);
        match &self.texels {
            Texels::Bytes(bytes) => hash.update(bytes),
            Texels::Words(words) => words.iter().for_each(|w| hash.update(&w.to_le_bytes())),
        }
    }

    /// Decodes an image file.
    pub(super) fn parse(source: &FileContents) -> Result<Self, AssetError> {
        match ImageFormat::of(&source.bytes) {
            Some(ImageFormat::Png) => decode_png(source),
            Some(ImageFormat::Jpeg) => decode_jpeg(source),
            Some(ImageFormat::Hdr | ImageFormat::OpenExr) | None => {
                Err(source.fault("this is neither a PNG nor a JPEG", EXPECTED))
            }
        }
    }

    /// Returns the memory of the image in a file that begins with `start`. Levels keep their depth.
    pub(super) fn memory(start: &FileContents) -> Result<ImageMemory, AssetError> {
        // With the levels, the decoder has a copy that is turned upright, or without alpha.
        let (size, color, decoding) = match ImageFormat::of(&start.bytes) {
            Some(ImageFormat::Jpeg) => {
                let JpegHeader { size, color, .. } = jpeg_header(start)?;
                // Up to four components have coefficients of 16 bits.
                let bytes = 4 * 2 + u64::from(color.bytes_per_pixel());
                (size, color, bytes * u64::from(size[0]) * u64::from(size[1]))
            }
            Some(ImageFormat::Png | ImageFormat::Hdr | ImageFormat::OpenExr) | None => {
                let decoder = png_decoder(start)?;
                (decoder.dimensions().into(), decoder.color_type(), 2 * decoder.total_bytes())
            }
        };
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let depth = u64::from(color.bytes_per_pixel() / color.channel_count());
        let channels = if color.has_color() { 3 } else { 1 };
        Ok(ImageMemory { size, kept: pixels * depth * channels, decoding })
    }

    /// Converts `image` to a texture image without alpha, turned upright by its EXIF data.
    fn upright(mut image: DynamicImage, exif: Option<&[u8]>) -> Self {
        if let Some(orientation) = exif.and_then(Orientation::from_exif_chunk) {
            image.apply_orientation(orientation);
        }
        let (size, color) = ([image.width(), image.height()], image.color());
        let is_deep = color.bits_per_pixel() > 8 * u16::from(color.channel_count());
        let texels = match (color.has_color(), is_deep) {
            (false, false) => Texels::Bytes(image.into_luma8().into_raw()),
            (false, true) => Texels::Words(image.into_luma16().into_raw()),
            (true, false) => Texels::Bytes(image.into_rgb8().into_raw()),
            (true, true) => Texels::Words(image.into_rgb16().into_raw()),
        };
        let channels = if color.has_color() { 3 } else { 1 };
        Self { size, channels, texels, notes: Vec::new() }
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

    /// Returns the linear light, 0..=1, of the pixel in column `x` and row `y` from the top. The
    /// levels of the file are taken as sRGB.
    ///
    /// # Panics
    /// Panics outside the image.
    pub fn color(&self, x: u32, y: u32) -> [f32; 3] {
        let index = self.index(x, y);
        let channel = |c: usize| match &self.texels {
            Texels::Bytes(t) => BYTES[usize::from(t[index + c])],
            Texels::Words(t) => WORDS[usize::from(t[index + c])],
        };
        if self.channels == 1 { [channel(0); 3] } else { [channel(0), channel(1), channel(2)] }
    }

    /// Returns the height, 0..=1, of the pixel in column `x` and row `y` of a height map. Levels
    /// are taken as linear; the height of a coloured pixel is the mean of its three levels.
    ///
    /// # Panics
    /// Panics outside the image.
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

/// Checks the declared size of an image against the limits and the length of the file.
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
        return Err(source.fault(size, &format!("{least}{}", size_limits(max_side, max_pixels))));
    }
    if pixels > PIXELS_PER_BYTE * source.bytes.len() as u64 {
        let found = format!("{size}, more than its {} bytes can hold", source.bytes.len());
        return Err(source.fault(found, "a whole image"));
    }
    Ok(())
}

fn size_limits(max_side: u32, max_pixels: u64) -> String {
    format!("at most {max_side} a side and {max_pixels} altogether")
}

const EXPECTED: &str = "a PNG or JPEG image";

fn decode_error(source: &FileContents, format: &str, error: impl Display) -> AssetError {
    source.fault(format!("the {format} image cannot be read: {error}"), EXPECTED)
}

/// Reads the header of a PNG file, and checks its size.
fn png_decoder(source: &FileContents) -> Result<PngDecoder<Cursor<&[u8]>>, AssetError> {
    // This is the limit of everything but the pixels, such as an inflated colour profile.
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(1 << 26);
    let decoder = PngDecoder::with_limits(Cursor::new(&source.bytes[..]), limits);
    let decoder = decoder.map_err(|error| png_error(source, &error))?;
    check_size(source, decoder.dimensions().into(), MAX_SIDE, MAX_PIXELS)?;
    Ok(decoder)
}

fn png_error(source: &FileContents, error: &ImageError) -> AssetError {
    // `image` puts the words "Format error decoding Png" before the cause of an error.
    match (error, error.source()) {
        (ImageError::Limits(_), _) => {
            source.fault("the PNG image is too large", &size_limits(MAX_SIDE, MAX_PIXELS))
        }
        (_, Some(cause)) => decode_error(source, "PNG", cause),
        (_, None) => decode_error(source, "PNG", error),
    }
}

/// Decodes a PNG file.
fn decode_png(source: &FileContents) -> Result<Image, AssetError> {
    let mut decoder = png_decoder(source)?;
    let exif = decoder.exif_metadata();
    let exif = exif.map_err(|error| png_error(source, &error))?;
    let image = DynamicImage::from_decoder(decoder).map_err(|error| png_error(source, &error))?;
    Ok(Image::upright(image, exif.as_deref()))
}

/// JPEG file whose header has been read.
struct JpegHeader<'a> {
    decoder: JpegDecoder<ZCursor<&'a [u8]>>,
    size: [u32; 2],
    /// Type of the decoded image: RGB, or grey if the file is grey.
    color: ColorType,
}

/// Reads the header of a JPEG file, and checks its size.
fn jpeg_header(source: &FileContents) -> Result<JpegHeader<'_>, AssetError> {
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(usize::MAX)
        .set_max_height(usize::MAX);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(&source.bytes[..]), options);
    decoder.decode_headers().map_err(|error| decode_error(source, "JPEG", error))?;
    // Sides in a JPEG file have 16 bits. After the headers are read, they are known.
    let (width, height) = decoder.dimensions().unwrap_or_default();
    let size = [width as u32, height as u32];
    check_size(source, size, MAX_SIDE, MAX_PIXELS)?;
    let (space, color) = match decoder.input_colorspace() == Some(ColorSpace::Luma) {
        true => (ColorSpace::Luma, ColorType::L8),
        false => (ColorSpace::RGB, ColorType::Rgb8),
    };
    decoder.set_options(options.jpeg_set_out_colorspace(space));
    Ok(JpegHeader { decoder, size, color })
}

/// Decodes a JPEG file.
fn decode_jpeg(source: &FileContents) -> Result<Image, AssetError> {
    // The decoder takes bytes that are missing for zeros, which are data. No Huffman code consists of
    // ones alone (ITU T.81, annex C): ones before the end make missing data an error.
    let end = source.bytes.windows(2).rposition(|pair| pair == [0xff, 0xd9]);
    let (data, rest) = source.bytes.split_at(end.unwrap_or(source.bytes.len()));
    let bytes = [data, &[0xff, 0].repeat(16), rest].concat();
    let padded = FileContents { path: source.path.clone(), bytes };
    let JpegHeader { mut decoder, size: [width, height], color } = jpeg_header(&padded)?;
    let levels = decoder.decode().map_err(|error| decode_error(source, "JPEG", error))?;
    let image = match color.has_color() {
        false => GrayImage::from_raw(width, height, levels).map(DynamicImage::from),
        true => RgbImage::from_raw(width, height, levels).map(DynamicImage::from),
    };
    let image = image.ok_or_else(|| decode_error(source, "JPEG", "pixels are missing"))?;
    let mut image = Image::upright(image, decoder.exif().map(Vec::as_slice));
    if end.is_none() {
        image.notes.push("the file has no end: the lower part of the image may be damaged".into());
    }
    Ok(image)
}

#[cfg(test)]
mod tests {
    use super::*;
    use png::{BitDepth, ColorType, Info};
    use proptest::prelude::*;
    use std::path::PathBuf;

    fn file(bytes: Vec<u8>) -> FileContents {
        FileContents { path: PathBuf::from("a.png"), bytes }
    }

    /// Returns a PNG file with the header `info`. `data` are its uncompressed rows.
    fn png(info: Info, data: &[u8]) -> FileContents {
        let mut bytes = Vec::new();
        let mut writer = png::Encoder::with_info(&mut bytes, info).unwrap().write_header().unwrap();
        writer.write_image_data(data).unwrap();
        writer.finish().unwrap();
        file(bytes)
    }

    fn info(
        [width, height]: [u32; 2],
        color_type: ColorType,
        bit_depth: BitDepth,
    ) -> Info<'static> {
        let mut info = Info::with_size(width, height);
        (info.color_type, info.bit_depth) = (color_type, bit_depth);
        info
    }

    fn parsed(info: Info, data: &[u8]) -> Image {
        Image::parse(&png(info, data)).unwrap()
    }

    /// Returns the values of all pixels in all channels.
    fn values(image: &Image) -> Vec<u16> {
        match &image.texels {
            Texels::Bytes(t) => t.iter().map(|byte| u16::from(*byte)).collect(),
            Texels::Words(t) => t.clone(),
        }
    }

    #[test]
    fn pixels_keep_values_of_file() {
        let mut rgba = [255, 0, 0, 7].repeat(6);
        rgba[20..].copy_from_slice(&[128, 255, 0, 255]);
        let image = parsed(info([3, 2], ColorType::Rgba, BitDepth::Eight), &rgba);
        assert_eq!(image.size(), [3, 2]);
        assert_eq!(image.bytes(), 18);
        assert_eq!(image.color(0, 0), [1.0, 0.0, 0.0]);
        assert!((image.color(2, 1)[0] - 0.215_86).abs() < 1e-5);
        assert!((image.height(2, 1) - (128.0 + 255.0) / 765.0).abs() < 1e-6);
        let grey: Vec<u8> = [0u16, 1000, 2000, 3000].iter().flat_map(|n| n.to_be_bytes()).collect();
        let image = parsed(info([2, 2], ColorType::Grayscale, BitDepth::Sixteen), &grey);
        assert_eq!(image.height(1, 1), 3000.0 / 65535.0);
        assert_eq!(image.bytes(), 8);
    }

    /// Checks all colour types and bit depths of PNG: the file's values, and those of the image.
    #[test]
    fn all_color_types_keep_their_depth() {
        use ColorType::{Grayscale, GrayscaleAlpha, Indexed, Rgb, Rgba};
        let deep: [u8; 16] = std::array::from_fn(|i| 16 * i as u8 + 1);
        let words = |numbers: &[usize]| -> Vec<u16> {
            numbers.iter().map(|i| u16::from_be_bytes([deep[2 * i], deep[2 * i + 1]])).collect()
        };
        let indexed = vec![255, 0, 1, 9, 8, 7];
        for (color, depth, data, bytes, expected) in [
            (Grayscale, BitDepth::One, &[0b1000_0000][..], 1, vec![255, 0]),
            (Grayscale, BitDepth::Two, &[0b1001_0000], 1, vec![170, 85]),
            (Grayscale, BitDepth::Four, &[0xa3], 1, vec![170, 51]),
            (Grayscale, BitDepth::Eight, &[200, 7], 1, vec![200, 7]),
            (Grayscale, BitDepth::Sixteen, &deep[..4], 2, words(&[0, 1])),
            (GrayscaleAlpha, BitDepth::Eight, &[200, 0, 7, 9], 1, vec![200, 7]),
            (GrayscaleAlpha, BitDepth::Sixteen, &deep[..8], 2, words(&[0, 2])),
            (Indexed, BitDepth::One, &[0b1000_0000], 3, indexed.clone()),
            (Indexed, BitDepth::Two, &[0b0100_0000], 3, indexed.clone()),
            (Indexed, BitDepth::Four, &[0x10], 3, indexed.clone()),
            (Indexed, BitDepth::Eight, &[1, 0], 3, indexed),
            (Rgb, BitDepth::Eight, &[1, 2, 3, 4, 5, 6], 3, vec![1, 2, 3, 4, 5, 6]),
            (Rgb, BitDepth::Sixteen, &deep[..12], 6, words(&[0, 1, 2, 3, 4, 5])),
            (Rgba, BitDepth::Eight, &[1, 2, 3, 0, 4, 5, 6, 0], 3, vec![1, 2, 3, 4, 5, 6]),
            (Rgba, BitDepth::Sixteen, &deep, 6, words(&[0, 1, 2, 4, 5, 6])),
        ] {
            for is_transparent in [false, true] {
                let mut info = info([2, 1], color, depth);
                let has_alpha = [GrayscaleAlpha, Rgba].contains(&color);
                if color == Indexed {
                    info.palette = Some(vec![9, 8, 7, 255, 0, 1].into());
                }
                if is_transparent && !has_alpha {
                    info.trns = Some(vec![0; if color == Rgb { 6 } else { 2 }].into());
                }
                let source = png(info, data);
                let image = Image::parse(&source).unwrap();
                assert_eq!(values(&image), expected, "{color:?} {depth:?}");
                assert_eq!(image.bytes(), 2 * bytes, "{color:?} {depth:?}");
                let memory = Image::memory(&source).unwrap();
                assert_eq!((memory.size, memory.kept), ([2, 1], 2 * bytes as u64), "{color:?}");
            }
        }
    }

    #[test]
    fn interlaced_png_is_decoded() {
        let image =
            Image::parse(&file(include_bytes!("../../../../tests/images/interlaced.png").into()));
        let pixels = (0..7).flat_map(|y| (0..9).map(move |x| [x * 31, y * 42, x * y]));
        assert_eq!(values(&image.unwrap()), pixels.collect::<Vec<_>>().as_flattened());
    }

    const JPEGS: [&[u8]; 4] = [
        include_bytes!("../../../../tests/images/color.jpg"),
        include_bytes!("../../../../tests/images/progressive.jpg"),
        include_bytes!("../../../../tests/images/cmyk.jpg"),
        include_bytes!("../../../../tests/images/grey.jpg"),
    ];

    #[test]
    fn jpeg_is_decoded() {
        // The upper rows of these files are (200, 100, 50) on the left, (50, 100, 200) on the right.
        const LEFT_AND_RIGHT: [[f32; 3]; 2] = [[200.0, 100.0, 50.0], [50.0, 100.0, 200.0]];
        let grey = [[124.0; 3], [97.0; 3]];
        let colors = [LEFT_AND_RIGHT, LEFT_AND_RIGHT, LEFT_AND_RIGHT, grey];
        for (bytes, colors) in JPEGS.into_iter().zip(colors) {
            let image = Image::parse(&file(bytes.into())).unwrap();
            assert_eq!(image.size(), [48, 40]);
            for (x, expected) in [(5, colors[0]), (40, colors[1])] {
                let expected = expected.map(|level| linear_from_srgb(f64::from(level) / 255.0));
                let found = image.color(x, 5).map(f64::from);
                assert!((0..3).all(|c| (found[c] - expected[c]).abs() < 0.03), "{found:?}");
            }
        }
    }

    /// Component of a JPEG file: sampling factors and the value of all its samples.
    type Component = ([u8; 2], u8);

    /// Returns a JPEG file of 40 x 24 pixels of one colour. `adobe` is the transform of an Adobe
    /// segment; `restart` is the number of units between restart markers, 0 for none.
    fn flat_jpeg(components: &[Component], adobe: Option<u8>, restart: u8) -> Vec<u8> {
        let mut bytes = vec![0xff, 0xd8];
        let mut segment = |marker: u8, contents: &[u8]| {
            bytes.extend([0xff, marker, 0, contents.len() as u8 + 2]);
            bytes.extend(contents);
        };
        if let Some(transform) = adobe {
            segment(0xee, &[&b"Adobe\0\x64\0\0\0\0"[..], &[transform]].concat());
        }
        // All divisors are 8, so that the mean of a block is stored as it is.
        segment(0xdb, &[&[0], &[8; 64][..]].concat());
        let ids = || (1..=components.len() as u8).zip(components);
        let frame = ids().flat_map(|(id, ([h, v], _))| [id, h << 4 | v, 0]).collect::<Vec<_>>();
        segment(0xc0, &[&[8, 0, 24, 0, 40, components.len() as u8], &frame[..]].concat());
        // Means have the codes 0000 to 1011 for their numbers of bits, the end of a block has 0.
        let means: Vec<u8> = (0..12).collect();
        segment(
            0xc4,
            &[&[0, 0, 0, 0, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], &means[..]].concat(),
        );
        segment(0xc4, &[0x10, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        segment(0xdd, &[0, restart]);
        let scan = ids().flat_map(|(id, _)| [id, 0]).collect::<Vec<_>>();
        segment(0xda, &[&[components.len() as u8], &scan[..], &[0, 63, 0]].concat());
        // In a scan of one component, a unit is a block whatever the sampling factors are.
        let is_single = components.len() == 1;
        let blocks = |factors: &[u8; 2]| if is_single { [1; 2] } else { *factors };
        let most = |axis: usize| components.iter().map(|(f, _)| blocks(f)[axis]).max().unwrap();
        let units = 40u8.div_ceil(8 * most(0)) * 24u8.div_ceil(8 * most(1));
        let mut bits = String::new();
        for unit in 0..units {
            let is_first = unit == 0 || restart > 0 && unit % restart == 0;
            if is_first && unit > 0 {
                bytes.extend(packed(&std::mem::take(&mut bits)));
                bytes.extend([0xff, 0xd0 + (unit / restart - 1) % 8]);
            }
            for (factors, value) in components {
                let mean = i32::from(*value) - 128;
                let length = 32 - mean.unsigned_abs().leading_zeros();
                let stored = if mean < 0 { mean + (1 << length) - 1 } else { mean };
                let first = format!("{length:04b}{stored:0width$b}0", width = length as usize);
                bits += if is_first { &first } else { "00000" };
                let [h, v] = blocks(factors);
                bits += &"00000".repeat(usize::from(h * v) - 1);
            }
        }
        [bytes, packed(&bits), vec![0xff, 0xd9]].concat()
    }

    /// Packs bits into bytes, with ones at the end and a zero after each byte 0xff.
    fn packed(bits: &str) -> Vec<u8> {
        let padded = format!("{bits:1<width$}", width = bits.len().next_multiple_of(8));
        let byte = |i| u8::from_str_radix(&padded[i..i + 8], 2).unwrap();
        let bytes = (0..padded.len()).step_by(8).map(byte);
        bytes.flat_map(|byte| if byte == 0xff { vec![0xff, 0] } else { vec![byte] }).collect()
    }

    /// Checks colour spaces and subsampling of JPEG, with and without restart markers.
    #[test]
    fn all_color_spaces_of_jpeg_are_decoded() {
        const FULL: [u8; 2] = [1, 1];
        let ycc = |factors| [(factors, 150), (FULL, 100), (FULL, 180)].to_vec();
        // ITU-T T.871, equation 5.
        let from_ycc = [222.9, 122.5, 100.4];
        let rgb = vec![(FULL, 200), (FULL, 100), (FULL, 50)];
        let with_black = |mut components: Vec<Component>| {
            components.push((FULL, 128));
            components
        };
        for (components, adobe, expected) in [
            (vec![(FULL, 77)], None, [77.0; 3]),
            (vec![([2, 2], 77)], None, [77.0; 3]),
            (ycc(FULL), None, from_ycc),
            (ycc([2, 1]), None, from_ycc),
            (ycc([1, 2]), None, from_ycc),
            (ycc([2, 2]), None, from_ycc),
            (ycc([4, 1]), None, from_ycc),
            (ycc(FULL), Some(1), from_ycc),
            (rgb.clone(), Some(0), [200.0, 100.0, 50.0]),
            // Adobe stores 255 less the ink.
            (with_black(rgb), Some(0), [100.4, 50.2, 25.1]),
            (with_black(ycc(FULL)), Some(2), from_ycc.map(|x| (255.0 - x) * 128.0 / 255.0)),
        ] {
            for restart in [0, 1, 2] {
                let case = format!("{components:?} {adobe:?} {restart}");
                let source = file(flat_jpeg(&components, adobe, restart));
                let image = Image::parse(&source).expect(&case);
                let channels = if components.len() == 1 { 1 } else { 3 };
                assert_eq!((image.size(), image.channels), ([40, 24], channels), "{case}");
                assert_eq!(Image::memory(&source).unwrap().kept, 40 * 24 * channels as u64);
                for (i, value) in values(&image).into_iter().enumerate() {
                    let expected = expected[i % channels];
                    assert!((f64::from(value) - expected).abs() < 2.0, "{case}: {i} {value}");
                }
                assert_eq!(image.notes, [] as [String; 0], "{case}");
            }
        }
    }

    #[test]
    fn images_become_upright() {
        // Orientation 6: the first row is the right column, from above.
        let exif = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
        let rows: Vec<u8> = (0..24).collect();
        let mut rotated = info([3, 2], ColorType::Rgba, BitDepth::Eight);
        rotated.exif_metadata = Some(exif.into());
        let image = parsed(rotated, &rows);
        assert_eq!(image.size(), [2, 3]);
        let firsts: Vec<u16> = values(&image).chunks(3).map(|pixel| pixel[0]).collect();
        assert_eq!(firsts, [12, 0, 16, 4, 20, 8]);
        let jpeg = include_bytes!("../../../../tests/images/color.jpg");
        let length = (8 + exif.len()) as u16;
        let segment = [b"\xff\xe1", &length.to_be_bytes()[..], b"Exif\0\0", exif].concat();
        let with_exif = file([&jpeg[..2], &segment, &jpeg[2..]].concat());
        let (upright, rotated) =
            (Image::parse(&file(jpeg.into())).unwrap(), Image::parse(&with_exif).unwrap());
        assert_eq!(rotated.size(), [40, 48]);
        assert_eq!(rotated.color(39, 47), upright.color(47, 0));
        assert_eq!(rotated.color(0, 7), upright.color(7, 39));
    }

    /// Checks JPEG files that are cut off after the header, with nothing, with zeros, and with an end
    /// in place of the rest.
    #[test]
    fn damaged_jpeg_is_noticed() {
        for bytes in JPEGS {
            let whole = Image::parse(&file(bytes.into())).unwrap();
            assert_eq!(whole.notes, [] as [String; 0]);
            let start = bytes.windows(2).rposition(|pair| pair == [0xff, 0xda]).unwrap();
            for kept in (start + 2..bytes.len() - 2).chain([20, bytes.len() / 4]) {
                let part = bytes[..kept].to_vec();
                let zeros = [&part, &vec![0; bytes.len() - kept][..]].concat();
                // The last bytes may be completed by ones. A progressive image is refined by them.
                let is_cut = bytes.len() - kept > 8 && !bytes.windows(2).any(|p| p == [0xff, 0xc2]);
                let ended = is_cut.then(|| [&part[..], &[0xff, 0xd9]].concat());
                for damaged in [part, zeros].into_iter().chain(ended) {
                    let image = Image::parse(&file(damaged));
                    let is_accepted = image.is_ok_and(|image| image.notes.is_empty());
                    assert!(!is_accepted, "{kept} bytes of {}", bytes.len());
                }
            }
            let trailing = [bytes, b"trailing bytes \xff\xda, as of a film"].concat();
            assert_eq!(Image::parse(&file(trailing)), Ok(whole));
        }
    }

    proptest! {
        #[test]
        fn alpha_is_dropped(
            [width, height] in [1..9u32, 1..9u32],
            seed in any::<u64>(),
            is_colored in any::<bool>(),
            is_deep in any::<bool>(),
        ) {
            let channels = if is_colored { 3 } else { 1 };
            let pixel = |i: u64| seed.rotate_left(7 * i as u32).wrapping_mul(i | 1).to_be_bytes();
            let pixels: Vec<[u8; 8]> = (0..u64::from(width * height)).map(pixel).collect();
            let (depth, bytes) = if is_deep { (BitDepth::Sixteen, 2) } else { (BitDepth::Eight, 1) };
            let color = if is_colored { ColorType::Rgba } else { ColorType::GrayscaleAlpha };
            let data: Vec<u8> =
                pixels.iter().flat_map(|pixel| &pixel[..(channels + 1) * bytes]).copied().collect();
            let image = parsed(info([width, height], color, depth), &data);
            let value = |bytes: &[u8]| bytes.iter().fold(0, |n, byte| n << 8 | u16::from(*byte));
            let kept = pixels.iter().flat_map(|pixel| pixel[..channels * bytes].chunks(bytes));
            prop_assert_eq!(values(&image), kept.map(value).collect::<Vec<_>>());
            prop_assert_eq!(image.bytes(), pixels.len() * channels * bytes);
        }
    }

    /// Returns a PNG file of one pixel whose header declares `side` x `side` pixels. The checksum
    /// of the header is valid.
    fn png_declaring(side: u32) -> FileContents {
        let mut source = png(info([1, 1], ColorType::Grayscale, BitDepth::Eight), &[0]);
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
            [(60_000, "60000 x 60000"), (8_000, "more than its"), (u32::MAX >> 1, "too large")]
        {
            let error = Image::parse(&png_declaring(side)).unwrap_err();
            assert!(error.found.contains(words), "{side}: {error}");
        }
        let text = FileContents { path: PathBuf::from("a.png"), bytes: b"no image".to_vec() };
        assert!(Image::parse(&text).unwrap_err().found.contains("neither"));
        let mut half = png(info([50, 50], ColorType::Grayscale, BitDepth::Eight), &[0; 2500]);
        half.bytes.truncate(60);
        assert!(Image::parse(&half).is_err());
    }
}
