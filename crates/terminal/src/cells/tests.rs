use crate::cells::*;

const RED: [u8; 3] = [255, 0, 0];
const SKY: [u8; 3] = [90, 140, 220];

fn checker(width: usize, height: usize) -> Raster {
    Raster::from_fn(width, height, |i| {
        if (i % width + i / width).is_multiple_of(2) { RED } else { SKY }
    })
}

#[test]
fn cell_shows_two_pixels() {
    let cells = picture_cells(&checker(3, 4), Colors::True, false);
    assert_eq!((cells.area, cells.content.len()), (Rect::new(0, 0, 3, 2), 6));
    let [red, sky] = [Color::from(RED), Color::from(SKY)];
    let [first, second] = [0, 1].map(|index| PictureCell::from(&cells.content[index]));
    assert_eq!(first, PictureCell { glyph: '▀', fg: red, bg: sky });
    assert_eq!(second, PictureCell { glyph: '▀', fg: sky, bg: red });
}

#[test]
fn equal_halves_are_a_space() {
    let cells = picture_cells(&Raster::from_fn(1, 2, |_| SKY), Colors::True, false);
    let expected = PictureCell { glyph: ' ', fg: Color::Reset, bg: Color::from(SKY) };
    assert_eq!(PictureCell::from(&cells.content[0]), expected);
}

#[test]
fn odd_last_row_is_half_a_cell_or_continues() {
    for colors in Colors::ALL {
        for settled in [false, true] {
            let cells = picture_cells(&checker(2, 3), colors, settled);
            assert_eq!(cells.area, Rect::new(0, 0, 2, 2));
            let row = |cells: &Buffer| {
                cells.content[2..].iter().map(PictureCell::from).collect::<Vec<_>>()
            };
            if matches!(colors, Colors::True | Colors::Indexed) {
                assert!(row(&cells).iter().all(|c| c.bg == Color::Reset && c.glyph == '▀'));
            } else {
                let longer =
                    Raster::from_fn(2, 4, |i| if [0, 3, 4, 6].contains(&i) { RED } else { SKY });
                assert_eq!(
                    row(&cells),
                    row(&picture_cells(&longer, colors, settled)),
                    "{colors:?}"
                );
            }
        }
    }
}

#[test]
fn dark_surfaces_stay_apart_without_colors() {
    // Mirror and wall of the opening scene, on the left and on the right.
    let dark = |i: usize| if i % 8 < 4 { [40, 44, 60] } else { [56, 70, 76] };
    for colors in [Colors::Sixteen, Colors::Mono] {
        let cells = picture_cells(&Raster::from_fn(8, 4, dark), colors, false);
        assert_ne!(PictureCell::from(&cells.content[0]), PictureCell::from(&cells.content[7]));
    }
    let coverage = |raster: &Raster| {
        let cells = picture_cells(raster, Colors::Mono, false);
        [0, 7].map(|i| glyph_shading::coverage(PictureCell::from(&cells.content[i]).glyph))
    };
    let [mirror, wall] = coverage(&Raster::from_fn(8, 4, dark));
    let [dense, sparse] = coverage(&Raster::from_fn(8, 4, dark).negative());
    assert!(mirror < wall && dense >= sparse && dense > wall, "{mirror} {wall} {dense} {sparse}");
}

#[test]
fn any_size_is_converted() {
    for (width, height) in [(0, 0), (0, 3), (3, 0), (1, 1)] {
        for colors in Colors::ALL {
            let cells = picture_cells(&Raster::from_fn(width, height, |_| SKY), colors, true);
            assert_eq!(cells.content.len(), width * height.div_ceil(2));
        }
    }
}

/// Returns the mean OKLab distance between the pixels of an image with gradients and the terminal
/// cells that show it. `settled` is passed to [`picture_cells`].
fn mean_error(colors: Colors, settled: bool) -> f32 {
    let (width, height) = (64, 64);
    let raster = Raster::from_fn(width, height, |i| {
        let (x, y) = (i % width * 4, i / width * 4);
        [x as u8, y as u8, (255 - (x + y) / 2) as u8]
    });
    let cells = picture_cells(&raster, colors, settled);
    let mut sum = 0.0;
    for (i, rgb) in raster.pixels.iter().enumerate() {
        let cell = &cells[((i % width) as u16, (i / width / 2) as u16)];
        sum += PictureCell::from(cell).quarters()[i / width % 2 * 2].distance(Oklab::of(*rgb));
    }
    sum / raster.pixels.len() as f32
}

#[test]
fn error_of_fewer_colors_is_bounded() {
    assert_eq!(mean_error(Colors::True, false), 0.0);
    let errors = [
        mean_error(Colors::Indexed, false),
        mean_error(Colors::Indexed, true),
        mean_error(Colors::Sixteen, false),
    ];
    for (error, most) in errors.into_iter().zip([0.045, 0.05, 0.055]) {
        assert!(error > 0.01 && error < most, "{errors:?}");
    }
}

/// Measures the time of the conversion of a picture to terminal cells:
/// `cargo test --release -p zerkalo-terminal conversion_time -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement"]
fn picture_conversion_time() {
    let (width, height) = (160, 180);
    let convert = |name: &str, convert: &dyn Fn(&Raster) -> Buffer, grid: [usize; 2]| {
        let (width, height) = (width * grid[0], height * grid[1] / 2);
        let mut best = f64::INFINITY;
        for seed in 0..20 {
            let raster = Raster::from_fn(width, height, |i| {
                let noise = (i.wrapping_mul(2_654_435_761).wrapping_add(seed) >> 7) as u8 / 8;
                [
                    noise.wrapping_add((i % width) as u8),
                    noise.wrapping_add((i / width) as u8),
                    100 + noise,
                ]
            });
            let start = std::time::Instant::now();
            std::hint::black_box(convert(&raster));
            best = best.min(start.elapsed().as_secs_f64());
        }
        println!("{name}: {:.2} ms", 1e3 * best);
    };
    for blocks in Blocks::ALL {
        convert(blocks.name(), &|raster| mosaic_cells(raster, blocks), blocks.grid());
    }
    for colors in Colors::ALL {
        for settled in [false, true] {
            let name = format!("{colors:?} settled {settled}");
            convert(&name, &|raster| picture_cells(raster, colors, settled), [1, 2]);
        }
    }
}
