//! The film's public interface: order of addition, precision of sums, contents of files.

use crate::harness::*;
use proptest::prelude::*;
use std::fs::File;
use std::io::BufReader;
use zerkalo_render::film::file::FilmFileHeader;
use zerkalo_render::film::testing::header;
use zerkalo_render::film::{SampleFault, TileHandle, lattice_pixels, quantised_8, quantised_16};
use zerkalo_render::image_file::{Depth, ImageOutput};
use zerkalo_world::Precision;

const WIDTH: usize = 37;
const HEIGHT: usize = 21;
const SCALES: [f64; 2] = [268_435_456.0, 1_048_576.0];

fn film_of(width: usize, height: usize, scales: &[f64]) -> Film {
    let scales = scales.to_vec();
    Film::new(Header { width, height, scales, seed: 7, precision: Precision::Single })
}

fn new_film() -> Film {
    film_of(WIDTH, HEIGHT, &SCALES)
}

fn all_tiles(film: &Film) -> Vec<usize> {
    (0..film.tile_count()).collect()
}

fn random_bits(seed: u64) -> u64 {
    Numbers::new(seed).bits()
}

/// Returns sample `index` of a pixel, which depends on the arguments alone. The order of values is
/// `[group][channel]`. About one sample in 2000 is invalid: `None`.
fn sample(x: usize, y: usize, replicate: usize, index: u32) -> Option<[f64; 6]> {
    let seed = ((x * 64 + y) * 2 + replicate) as u64 * 1_000_003 + u64::from(index);
    let value = |c: u64| random_bits(seed * 8 + c) as f64 / 1.8e19;
    (!random_bits(seed).is_multiple_of(2000)).then(|| [0, 1, 2, 3, 4, 5].map(value))
}

fn trace_pixel(tile: &mut Tile, [x0, y0]: [usize; 2], replicate: usize, pixel: usize, index: u32) {
    let (x, y) = (x0 + pixel % TILE, y0 + pixel / TILE);
    match sample(x, y, replicate, index) {
        Some(values) => {
            let fixed = [0, 1, 2, 3, 4, 5].map(|i| (values[i] * SCALES[i / 3]).round() as i64);
            tile.add(replicate, pixel, &fixed);
        }
        None => tile.count_fault(SampleFault::Invalid),
    }
}

/// Adds the samples `range` of one of the two replicates to the tiles in `tiles`, in the order of
/// this list.
fn trace(film: &mut Film, tiles: &[usize], replicate: usize, range: Range<u32>) {
    for slot in film.slots(tiles) {
        trace_slot(slot, replicate, range.clone());
    }
}

fn trace_slot(slot: TileHandle, replicate: usize, range: Range<u32>) {
    let origin = slot.origin;
    let tile = slot.prepare();
    let [width, height] = tile.extent;
    for index in range.clone() {
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            trace_pixel(tile, origin, replicate, y * TILE + x, index);
        }
    }
    tile.advance(replicate, range.len() as u32);
}

/// Adds the first sample of replicate A to each pixel. The pixels are visited in lattices, from
/// coarse to fine. `steps` contains for each lattice the distance between its pixels.
fn trace_lattices(film: &mut Film, steps: &[usize]) {
    let all = all_tiles(film);
    let mut before = 0;
    for step in steps.iter().copied() {
        for slot in film.slots(&all) {
            let origin = slot.origin;
            let tile = slot.prepare();
            let [width, height] = tile.extent;
            for pixel in lattice_pixels(before, step) {
                if pixel % TILE < width && pixel / TILE < height {
                    trace_pixel(tile, origin, 0, pixel, 0);
                }
            }
            tile.set_lattice(step);
        }
        before = step;
    }
}

fn whole() -> Film {
    let mut film = new_film();
    let all = all_tiles(&film);
    trace(&mut film, &all, 0, 0..12);
    trace(&mut film, &all, 1, 0..12);
    film
}

#[test]
fn first_pass_by_lattices_equals_the_first_sample() {
    let mut film = new_film();
    trace_lattices(&mut film, &[16, 8, 2, 1]);
    let mut straight = new_film();
    let all = all_tiles(&straight);
    trace(&mut straight, &all, 0, 0..1);
    assert!(film.bytes() == straight.bytes());
    let mut partial = new_film();
    trace_lattices(&mut partial, &[8]);
    assert!(partial.bytes() != film.bytes());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn order_of_tiles_and_waves_does_not_change_the_bytes(seed in any::<u64>()) {
        let mut film = new_film();
        let mut waves: Vec<_> = all_tiles(&film)
            .into_iter()
            .flat_map(|tile| [(tile, 0, 0..3), (tile, 0, 3..12), (tile, 1, 0..8), (tile, 1, 8..12)])
            .collect();
        waves.sort_by_key(|(tile, replicate, range)| {
            random_bits(seed ^ (*tile as u64 * 100 + *replicate as u64 * 50 + u64::from(range.start)))
        });
        for (tile, replicate, range) in waves {
            trace(&mut film, &[tile], replicate, range);
        }
        prop_assert!(film.bytes() == whole().bytes());
    }
}

