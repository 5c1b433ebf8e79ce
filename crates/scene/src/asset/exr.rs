//! OpenEXR files of environments. The channels are chosen, the display window is cut out; the primaries
//! are left to the caller.

use crate::asset::error::AssetError;
use crate::asset::file::FileContents;
use crate::asset::image::check_size;
use crate::asset::primaries;
use crate::asset::radiance_map::{MAX_MAP_PIXELS, MAX_MAP_SIDE};
use crate::value::truncated;
use exr::math::Vec2;
use exr::meta::BlockDescription;
use exr::meta::attribute::{Chromaticities, EnvironmentMap, Text};
use exr::meta::header::Header;
use exr::prelude::traits::*;
use glam::DMat3;
use std::collections::HashMap;
use std::io::Cursor;

const EXPECTED: &str = "one layer that is not deep, with the channels R, G and B, or Y alone, as \
                        `exrheader` shows them";

/// OpenEXR file whose headers have been read.
pub struct ExrFile {
    /// Width and height of the display window in pixels.
    pub size: [u32; 2],
    /// Memory \[bytes\] of a row of blocks, which the decoder allocates before it reads them.
    pub block_bytes: u64,
    channels: Channels,
    /// Position of the layer in the display window.
    offset: Vec2<i32>,
    /// Matrix to linear sRGB from the primaries of the file; `None` if they are those of sRGB.
    pub srgb_from_primaries: Option<DMat3>,
}

/// Names of the channels of an image: red, green and blue, or grey.
#[derive(Clone, Debug, PartialEq)]
enum Channels {
    Colors([Text; 3]),
    Grey(Text),
}

impl ExrFile {
    /// Reads the headers, and checks all sizes: the decoder allocates a block of rows before it reads
    /// it.
    pub fn parse(source: &FileContents) -> Result<Self, AssetError> {
        let reader = exr::block::read(Cursor::new(&source.bytes[..]), false).map_err(|error| {
            source.fault(format!("the header cannot be read: {error}"), EXPECTED)
        })?;
        let limit = |size: Vec2<usize>| {
            let size = [size.0, size.1].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
            check_size(source, size, MAX_MAP_SIDE, MAX_MAP_PIXELS).map(|()| size)
        };
        for header in reader.headers() {
            limit(header.layer_size)?;
        }
        let (layer, channels) = choose(reader.headers()).ok_or_else(|| {
            let names = reader.headers().iter().flat_map(|header| &header.channels.list);
            let names = names.map(|channel| truncated(&channel.name.to_string()));
            let names: Vec<_> = names.take(12).collect();
            let found = format!("no layer has one set of R, G and B: {}", names.join(", "));
            source.fault(found, EXPECTED)
        })?;
        let header = &reader.headers()[layer];
        let window = header.shared_attributes.display_window;
        let size = limit(window.size)?;
        if header.own_attributes.environment_map == Some(EnvironmentMap::Cube) {
            let expected = "an equirectangular image, as `exrenvmap -latlong` writes it";
            return Err(source.fault("it is a cube map", expected));
        }
        let srgb_from_primaries = match header.shared_attributes.chromaticities {
            Some(Chromaticities { red, green, blue, white }) => {
                primaries::srgb_from([red, green, blue, white].map(|Vec2(x, y)| [x, y]))
                    .map_err(|found| source.fault(found, "chromaticities such as those of sRGB"))?
            }
            None => None,
        };
        Ok(Self {
            size,
            block_bytes: block_bytes(header),
            channels,
            offset: header.own_attributes.layer_position - window.position,
            srgb_from_primaries,
        })
    }

    /// Decodes the pixels of the display window, row by row from the top. Pixels outside the layer
    /// are black.
    pub fn pixels(&self, source: &FileContents) -> Result<Vec<[f32; 3]>, AssetError> {
        let ([width, height], offset) = (self.size.map(|n| n as usize), self.offset);
        let set = move |pixels: &mut Vec<[f32; 3]>, position: Vec2<usize>, color: [f32; 3]| {
            let Vec2(x, y) = position.to_i32() + offset;
            if let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y))
                && x < width
                && y < height
            {
                pixels[y * width + x] = color;
            }
        };
        let black = move || vec![[0.0; 3]; width * height];
        let bytes = Cursor::new(&source.bytes[..]);
        let layer = read().no_deep_data().largest_resolution_level().specific_channels();
        let image = match self.channels.clone() {
            Channels::Colors([r, g, b]) => layer
                .required(r)
                .required(g)
                .required(b)
                .collect_pixels(move |_, _| black(), move |p, at, (r, g, b)| set(p, at, [r, g, b]))
                .first_valid_layer()
                .all_attributes()
                .from_buffered(bytes)
                .map(|image| image.layer_data.channel_data.pixels),
            Channels::Grey(y) => layer
                .required(y)
                .collect_pixels(move |_, _| black(), move |p, at, (y,)| set(p, at, [y; 3]))
                .first_valid_layer()
                .all_attributes()
                .from_buffered(bytes)
                .map(|image| image.layer_data.channel_data.pixels),
        };
        image.map_err(|error| {
            let found = format!("the OpenEXR image cannot be read: {error}");
            source.fault(found, "a whole image that is not deep")
        })
    }
}

