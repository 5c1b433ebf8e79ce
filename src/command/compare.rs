//! `zerkalo compare`: differences between two pictures, and the part that their noise explains.

use crate::command::args::CompareArgs;
use crate::command::{Failure, print_json, print_line};
use crate::dashboard::view::false_color;
use serde::Serialize;
use std::path::Path;
use zerkalo_render::export::{display_of_text, noise_of_text};
use zerkalo_render::film::{ByMeasure, Display};
use zerkalo_render::image_file::{
    FileMetadata, check_picture_memory, png_of_rgb, read_exr, read_png,
};
use zerkalo_scene::disk;

/// Width and height of a block \[pixels\], as of a tile.
const BLOCK: usize = 16;
/// Relative accuracy of the noise in the metadata.
const NOISE_ACCURACY: f64 = 0.1;
/// Number of standard errors by which the mean difference of a block may differ from 0. The
/// probability of more is below 1e-5 for a picture of 3840x2160 pixels and normal noise.
const MAX_SHIFT: f64 = 7.0;
/// Ends of the colours of the difference picture, as a multiple of the RMSE.
const COLOR_RANGE: f64 = 3.0;

/// Results of `--json`. docs/command-line.md describes the keys.
#[derive(Serialize)]
struct Compared {
    size: [usize; 2],
    rmse_levels: f64,
    rmse_linear: Option<f64>,
    noise_levels: Option<f64>,
    noise_linear: Option<f64>,
    /// `true` if the noise of both pictures explains their difference; `None` without metadata.
    agree: Option<bool>,
    largest_block: Block,
}

/// Block of pixels with the largest difference.
#[derive(Serialize)]
struct Block {
    x: usize,
    y: usize,
    rmse_levels: f64,
}

pub fn run(args: &CompareArgs) -> Result<(), Failure> {
    let [a, b] = [&args.a, &args.b].map(|path| FileMetadata::read(path));
    let metadata = [a?, b?];
    let display = metadata.iter().find_map(|m| m.get("Settings").and_then(display_of_text));
    let pictures = [&args.a, &args.b].into_iter().zip(&metadata).map(|(path, metadata)| {
        Picture::read(path, metadata, &display.unwrap_or_default()).map_err(|reason| {
            Failure::Failed(format!("cannot compare {}: {reason}", path.display()))
        })
    });
    let pictures: Vec<Picture> = pictures.collect::<Result<_, _>>()?;
    let [a, b] = &pictures[..] else { return Ok(()) };
    if a.size != b.size {
        let [a, b] = [a.size, b.size].map(|[width, height]| format!("{width} x {height}"));
        return Err(Failure::Failed(format!("pictures of different sizes: {a} and {b} pixels")));
    }
    let compared = compare(a, b);
    let report = match args.json.json {
        true => print_json(&compared),
        false => print_line(&compared.text()),
    };
    report?;
    if let Some(path) = &args.output {
        disk::write(path, &difference_png(a, b, compared.rmse_levels)?)?;
    }
    match args.threshold {
        Some(threshold) if compared.rmse_levels > threshold => Err(Failure::Failed(format!(
            "the pictures differ by {:.3} 8-bit levels, more than {threshold}",
            compared.rmse_levels
        ))),
        _ => Ok(()),
    }
}

/// Picture read from a file.
struct Picture {
    size: [usize; 2],
    /// Pixels as displayed, in 8-bit levels, `[row][column]`.
    levels: Vec<[f64; 3]>,
    /// Pixels in linear radiance; `None` if the levels are rounded to 8 bits.
    linear: Option<Vec<[f64; 3]>>,
    /// Noise in the metadata.
    noise: Option<ByMeasure>,
}