#[test]
fn extreme_28_milliard_samples() {
    let scale = 2f64.powi(28);
    let mut film = film_of(1, 1, &[scale]);
    let white = LightWeights { weights: vec![[1.0; 3]] };
    let fixed_point = |value: f64| (value * scale).round() as i64;
    let tile = film.slots(&[0]).remove(0).prepare();
    // Red: 0.7. Green: 0, 0.0014, ..., 1.3986, of mean 0.6993. Blue: 1e-8.
    for k in 0..1000 {
        let values = [0.7, f64::from(k) * 1.4e-3, 1e-8].map(fixed_point);
        tile.add(0, 0, &values.map(|v| v * 999_999));
        let before = tile.pixel(0, 0).to_vec();
        tile.add(0, 0, &values);
        (0..3).for_each(|c| assert_eq!(tile.pixel(0, 0)[c] - before[c], values[c]));
    }
    tile.advance(0, 1_000_000_000);
    assert_eq!(tile.saturated_pixels(), 0);
    let [red, green, blue] = film.pixel(0, 0, &white);
    assert!((red / 0.7 - 1.0).abs() < 1e-8, "{red}");
    assert!((green / 0.6993 - 1.0).abs() < 1e-8, "{green}");
    assert!((blue - 1e-8).abs() <= 0.5 / scale, "{blue}");
    let error = (red / 0.7 - 1.0).abs().max((green / 0.6993 - 1.0).abs());
    report(28, "both", &format!("{error:.0e} off (relative)"));
}

#[test]
fn extreme_28_saturation_is_flagged() {
    // The sum of the radiance of a pixel's samples is limited to (2^63 - 1) / 2^28, about 3.4e10.
    let (scale, white) = (2f64.powi(28), LightWeights { weights: vec![[1.0; 3]] });
    let mut film = film_of(1, 1, &[scale]);
    let tile = film.slots(&[0]).remove(0).prepare();
    tile.advance(0, 50);
    for _ in 0..49 {
        tile.add(0, 0, &[(7e8 * scale) as i64, 0, 0]);
        assert_eq!(tile.saturated_pixels(), 0);
    }
    tile.add(0, 0, &[(7e8 * scale) as i64, 0, 0]);
    assert_eq!((tile.saturated_pixels(), film.saturated_pixels()), (1, 1));
    assert_eq!(film.pixel(0, 0, &white)[0], i64::MAX as f64 / scale / 50.0);
    // The flag of a saturated pixel survives if the film is added to another film, in either order.
    let mut other = film_of(1, 1, &[scale]);
    let tile = other.slots(&[0]).remove(0).prepare();
    tile.add(0, 0, &[1, 0, 0]);
    tile.advance(0, 1);
    let mut sums = [film_of(1, 1, &[scale]), film_of(1, 1, &[scale])];
    sums[0].add(&film).unwrap();
    sums[0].add(&other).unwrap();
    sums[1].add(&other).unwrap();
    sums[1].add(&film).unwrap();
    assert_eq!(sums.each_ref().map(Film::saturated_pixels), [1, 1]);
    assert!(sums[0].bytes() == sums[1].bytes());
    report(28, "both", "saturation flagged");
}

#[test]
fn strength_of_lights_does_not_change_the_bits() {
    let white = LightWeights { weights: vec![[1.0; 3]] };
    let shown = |exponent: i32| {
        let light = 2f64.powi(exponent);
        let scale = 2f64.powi(28) / light;
        let mut film = film_of(16, 16, &[scale]);
        let tile = film.slots(&[0]).remove(0).prepare();
        for pixel in 0..256 {
            let values = sample(pixel, 0, 0, 1).unwrap_or_default();
            tile.add(0, pixel, &[0, 1, 2].map(|c| (values[c] * light * scale).round() as i64));
        }
        tile.advance(0, 1);
        let display = Display { exposure_ev: f64::from(-exponent), tone: Tone::Clip };
        (0..256).map(|p| display.levels(film.pixel(p % 16, p / 16, &white))).collect::<Vec<_>>()
    };
    assert_eq!(shown(0), shown(40));
    assert_eq!(shown(0), shown(-40));
}

fn metadata() -> Vec<(String, String)> {
    [("Software", "zerkalo"), ("Scene", "зеркало.toml"), ("Seed", "7")]
        .map(|(key, value)| (key.to_string(), value.to_string()))
        .to_vec()
}

fn mix() -> LightWeights {
    LightWeights { weights: vec![[1.0, 0.5, 0.25], [0.5, 0.25, 1.5]] }
}

fn write(path: &Path, film: &Film, depth: Depth, display: Display) {
    let header = FilmFileHeader {
        weights: mix(),
        group_names: vec!["lamp".to_string(), "окно-2".to_string()],
        display,
        metadata: metadata(),
        ..header(film)
    };
    ImageOutput::from_path(path).unwrap().write(&header, depth, &mut &*film).unwrap();
}