/// Chooses the channels R, G and B of the first layer that has them, or else Y. Returns the number of
/// the layer, too.
fn choose(headers: &[Header]) -> Option<(usize, Channels)> {
    let layers = || headers.iter().enumerate().filter(|(_, header)| !header.deep);
    let colors = |(layer, header)| {
        find(header, ["r", "g", "b"], &[]).map(|names| (layer, Channels::Colors(names)))
    };
    let grey = |(layer, header): (usize, &Header)| {
        // Beside channels of other colour spaces, or components of vectors, Y is not grey.
        let [name] = find(header, ["y"], &["x", "z", "ry", "by"])?;
        // The decoder takes the first layer that has a channel of this name.
        let has_name = |header: &Header| header.channels.find_index_of_channel(&name).is_some();
        let is_first = !headers[..layer].iter().any(has_name);
        is_first.then_some((layer, Channels::Grey(name)))
    };
    layers().find_map(colors).or_else(|| layers().find_map(grey))
}

/// Returns the channels with the given letters. Their names have no prefix, or one such as
/// `ViewLayer.Combined.` that is the only one in the layer. With this prefix there is no channel
/// with a letter in `excluded`. Case has no influence.
fn find<const N: usize>(
    header: &Header,
    letters: [&str; N],
    excluded: &[&str],
) -> Option<[Text; N]> {
    let mut names = HashMap::new();
    for channel in &header.channels.list {
        names.entry(channel.name.to_string().to_lowercase()).or_insert(&channel.name);
    }
    let get = |prefix: &str, letter: &str| names.get(&format!("{prefix}{letter}"));
    let with_prefix = |prefix: &str| {
        let is_alone = excluded.iter().all(|letter| get(prefix, letter).is_none());
        let channels =
            letters.iter().map(|letter| get(prefix, letter).map(|name| Text::clone(name)));
        channels.collect::<Option<Vec<_>>>().filter(|_| is_alone)?.try_into().ok()
    };
    let prefixes = names.keys().filter_map(|name| name.strip_suffix(letters[0]));
    let mut others = prefixes.filter(|prefix| prefix.ends_with('.')).filter_map(with_prefix);
    with_prefix("").or_else(|| others.next().filter(|_| others.next().is_none()))
}