impl Picture {
    fn read(path: &Path, metadata: &FileMetadata, display: &Display) -> Result<Self, String> {
        let noise = metadata.get("Noise").and_then(noise_of_text);
        match metadata.format {
            "PNG" => {
                let image = read_png(path)?;
                check_picture_memory((size_of::<[f64; 3]>() * image.pixels().len()) as u64)?;
                let levels = image.pixels().map(|pixel| pixel.0.map(f64::from)).collect();
                let size = [image.width() as usize, image.height() as usize];
                Ok(Self { size, levels, linear: None, noise })
            }
            "OpenEXR" => {
                let image = read_exr(path)?;
                let levels = image.pixels.iter().map(|pixel| display.levels(*pixel)).collect();
                Ok(Self { size: image.size, levels, linear: Some(image.pixels), noise })
            }
            format => Err(format!("it is a {format}; expected a PNG or OpenEXR picture")),
        }
    }
}

/// Sums over the pixels of a block. A shift is the mean difference of a pixel's three channels.
#[derive(Clone, Copy, Default)]
struct Differences {
    squares: f64,
    shifts: f64,
    squared_shifts: f64,
    pixels: f64,
}

impl Differences {
    /// Returns the mean shift in standard errors. Noise has the mean 0, a difference between scenes
    /// has not. The standard deviation of a pixel is that in the block, and at least `noise`, that
    /// of the picture: a block may lack the few bright samples that its noise consists of.
    fn shift_errors(&self, noise: f64) -> f64 {
        let mean = self.shifts / self.pixels;
        let variance = (self.squared_shifts / self.pixels - mean * mean).max(noise * noise);
        mean.abs() * (self.pixels / variance.max(f64::MIN_POSITIVE)).sqrt()
    }
}

/// Compares two pictures of equal size.
fn compare(a: &Picture, b: &Picture) -> Compared {
    let [width, height] = a.size;
    let columns = width.div_ceil(BLOCK);
    let mut blocks = vec![Differences::default(); columns * height.div_ceil(BLOCK)];
    for (i, (a, b)) in a.levels.iter().zip(&b.levels).enumerate() {
        let block = &mut blocks[i / width / BLOCK * columns + i % width / BLOCK];
        let shift = (0..3).map(|c| b[c] - a[c]).sum::<f64>() / 3.0;
        block.squares += squared(a, b);
        block.shifts += shift;
        block.squared_shifts += shift * shift;
        block.pixels += 1.0;
    }
    let mean = |block: &Differences| block.squares / (3.0 * block.pixels);
    let largest = (0..blocks.len()).max_by(|a, b| mean(&blocks[*a]).total_cmp(&mean(&blocks[*b])));
    let largest = largest.unwrap_or(0);
    let pixels = a.levels.len() as f64;
    let square = blocks.iter().map(|block| block.squares).sum::<f64>() / (3.0 * pixels);
    let linear = a.linear.as_ref().zip(b.linear.as_ref()).map(|(a, b)| {
        let sum: f64 = a.iter().zip(b).map(|(a, b)| squared(a, b)).sum();
        (sum / (3.0 * pixels)).sqrt()
    });
    let noises = a.noise.zip(b.noise);
    let rounded = [a, b].into_iter().filter(|picture| picture.linear.is_none()).count();
    let noise_levels = noises.map(|(a, b)| rounded_difference(a.levels.hypot(b.levels), rounded));
    // Standard error of the mean square, by its variation from block to block.
    let variance: f64 = blocks.iter().map(|block| (mean(block) - square).powi(2)).sum();
    let deviation = variance.sqrt() / blocks.len() as f64;
    let most = |noise: f64| (noise * (1.0 + NOISE_ACCURACY)).powi(2) + 3.0 * deviation;
    Compared {
        size: a.size,
        rmse_levels: square.sqrt(),
        rmse_linear: linear,
        noise_levels,
        noise_linear: noises.filter(|_| linear.is_some()).map(|(a, b)| a.linear.hypot(b.linear)),
        agree: noise_levels.map(|noise| {
            let shifted = |block: &Differences| block.shift_errors(noise) > MAX_SHIFT;
            square <= most(noise) && !blocks.iter().any(shifted)
        }),
        largest_block: Block {
            x: largest % columns * BLOCK,
            y: largest / columns * BLOCK,
            rmse_levels: blocks.get(largest).map_or(0.0, |block| mean(block).sqrt()),
        },
    }
}

