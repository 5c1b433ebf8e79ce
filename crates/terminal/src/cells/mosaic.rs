//! Cells of four, six or eight pixels in two colours: quadrants, sextants and octants.

use crate::cells::Raster;
use crate::cells::oklab::Oklab;
use ratatui::buffer::{Buffer, Cell};
use ratatui::layout::Rect;
use ratatui::style::Color;
use std::collections::HashMap;
use std::sync::LazyLock;

/// Block characters that show the pixels of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Blocks {
    #[default]
    Halves,
    /// 2 x 2 pixels (Unicode 3.2).
    Quadrants,
    /// 2 x 3 pixels (Unicode 13).
    Sextants,
    /// 2 x 4 pixels (Unicode 16).
    Octants,
}

impl Blocks {
    pub const ALL: [Self; 4] = [Self::Halves, Self::Quadrants, Self::Sextants, Self::Octants];

    /// Returns the name for users.
    pub fn name(self) -> &'static str {
        match self {
            Self::Halves => "half blocks",
            Self::Quadrants => "quadrants",
            Self::Sextants => "sextants",
            Self::Octants => "octants",
        }
    }

    /// Returns columns and rows of pixels in a cell.
    pub fn grid(self) -> [usize; 2] {
        match self {
            Self::Halves => [1, 2],
            Self::Quadrants => [2, 2],
            Self::Sextants => [2, 3],
            Self::Octants => [2, 4],
        }
    }

    /// Returns the character whose foreground covers the pixels in `mask`. Bit n is pixel n, row by
    /// row.
    pub fn glyph(self, mask: usize) -> char {
        match self {
            Self::Halves => [' ', '▀', '▄', '█'][mask],
            Self::Quadrants => QUADRANTS[mask],
            // Columns are half blocks, which the block of sextants leaves out.
            Self::Sextants => match mask {
                0 => ' ',
                0b01_0101 => '▌',
                0b10_1010 => '▐',
                0b11_1111 => '█',
                _ => nth(
                    0x1fb00,
                    mask - 1
                        - [0b01_0101, 0b10_1010]
                            .map(|n| usize::from(mask > n))
                            .iter()
                            .sum::<usize>(),
                ),
            },
            Self::Octants => older_octant(mask).unwrap_or_else(|| {
                nth(0x1cd00, (0..mask).filter(|mask| older_octant(*mask).is_none()).count())
            }),
        }
    }
}

/// Quadrants by mask.
const QUADRANTS: [char; 16] =
    [' ', '▘', '▝', '▀', '▖', '▌', '▞', '▛', '▗', '▚', '▐', '▜', '▄', '▙', '▟', '█'];

/// Masks of octants that are older characters, besides quadrants.
const OLDER_OCTANTS: [(usize, char); 10] = [
    (0x01, '\u{1cea8}'),
    (0x02, '\u{1ceab}'),
    (0x03, '\u{1fb82}'),
    (0x14, '\u{1fbe6}'),
    (0x28, '\u{1fbe7}'),
    (0x3f, '\u{1fb85}'),
    (0x40, '\u{1cea3}'),
    (0x80, '\u{1cea0}'),
    (0xc0, '▂'),
    (0xfc, '▆'),
];

/// Returns the character of a mask of octants unless it is in the block of octants.
fn older_octant(mask: usize) -> Option<char> {
    // Each row of a quadrant is two rows of octants.
    let octants = |quadrants: usize| (quadrants & 3 | (quadrants & 12) << 2) * 0b101;
    let quadrant = (0..16).find(|quadrants| octants(*quadrants) == mask);
    let older = || OLDER_OCTANTS.iter().find(|(older, _)| *older == mask).map(|(_, glyph)| *glyph);
    quadrant.map(|quadrant| QUADRANTS[quadrant]).or_else(older)
}

fn nth(first: u32, n: usize) -> char {
    char::from_u32(first + n as u32).unwrap_or(' ')
}

/// Properties of a block character.
pub struct Shape {
    /// Share of the upper left, upper right, lower left and lower right quarter of the cell that the
    /// foreground covers.
    pub quarters: [f32; 4],
    /// Character that covers the other pixels.
    pub complement: String,
}