#[test]
fn png_files_hold_the_displayed_picture() {
    let dir = tempfile::tempdir().unwrap();
    let film = whole();
    for (tone, depth) in [(Tone::Clip, Depth::Eight), (Tone::Neutral, Depth::Sixteen)] {
        let path = dir.path().join("a.png");
        let display = Display { exposure_ev: 0.5, tone };
        write(&path, &film, depth, display);
        let decoder = png::Decoder::new(BufReader::new(File::open(&path).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((frame.width, frame.height), (WIDTH as u32, HEIGHT as u32));
        assert_eq!(frame.color_type, png::ColorType::Rgb);
        let pixels = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
        for (i, (x, y)) in pixels.enumerate() {
            let levels = display.levels(film.pixel(x, y, &mix()));
            for c in 0..3 {
                match depth {
                    Depth::Eight => assert_eq!(bytes[i * 3 + c], quantised_8(levels[c])),
                    Depth::Sixteen => {
                        let offset = (i * 3 + c) * 2;
                        let value = u16::from_be_bytes([bytes[offset], bytes[offset + 1]]);
                        assert_eq!(value, quantised_16(levels[c]));
                    }
                }
            }
        }
        reader.finish().unwrap();
        let info = reader.info();
        assert_eq!(info.srgb, Some(png::SrgbRenderingIntent::RelativeColorimetric));
        let latin = info.uncompressed_latin1_text.iter();
        let mut found: Vec<_> = latin.map(|t| (t.keyword.clone(), t.text.clone())).collect();
        found.extend(info.utf8_text.iter().map(|t| (t.keyword.clone(), t.get_text().unwrap())));
        // Values are padded to a length that does not depend on the picture.
        for (_, value) in &mut found {
            assert_eq!(value.len(), 128, "{value:?}");
            value.truncate(value.trim_end().len());
        }
        found.sort();
        let mut expected = metadata();
        expected.sort();
        assert_eq!(found, expected);
        // Chunks for readers without support of the sRGB chunk.
        let raw = fs::read(&path).unwrap();
        let holds = |data: &[u8]| raw.windows(data.len()).any(|window| window == data);
        assert!(holds(b"gAMA\x00\x00\xb1\x8f") && holds(b"cHRM\x00\x00\x7a\x26\x00\x00\x80\x84"));
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn exr_files_hold_linear_layers() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let mut film = whole();
    trace(&mut film, &[0], 0, 12..15);
    write(&path, &film, Depth::Eight, Display { exposure_ev: 3.0, tone: Tone::Neutral });
    let image = exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
    let layer = &image.layer_data;
    assert_eq!((layer.size.0, layer.size.1), (WIDTH, HEIGHT));
    let names: Vec<_> = layer.channel_data.list.iter().map(|c| c.name.to_string()).collect();
    let mut expected = vec!["count".to_string()];
    for prefix in ["", "A.", "B.", "light_lamp.", "light_____-2."] {
        expected.extend(["R", "G", "B"].map(|color| format!("{prefix}{color}")));
    }
    expected.sort();
    assert_eq!(names, expected);
    let value = |name: &str, x: usize, y: usize| {
        let channel = layer.channel_data.list.iter().find(|c| c.name.eq(name)).unwrap();
        channel.sample_data.value_by_flat_index(y * WIDTH + x)
    };
    for (x, y) in [(0, 0), (36, 20), (17, 3), (2, 19)] {
        for (layer, replicates) in
            [("", Replicates::Both), ("A.", Replicates::A), ("B.", Replicates::B)]
        {
            let row = film.row(y, replicates, &mix());
            for (c, color) in ["R", "G", "B"].into_iter().enumerate() {
                let got = value(&format!("{layer}{color}"), x, y).to_f32();
                assert_eq!(got, row[x][c] as f32, "{layer}{color} at {x} {y}");
            }
        }
        for color in ["R", "G", "B"] {
            let layer_value = |layer: &str| value(&format!("{layer}{color}"), x, y).to_f32();
            let (picture, lamp, window) =
                (layer_value(""), layer_value("light_lamp."), layer_value("light_____-2."));
            assert!((lamp + window - picture).abs() < 1e-6 && lamp > 0.0 && window > 0.0);
        }
        let count = if x < 16 && y < 16 { 27 } else { 24 };
        assert_eq!(value("count", x, y), exr::prelude::Sample::U32(count), "{x} {y}");
    }
    for (key, expected) in metadata() {
        let found = layer
            .attributes
            .other
            .iter()
            .find(|(name, _)| name.bytes() == key.as_bytes())
            .unwrap()
            .1;
        let exr::meta::attribute::AttributeValue::Text(text) = found else { panic!("{found:?}") };
        assert_eq!(text.bytes().trim_ascii_end(), expected.as_bytes(), "{key}");
    }
    let red = image.attributes.chromaticities.unwrap().red;
    assert_eq!((red.0, red.1), (0.64, 0.33));
}
