//! Downscaling of images in linear light.

use crate::terminal::cells::{code, linear};

/// Downscales `pixels` of `from` columns and rows to `to`, which is not larger. Each result is the mean of
/// the area that it covers, in linear light.
pub fn shrunk(pixels: &[[u8; 3]], from: [usize; 2], to: [usize; 2]) -> Vec<[u8; 3]> {
    if from == to || pixels.is_empty() {
        return pixels.to_vec();
    }
    let (columns, rows) = (coverage(from[0], to[0]), coverage(from[1], to[1]));
    let mut shrunk = Vec::with_capacity(to[0] * to[1]);
    let mut line = vec![[0.0f32; 3]; to[0]];
    for (top, heights) in &rows {
        line.fill([0.0; 3]);
        for (y, height) in (*top..).zip(heights) {
            let row = &pixels[y * from[0]..][..from[0]];
            for (sum, (left, widths)) in line.iter_mut().zip(&columns) {
                for (pixel, width) in row[*left..].iter().zip(widths) {
                    let light = linear(*pixel);
                    (0..3).for_each(|c| sum[c] += height * width * light[c]);
                }
            }
        }
        shrunk.extend(line.iter().map(|sum| sum.map(code)));
    }
    shrunk
}

/// Returns for each of `to` cells the first of the `from` pixels that it covers, and their weights.
fn coverage(from: usize, to: usize) -> Vec<(usize, Vec<f32>)> {
    let size = from as f64 / to as f64;
    let weights = |cell: usize| {
        let (begin, end) = (cell as f64 * size, ((cell + 1) as f64 * size).min(from as f64));
        let first = (begin as usize).min(from - 1);
        let last = (end.ceil() as usize).clamp(first + 1, from);
        let weight = |i: usize| (end.min((i + 1) as f64) - begin.max(i as f64)).max(0.0) / size;
        (first, (first..last).map(|i| weight(i) as f32).collect())
    };
    (0..to).map(weights).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_linear() {
        let checkers = [[0; 3], [255; 3], [255; 3], [0; 3]];
        // Half of the light is the 8-bit level 188.
        assert_eq!(shrunk(&checkers, [2, 2], [1, 1]), [[188; 3]]);
        assert_eq!(shrunk(&checkers, [2, 2], [2, 2]), checkers);
        assert_eq!(shrunk(&[], [0, 0], [0, 0]), [[0u8; 3]; 0]);
    }

    #[test]
    fn constant_image_is_kept_and_weights_sum_to_one() {
        for (from, to) in [(7, 3), (640, 417), (1000, 999), (5, 1), (9, 9)] {
            let all = vec![[3, 99, 250]; from * 2];
            assert!(shrunk(&all, [from, 2], [to, 1]).iter().all(|p| *p == [3, 99, 250]), "{from}");
            let mut totals = vec![0.0; from];
            for (first, weights) in coverage(from, to) {
                assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
                for (i, weight) in (first..).zip(weights) {
                    totals[i] += weight * from as f32 / to as f32;
                }
            }
            assert!(
                totals.iter().all(|total| (total - 1.0).abs() < 1e-4),
                "{from} {to} {totals:?}"
            );
        }
    }
}