/// All block characters.
static SHAPES: LazyLock<HashMap<char, Shape>> = LazyLock::new(|| {
    let shape = |blocks: Blocks, mask: usize| {
        let [columns, rows] = blocks.grid();
        let overlap = |at: usize, parts: usize, half: usize| {
            let [start, end] = [at, at + 1].map(|n| 2.0 * n as f32 / parts as f32 - half as f32);
            end.min(1.0) - start.max(0.0)
        };
        let quarters = std::array::from_fn(|quarter| {
            let pixels = (0..columns * rows).filter(|pixel| mask >> pixel & 1 == 1);
            let share = |pixel: usize| {
                overlap(pixel % columns, columns, quarter % 2).max(0.0)
                    * overlap(pixel / columns, rows, quarter / 2).max(0.0)
            };
            pixels.map(share).sum()
        });
        let all = (1 << (columns * rows)) - 1;
        let complement = blocks.glyph(all ^ mask).to_string();
        (blocks.glyph(mask), Shape { quarters, complement })
    };
    let all = |blocks: Blocks| {
        (0..1 << blocks.grid().iter().product::<usize>()).map(move |mask| (blocks, mask))
    };
    Blocks::ALL.into_iter().flat_map(all).map(|(blocks, mask)| shape(blocks, mask)).collect()
});

/// Returns the properties of a block character; `None` for any other character.
pub fn shape(glyph: char) -> Option<&'static Shape> {
    SHAPES.get(&glyph)
}

/// Largest OKLab distance from the mean at which the pixels of a cell become one colour.
const FLAT: f32 = 0.005;
/// Number of iterations of the two means.
const MEANS: usize = 3;

/// Converts `raster` to cells in 24-bit colours with `blocks`, each in the two colours of least
/// squared error in OKLab. Cells at the edge continue the last pixels of the raster.
pub fn mosaic_cells(raster: &Raster, blocks: Blocks) -> Buffer {
    match blocks {
        Blocks::Halves => cells::<2>(raster, blocks),
        Blocks::Quadrants => cells::<4>(raster, blocks),
        Blocks::Sextants => cells::<6>(raster, blocks),
        Blocks::Octants => cells::<8>(raster, blocks),
    }
}

fn cells<const N: usize>(raster: &Raster, blocks: Blocks) -> Buffer {
    let [columns, rows] = blocks.grid();
    let glyphs: Vec<Cell> = (0..1 << N).map(|mask| Cell::from(blocks.glyph(mask))).collect();
    let area = [raster.width.div_ceil(columns), raster.height.div_ceil(rows)].map(|n| n as u16);
    let area = Rect::new(0, 0, area[0], area[1]);
    let oklab = Oklab::nearly(&raster.pixels);
    let cell = |index: usize| {
        let [x, y] =
            [index % usize::from(area.width) * columns, index / usize::from(area.width) * rows];
        let pixels: [usize; N] = std::array::from_fn(|i| {
            let [x, y] = [x + i % columns, y + i / columns];
            y.min(raster.height - 1) * raster.width + x.min(raster.width - 1)
        });
        let mask = split(pixels.map(|pixel| oklab[pixel]));
        let mean = |side: usize| {
            // The mean of levels approximates that in OKLab.
            let mut sum = [0; 4];
            for i in (0..N).filter(|i| mask >> i & 1 == side) {
                let [r, g, b] = raster.pixels[pixels[i]].map(u32::from);
                sum = [sum[0] + r, sum[1] + g, sum[2] + b, sum[3] + 1];
            }
            let [r, g, b, count] = sum;
            [r, g, b].map(|sum| ((sum + count / 2) / count.max(1)) as u8)
        };
        let [bg, fg] = [mean(0), mean(1)];
        let is_flat = mask == (1 << N) - 1 || fg == bg;
        let mut cell = glyphs[if is_flat { 0 } else { mask }].clone();
        match is_flat {
            true => cell.set_bg(Color::from(fg)),
            false => cell.set_fg(Color::from(fg)).set_bg(Color::from(bg)),
        };
        cell
    };
    Buffer { area, content: (0..area.area() as usize).map(cell).collect() }
}

