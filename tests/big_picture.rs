//! Check of a big picture against single pixels, which are traced without tiles and without
//! regions.

use crate::harness::*;
use std::fs::File;
use std::io::BufReader;
use zerkalo_render::film::TILE_PIXELS;

/// Side of the square picture in pixels.
const SIDE: u32 = 16384;
/// Number of samples of a pixel in each replicate. It is half of `--spp`.
const SAMPLES: u32 = 4;
/// Columns of the picture that are checked in every row.
const COLUMNS: [u32; 16] =
    [0, 1, 15, 16, 1000, 2047, 2048, 5003, 6001, 8191, 8192, 9001, 11003, 13007, 16382, 16383];

/// Returns the displayed pixels of row `y` in the columns of `COLUMNS`, traced without tiles.
fn column_pixels(world: &World<Double>, mix: &LightWeights, y: u32) -> Vec<[u8; 3]> {
    let sampling = sobol(0);
    let tracer = world.camera_tracer(&sampling);
    let scales = world.info.scales.clone();
    let precision = zerkalo_world::Precision::Double;
    let mut film = Film::new(Header { width: 16, height: 1, scales, seed: 0, precision });
    let tile = film.slots(&[0]).remove(0).prepare();
    for replicate in [0, 1] {
        let pixels = COLUMNS.iter().map(|x| (*x, y));
        let mut tracer = tracer.scattered(replicate, pixels);
        let mut add = |packet: std::ops::Range<usize>, radiance: &mut Radiance<Double>| {
            for (lane, pixel) in packet.enumerate() {
                assert!(pixel < TILE_PIXELS);
                for (group, scale) in world.info.scales.iter().enumerate() {
                    let value = radiance.groups[group];
                    let sums = [value.x, value.y, value.z].map(|channel| {
                        let lanes = channel.fixed(*scale);
                        lanes[2 * lane] + lanes[2 * lane + 1]
                    });
                    tile.add_group(replicate, pixel, group, sums);
                }
            }
        };
        (0..SAMPLES).step_by(2).for_each(|first| tracer.radiance_shared::<2>(first, &mut add));
        tile.advance(replicate, SAMPLES);
    }
    let display = Display::default();
    (0..COLUMNS.len()).map(|x| display.to_8()(film.pixel(x, 0, mix))).collect()
}

/// Compares 16 columns (262,144 pixels) of the picture in the file `ZERKALO_PICTURE`. `zerkalo
/// render scenes/features/mirror-room-physical.toml --size 16384x16384 --spp 8 --uniform` writes this file.
#[test]
#[ignore = "needs the picture at ZERKALO_PICTURE, see docs/big-pictures.md"]
fn big_picture_has_the_pixels_of_single_rays() {
    let path = std::env::var_os("ZERKALO_PICTURE").map(PathBuf::from).expect("a picture");
    let scene = sized(shipped("mirror-room-physical.toml"), [SIDE; 2]);
    let world = AnyWorld::compile(&scene, &Options::default());
    let mix = LightWeights { weights: world.info().groups.weights(&scene) };
    let AnyWorld::Double(world) = &world else { panic!("double precision is expected") };
    let decoder = png::Decoder::new(BufReader::new(File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    assert_eq!(reader.info().size(), (SIDE, SIDE));
    let mut different = BTreeMap::new();
    let mut lit = 0;
    for y in 0..SIDE {
        let row = reader.next_row().unwrap().expect("all rows");
        for (x, expected) in COLUMNS.iter().zip(column_pixels(world, &mix, y)) {
            let found = &row.data()[3 * *x as usize..][..3];
            lit += u32::from(expected != [0; 3]);
            if found != expected {
                different.insert((y, *x), (found.to_vec(), expected));
            }
        }
    }
    assert!(different.is_empty(), "{} pixels differ: {different:?}", different.len());
    println!("{} pixels are equal, {lit} of them are not black", SIDE as usize * COLUMNS.len());
}
