//! Errors and bytes of pictures in quadrants, sextants and octants, beside those in half blocks.

use crate::harness::*;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Color;
use std::collections::HashMap;
use zerkalo_terminal::cells::{Blocks, Colors, Oklab, Raster, mosaic_cells, picture_cells};
use zerkalo_terminal::diff::{FrameDiff, TargetFrame};
use zerkalo_terminal::flow::FrameBudget;

const CELLS: Rect = Rect { x: 0, y: 0, width: 64, height: 24 };
/// Width and height of the film, multiples of those of every raster.
const FILM: [usize; 2] = [768, 576];

/// Returns the film in `size` pixels, each the mean of a part of the film.
fn raster(film: &[[f64; 3]], size: [usize; 2]) -> Raster {
    let to_8 = Display::default().to_8();
    let side = [FILM[0] / size[0], FILM[1] / size[1]];
    Raster::from_fn(size[0], size[1], |i| {
        let [x, y] = [i % size[0] * side[0], i / size[0] * side[1]];
        let mut sum = [0.0; 3];
        for n in 0..side[0] * side[1] {
            let pixel = film[(y + n / side[0]) * FILM[0] + x + n % side[0]];
            (0..3).for_each(|c| sum[c] += pixel[c]);
        }
        to_8(sum.map(|sum| sum / (side[0] * side[1]) as f64))
    })
}

/// Returns the RMS distance of `cells` in OKLab and in levels from the film.
fn errors(film: &Raster, cells: &Buffer, blocks: Blocks) -> [f64; 2] {
    let grid = blocks.grid();
    let masks = 0..1usize << (grid[0] * grid[1]);
    let masks: HashMap<_, _> = masks.map(|m| (blocks.glyph(m).to_string(), m)).collect();
    let side = [FILM[0] / usize::from(CELLS.width), FILM[1] / usize::from(CELLS.height)];
    let mut sums = [0.0; 2];
    for (i, pixel) in film.pixels.iter().enumerate() {
        let [x, y] = [i % FILM[0], i / FILM[0]];
        let cell = &cells[((x / side[0]) as u16, (y / side[1]) as u16)];
        let at = [x % side[0] * grid[0] / side[0], y % side[1] * grid[1] / side[1]];
        let is_inside = masks[cell.symbol()] >> (at[1] * grid[0] + at[0]) & 1 == 1;
        let Color::Rgb(r, g, b) = (if is_inside { cell.fg } else { cell.bg }) else { panic!() };
        sums[0] += f64::from(Oklab::of([r, g, b]).distance(Oklab::of(*pixel))).powi(2);
        sums[1] += [r, g, b]
            .iter()
            .zip(pixel)
            .map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2) / 3.0)
            .sum::<f64>();
    }
    sums.map(|sum| (sum / film.pixels.len() as f64).sqrt())
}

/// Measures errors and bytes:
/// `cargo test --release --test program link::blocks -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement"]
fn errors_and_bytes_of_block_characters() {
    for name in ["goblet", "glass-solids", "triptych", "mirror-room", "lamp-and-mirror"] {
        let scene = sized(shipped(&format!("{name}.toml")), FILM.map(|n| n as u32));
        let mut rendering = begin(&scene, 0, Precision::Auto);
        let mut schedule = rendering.schedule(settings(false, 0, spp_stop(64)));
        let threads = pool(2);
        let mut screens = Blocks::ALL.map(|blocks| (blocks, FrameDiff::default(), Vec::new(), 0));
        let mut results = [[0.0; 2]; 4];
        let (mut version, mut done) = (0, false);
        while !done {
            match schedule.next(0.0) {
                Step::Finished(_) => done = true,
                Step::Trace(wave) => {
                    let report = trace(&mut rendering, &wave, &threads);
                    schedule.complete(&wave, &report);
                }
            }
            version += 1;
            let film = picture(&rendering, Replicates::Both);
            let counts = rendering.film.tile(0).map_or([0, 0], |tile| tile.counts);
            let pixels = done.then(|| raster(&film, FILM));
            for (n, (blocks, diff, out, first)) in screens.iter_mut().enumerate() {
                let grid = blocks.grid();
                let raster = raster(&film, [64 * grid[0], 24 * grid[1]]);
                let cells = match blocks {
                    Blocks::Halves => picture_cells(&raster, Colors::True, done),
                    _ => mosaic_cells(&raster, *blocks),
                };
                let target = TargetFrame {
                    cells: &cells,
                    cursor: None,
                    picture: CELLS,
                    uncovered: &[true; 64 * 24],
                    subject: 0,
                    version,
                    samples: f64::from(counts[0] + counts[1]),
                    settled: done,
                };
                let budget = FrameBudget { bytes: 1 << 20, picture: true, refinement: 1 << 20 };
                let now = Duration::from_secs(version);
                for _ in 0..if done { 3 } else { 1 } {
                    diff.frame(&target, now, budget, 0.02, out);
                }
                if *first == 0 {
                    *first = out.len();
                }
                if let Some(pixels) = &pixels {
                    results[n] = errors(pixels, &cells, *blocks);
                }
            }
        }
        for (n, (blocks, _, out, first)) in screens.iter().enumerate() {
            let share = |a: f64, b: f64| a / b;
            println!(
                "{name:17} {:12} OKLab {:.4} ({:.2})   levels {:5.2} ({:.2})   first frame {first:6} B ({:.2})   in all {:7} B ({:.2})",
                blocks.name(),
                results[n][0],
                share(results[n][0], results[0][0]),
                results[n][1],
                share(results[n][1], results[0][1]),
                share(*first as f64, screens[0].3 as f64),
                out.len(),
                share(out.len() as f64, screens[0].2.len() as f64),
            );
        }
    }
}