fn squared(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum()
}

/// Returns the expected RMSE between two pictures with the RMSE `noise` between them before
/// `rounded` of them were rounded to 8 bits. Rounding adds a variance of 1/12 for each; where noise
/// is small, the roundings are equal in most pixels, and E|x| of a normal variable differ.
fn rounded_difference(noise: f64, rounded: usize) -> f64 {
    let added = rounded as f64 / 12.0;
    let equal = if rounded == 2 { (0.8 * noise - noise * noise).max(0.0) } else { added };
    (noise * noise + if noise < 0.4 { equal.min(added) } else { added }).sqrt()
}

impl Compared {
    fn text(&self) -> String {
        let [width, height] = self.size;
        let Block { x, y, rmse_levels } = self.largest_block;
        let linear = self.rmse_linear.map_or(String::new(), |rmse| format!("  linear {rmse:.3e}"));
        let noise = match (self.noise_levels, self.agree) {
            (Some(noise), Some(true)) => {
                format!("the noise of both explains {noise:.3}: the pictures agree")
            }
            (Some(noise), _) if self.rmse_levels <= noise => {
                format!("the noise of both explains {noise:.3}, but not the shift of whole blocks")
            }
            (Some(noise), _) => {
                let rest = (self.rmse_levels.powi(2) - noise * noise).max(0.0).sqrt();
                format!("the noise of both explains {noise:.3}, but not the other {rest:.3}")
            }
            (None, _) => "the noise of at least one is unknown".to_string(),
        };
        format!(
            "{width}x{height}  RMSE {:.3} 8-bit levels{linear}\n{noise}\n\
             largest difference {rmse_levels:.3} in the block of {BLOCK}x{BLOCK} pixels at {x},{y}",
            self.rmse_levels
        )
    }
}

/// Returns a PNG file of the difference, the mean over the channels: orange where `b` is brighter
/// than `a`, blue where it is darker.
fn difference_png(a: &Picture, b: &Picture, rmse: f64) -> Result<Vec<u8>, Failure> {
    let end = (COLOR_RANGE * rmse).max(f64::MIN_POSITIVE);
    let mean = |pixel: &[f64; 3]| pixel.iter().sum::<f64>() / 3.0;
    let pairs = a.levels.iter().zip(&b.levels);
    let pixels = pairs.flat_map(|(a, b)| false_color::difference((mean(b) - mean(a)) / end));
    let pixels: Vec<u8> = pixels.collect();
    Ok(png_of_rgb(a.size.map(|n| n as u32), &pixels, None)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a picture of noise of one level, to which `shift` is added in its first block.
    fn picture(seed: u32, shift: f64) -> Picture {
        let size = [8 * BLOCK, 8 * BLOCK];
        let level = |i: usize| {
            let hash = (i as u32 ^ seed).wrapping_mul(0x9e37_79b9);
            let noise =
                if (hash ^ hash >> 15).wrapping_mul(0x85eb_ca6b) >> 31 == 0 { -1.0 } else { 1.0 };
            let is_first = i % size[0] < BLOCK && i / size[0] < BLOCK;
            [100.0 + noise + if is_first { shift } else { 0.0 }; 3]
        };
        let levels: Vec<[f64; 3]> = (0..size[0] * size[1]).map(level).collect();
        let noise = Some(ByMeasure { linear: 0.01, levels: 1.0 });
        Picture { size, linear: Some(levels.clone()), levels, noise }
    }

    #[test]
    fn shift_of_a_block_is_a_difference() {
        let agree = |shift| compare(&picture(1 << 16, 0.0), &picture(1 << 20, shift)).agree;
        assert_eq!(agree(0.0), Some(true));
        assert_eq!(agree(1.5), Some(false));
    }
}