/// Returns the mask of the pixels that share a colour with the first one if two colours show all of
/// them with nearly the least squared error: two means on the axis of the largest differences. All
/// bits are set if the pixels hardly differ.
fn split<const N: usize>(pixels: [Oklab; N]) -> usize {
    let channels = [pixels.map(|p| p.l), pixels.map(|p| p.a), pixels.map(|p| p.b)];
    let [l, a, b] = channels.map(|channel| {
        let mean = channel.iter().sum::<f32>() / N as f32;
        channel.map(|value| value - mean)
    });
    let parts = |axis: [f32; 3]| -> [f32; N] {
        std::array::from_fn(|i| axis[0] * l[i] + axis[1] * a[i] + axis[2] * b[i])
    };
    let square = |i: usize| l[i] * l[i] + a[i] * a[i] + b[i] * b[i];
    let far = (1..N).fold(0, |far, i| if square(i) > square(far) { i } else { far });
    let all = (1 << N) - 1;
    if square(far) < FLAT * FLAT {
        return all;
    }
    // A step of the power iteration from the pixel that is farthest from the mean.
    let weights = parts([l[far], a[far], b[far]]);
    let along = |channel: [f32; N]| (0..N).map(|i| weights[i] * channel[i]).sum::<f32>();
    let places = parts([along(l), along(a), along(b)]);
    let mut limit = 0.0;
    for _ in 0..MEANS {
        let (mut sum, mut count) = (0.0, 0.0);
        for place in places {
            let inside = if place <= limit { 1.0 } else { 0.0 };
            (sum, count) = (sum + inside * place, count + inside);
        }
        // The sum of all places is 0.
        limit = 0.5 * (sum / count - sum / (N as f32 - count));
    }
    let mask = (0..N).fold(0, |mask, i| mask | usize::from(places[i] <= limit) << i);
    if mask & 1 == 1 { mask } else { all ^ mask }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn block_characters_are_those_of_unicode() {
        let octants = [0x04, 0x06, 0x07, 0x08, 0x10, 0xfe].map(|mask| Blocks::Octants.glyph(mask));
        assert_eq!(
            octants,
            ['\u{1cd00}', '\u{1cd01}', '\u{1cd02}', '\u{1cd03}', '\u{1cd09}', '\u{1cde5}']
        );
        let sextants =
            [0x01, 0x15, 0x16, 0x2a, 0x2b, 0x3e].map(|mask| Blocks::Sextants.glyph(mask));
        assert_eq!(sextants, ['\u{1fb00}', '▌', '\u{1fb14}', '▐', '\u{1fb28}', '\u{1fb3b}']);
        for blocks in Blocks::ALL {
            let count = 1 << blocks.grid().iter().product::<usize>();
            let mut glyphs: Vec<_> = (0..count).map(|mask| blocks.glyph(mask)).collect();
            for glyph in &glyphs {
                let shape = shape(*glyph).unwrap();
                let other = self::shape(shape.complement.chars().next().unwrap()).unwrap();
                assert!((0..4).all(|i| (shape.quarters[i] + other.quarters[i] - 1.0).abs() < 1e-6));
            }
            glyphs.sort_unstable();
            glyphs.dedup();
            assert_eq!(glyphs.len(), count, "{blocks:?}");
        }
        assert_eq!(shape('▛').unwrap().quarters, [1.0, 1.0, 1.0, 0.0]);
        assert_eq!(shape('\u{1fb02}').unwrap().quarters, [2.0 / 3.0, 2.0 / 3.0, 0.0, 0.0]);
    }

    /// Picture of a shaded ball with a highlight before a checkerboard.
    fn ball(width: usize, height: usize) -> Raster {
        Raster::from_fn(width, height, |i| {
            let [x, y] = [(i % width) as f32 / width as f32, (i / width) as f32 / height as f32];
            let [u, v] = [4.0 * (x - 0.4), 3.0 * (y - 0.5)];
            let light = 1.0 - 0.7 * ((u + 0.3).powi(2) + (v + 0.4).powi(2)).sqrt();
            match u * u + v * v {
                ..1.0 if light > 0.9 => [250, 250, 240],
                ..1.0 => [220.0, 90.0, 40.0].map(|c| (c * light.max(0.05)) as u8),
                _ if ((x * 9.0) as u32 + (y * 7.0 + x) as u32).is_multiple_of(2) => [60, 70, 80],
                _ => [170, 165, 150],
            }
        })
    }

    /// Returns the mean squared OKLab distance between a picture and its cells of the mean colours of
    /// its pixels.
    fn error(film: &Raster, cells: [usize; 2], blocks: Blocks) -> f32 {
        let grid = blocks.grid();
        let size = [cells[0] * grid[0], cells[1] * grid[1]];
        let side = [film.width / size[0], film.height / size[1]];
        let raster = Raster::from_fn(size[0], size[1], |i| {
            let mut sum = [0; 3];
            for n in 0..side[0] * side[1] {
                let x = i % size[0] * side[0] + n % side[0];
                let y = i / size[0] * side[1] + n / side[0];
                (0..3).for_each(|c| sum[c] += usize::from(film.pixels[y * film.width + x][c]));
            }
            sum.map(|sum| (sum / (side[0] * side[1])) as u8)
        });
        let shown = mosaic_cells(&raster, blocks);
        let masks = 0..1 << (grid[0] * grid[1]);
        let masks: HashMap<_, _> = masks.map(|m| (blocks.glyph(m).to_string(), m)).collect();
        let distance = |i: usize| {
            let size = [film.width / cells[0], film.height / cells[1]];
            let [x, y] = [i % film.width, i / film.width];
            let cell = &shown[((x / size[0]) as u16, (y / size[1]) as u16)];
            let pixel = y % size[1] * grid[1] / size[1] * grid[0] + x % size[0] * grid[0] / size[0];
            let is_inside = masks[cell.symbol()] >> pixel & 1 == 1;
            let color = if is_inside { cell.fg } else { cell.bg };
            let Color::Rgb(r, g, b) = color else { panic!("{cell:?}") };
            Oklab::of([r, g, b]).distance_squared(Oklab::of(film.pixels[i]))
        };
        (0..film.pixels.len()).map(distance).sum::<f32>() / film.pixels.len() as f32
    }

    #[test]
    fn finer_blocks_are_closer_to_the_picture() {
        let film = ball(24 * 8, 12 * 12);
        let errors = Blocks::ALL.map(|blocks| error(&film, [24, 12], blocks).sqrt());
        assert!(errors[1] < 0.9 * errors[0] && errors[3] < 0.8 * errors[0], "{errors:?}");
        assert!(errors[2] < errors[1] && errors[3] < errors[2], "{errors:?}");
    }

    /// Compares with all splits of the pixels of random cells.
    #[test]
    fn splits_are_nearly_the_best() {
        let mut random = (1..).map(|n: u32| {
            let n = n.wrapping_mul(2_654_435_761);
            ((n ^ (n >> 15)).wrapping_mul(2_246_822_519) >> 24) as u8
        });
        let (mut found, mut best) = (0.0, 0.0);
        for _ in 0..500 {
            let pixels: [Oklab; 8] =
                std::array::from_fn(|_| Oklab::of([(); 3].map(|()| random.next().unwrap_or(0))));
            let error = |mask: usize| -> f32 {
                let side = |side: usize| (0..8).filter(move |i| mask >> i & 1 == side);
                let mean = |s: usize, get: fn(&Oklab) -> f32| {
                    side(s).map(|i| get(&pixels[i])).sum::<f32>() / side(s).count().max(1) as f32
                };
                let mean = [0, 1].map(|s| Oklab {
                    l: mean(s, |c| c.l),
                    a: mean(s, |c| c.a),
                    b: mean(s, |c| c.b),
                });
                (0..8).map(|i| pixels[i].distance_squared(mean[mask >> i & 1])).sum()
            };
            found += error(split(pixels));
            best += (0..256).map(error).fold(f32::INFINITY, f32::min);
        }
        assert!(found < 1.1 * best, "{found} {best}");
    }
}