/// Returns the memory \[bytes\] of a row of blocks after decoding.
fn block_bytes(header: &Header) -> u64 {
    let Vec2(width, height) = header.layer_size;
    let rows = match header.blocks {
        BlockDescription::ScanLines => header.compression.scan_lines_per_block(),
        BlockDescription::Tiles(tiles) => tiles.tile_size.1,
    };
    let pixels = width as u64 * rows.min(height) as u64;
    pixels * header.channels.bytes_per_pixel as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::compression::Compression::{
        B44, B44A, DWAA, DWAB, PIZ, PXR24, RLE, Uncompressed, ZIP1, ZIP16,
    };
    use exr::image::{
        AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image as Picture, Layer, Levels,
    };
    use exr::math::RoundingMode;
    use exr::meta::attribute::{IntegerBounds, LineOrder};
    use exr::meta::header::{ImageAttributes, LayerAttributes};
    use exr::prelude::f16;
    use std::path::PathBuf;

    const SIZE: (usize, usize) = (70, 37);

    fn source(bytes: Vec<u8>) -> FileContents {
        FileContents { path: PathBuf::from("sky.exr"), bytes }
    }

    /// Returns the values of channel `number`, which half floats hold exactly.
    fn values(number: usize) -> impl Iterator<Item = f32> {
        (0..SIZE.0 * SIZE.1).map(move |i| ((i * (number + 3)) % 97) as f32 * 0.25 + 1.0)
    }

    fn layer(names: &[&str], encoding: Encoding) -> Layer<AnyChannels<FlatSamples>> {
        let samples = |number| FlatSamples::F32(values(number).collect());
        let channels = names.iter().enumerate().map(|(i, name)| AnyChannel::new(*name, samples(i)));
        let attributes = LayerAttributes::named(names[0]);
        Layer::new(SIZE, attributes, encoding, AnyChannels::sort(channels.collect()))
    }

    fn bytes_of(layers: Vec<Layer<AnyChannels<FlatSamples>>>) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let window = IntegerBounds::from_dimensions(SIZE);
        let picture = Picture::from_layers(ImageAttributes::new(window), layers);
        picture.write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    fn read_pixels(bytes: Vec<u8>) -> Result<Vec<[f32; 3]>, AssetError> {
        let source = source(bytes);
        ExrFile::parse(&source)?.pixels(&source)
    }

    /// Checks all sample types in all compressions, blocks and line orders. B44 and DWA are lossy: B44
    /// has at least 6 bits in a block of 4 x 4 pixels whose values are up to 25; DWA follows its level
    /// 45, and these values are noise.
    #[test]
    fn all_encodings_are_decoded() {
        let tiles = Blocks::Tiles(Vec2(16, 9));
        let lossless = [Uncompressed, RLE, ZIP1, ZIP16, PIZ, PXR24].map(|method| (method, 0.0));
        let lossy = [B44, B44A, DWAA(None), DWAB(None)].map(|method| (method, 2.0));
        for (compression, tolerance) in lossless.into_iter().chain(lossy) {
            for blocks in [Blocks::ScanLines, tiles] {
                for line_order in [LineOrder::Increasing, LineOrder::Decreasing] {
                    for half in [true, false] {
                        let encoding = Encoding { compression, blocks, line_order };
                        let mut layer = layer(&["R", "G", "B", "A"], encoding);
                        for channel in &mut layer.channel_data.list {
                            if half {
                                let values = channel.sample_data.values_as_f32();
                                let values = values.map(f16::from_f32).collect();
                                channel.sample_data = FlatSamples::F16(values);
                            }
                        }
                        let case = format!("{compression:?} {blocks:?} {line_order:?} {half}");
                        let pixels = read_pixels(bytes_of(vec![layer])).expect(&case);
                        for c in 0..3 {
                            for (pixel, expected) in pixels.iter().zip(values(c)) {
                                let difference = (pixel[c] - expected).abs();
                                assert!(difference <= tolerance, "{case}: {difference}");
                            }
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn largest_level_and_unsigned_integers_are_decoded() {
        let encoding = Encoding { blocks: Blocks::Tiles(Vec2(16, 9)), ..Encoding::SMALL_LOSSLESS };
        let level = |number, level: usize| {
            let [width, height] = [SIZE.0, SIZE.1].map(|n| (n >> level).max(1));
            FlatSamples::F32(values(number).take(width * height).collect())
        };
        let channels = ["R", "G", "B"].into_iter().enumerate().map(|(i, name)| {
            let level_data = (0..7).map(|n| level(i, n)).collect();
            AnyChannel::new(name, Levels::Mip { rounding_mode: RoundingMode::Down, level_data })
        });
        let channels = AnyChannels::sort(channels.collect());
        let mip = Layer::new(SIZE, LayerAttributes::default(), encoding, channels);
        let mut bytes = Cursor::new(Vec::new());
        Picture::from_layer(mip).write().to_buffered(&mut bytes).unwrap();
        let mut whole = layer(&["R", "G", "B"], Encoding::SMALL_LOSSLESS);
        for channel in &mut whole.channel_data.list {
            let numbers = channel.sample_data.values_as_f32().map(|x| (4.0 * x) as u32).collect();
            channel.sample_data = FlatSamples::U32(numbers);
        }
        for (bytes, factor) in [(bytes.into_inner(), 1.0), (bytes_of(vec![whole]), 4.0)] {
            let pixels = read_pixels(bytes).unwrap();
            for c in 0..3 {
                assert!(values(c).zip(&pixels).all(|(x, pixel)| pixel[c] == factor * x), "{c}");
            }
        }
    }

    #[test]
    fn channels_are_chosen_by_their_names() {
        for (layers, expected) in [
            (&[&["R", "G", "B"][..]][..], Ok([0, 1, 2])),
            (&[&["r", "g", "b"]], Ok([0, 1, 2])),
            (&[&["Y"]], Ok([0, 0, 0])),
            (&[&["Y", "A"]], Ok([0, 0, 0])),
            (&[&["V.Combined.R", "V.Combined.G", "V.Combined.B"]], Ok([0, 1, 2])),
            (&[&["V.Depth.Z", "V.Combined.R", "V.Combined.G", "V.Combined.B"]], Ok([1, 2, 3])),
            (&[&["d.R", "d.G", "V.Combined.R", "V.Combined.G", "V.Combined.B"]], Ok([2, 3, 4])),
            (&[&["a.r", "a.g", "a.b", "R", "G", "B"]], Ok([3, 4, 5])),
            (&[&["X", "Y", "Z"], &["R", "G", "B"]], Ok([0, 1, 2])),
            (&[&["Z"], &["l.Y"]], Ok([0, 0, 0])),
            (&[&["X", "Y", "Z"], &["Y"]], Err("no layer has one set")),
            (&[&["X", "Y", "Z"]], Err("no layer has one set")),
            (&[&["Y", "RY", "BY"]], Err("R, G and B: BY, RY, Y")),
            (&[&["R", "G"]], Err("R, G and B: G, R")),
            (&[&["a.R", "a.G", "b.B"]], Err("no layer has")),
            (&[&["a.R", "a.G", "a.B", "b.R", "b.G", "b.B"]], Err("R, G and B: a.B, a.G, a.R, b.B")),
        ] {
            let pictures = layers.iter().map(|names| layer(names, Encoding::SMALL_LOSSLESS));
            let pixels = read_pixels(bytes_of(pictures.collect()));
            match (pixels, expected) {
                (Ok(pixels), Ok(numbers)) => {
                    assert_eq!(pixels[1], numbers.map(|n| values(n).nth(1).unwrap()), "{layers:?}");
                    assert_eq!(pixels.len(), SIZE.0 * SIZE.1);
                }
                (Err(error), Err(words)) => assert!(error.found.contains(words), "{error}"),
                (found, _) => panic!("{layers:?}: {:?}", found.map(|pixels| pixels[0])),
            }
        }
    }

    /// Returns a picture of one layer. `change` changes its attributes.
    fn picture_with(
        size: (usize, usize),
        color: [f32; 3],
        change: impl Fn(&mut ImageAttributes, &mut LayerAttributes),
    ) -> Vec<u8> {
        let samples = |x| FlatSamples::F32(vec![x; size.0 * size.1]);
        let channels = ["R", "G", "B"].into_iter().zip(color);
        let channels = channels.map(|(name, x)| AnyChannel::new(name, samples(x))).collect();
        let window = IntegerBounds::from_dimensions(size);
        let (mut image, mut own) = (ImageAttributes::new(window), LayerAttributes::default());
        change(&mut image, &mut own);
        let layer = Layer::new(size, own, Encoding::UNCOMPRESSED, AnyChannels::sort(channels));
        let mut bytes = Cursor::new(Vec::new());
        Picture::new(image, layer).write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn chromaticities_are_converted() {
        let chromaticities = |red, green| Chromaticities {
            red,
            green,
            blue: Vec2(0.15, 0.06),
            white: Vec2(0.3127, 0.329),
        };
        let read = |red, green| {
            let bytes = picture_with((1, 1), [8.0, 2.0, 1.0], |image, _| {
                image.chromaticities = Some(chromaticities(red, green));
            });
            let map = crate::asset::RadianceMap::parse(&source(bytes))?;
            let ahead = zerkalo_kernel::lanes::Vec3::<f64>::of([0.0, 0.0, -1.0]);
            Ok::<_, AssetError>(map.radiance(ahead, true).0.lane(0))
        };
        assert_eq!(read(Vec2(0.64, 0.33), Vec2(0.3, 0.6)), Ok([8.0, 2.0, 1.0]));
        let exchanged = read(Vec2(0.3, 0.6), Vec2(0.64, 0.33)).unwrap();
        let expected = [2.0, 8.0, 1.0];
        assert!((0..3).all(|c| (exchanged[c] - expected[c]).abs() < 1e-5), "{exchanged:?}");
        let error = read(Vec2(0.3, 0.6), Vec2(0.3, 0.6)).unwrap_err().to_string();
        assert!(error.contains("determine no colours. Expected chromaticities such as"), "{error}");
    }

    #[test]
    fn cube_maps_are_refused() {
        let cube = picture_with((4, 24), [1.0; 3], |_, own| {
            own.environment_map = Some(EnvironmentMap::Cube);
        });
        let error = read_pixels(cube).unwrap_err().to_string();
        let words = "it is a cube map. Expected an equirectangular image, as `exrenvmap -latlong`";
        assert!(error.contains(words), "{error}");
        let flat = picture_with((4, 2), [1.0; 3], |_, own| {
            own.environment_map = Some(EnvironmentMap::LatitudeLongitude);
        });
        assert_eq!(read_pixels(flat), Ok(vec![[1.0; 3]; 8]));
    }
}
