//! Mosaic: an image of large blocks, each of one colour, which needs few bytes.

use crate::cells::oklab::{level, linear};

/// Replaces the colour of each half cell by the mean, in linear light, of its block of `side` x
/// `side` half cells. `pixels` has rows of `width` half cells. Half cells that are `None` do not
/// count and stay `None`.
pub fn blocks(pixels: &[Option<[u8; 3]>], width: usize, side: usize) -> Vec<Option<[u8; 3]>> {
    if width == 0 {
        return Vec::new();
    }
    let columns = width.div_ceil(side);
    let block = |i: usize| i / width / side * columns + i % width / side;
    let mut sums = vec![([0.0f32; 3], 0u32); columns * (pixels.len() / width).div_ceil(side)];
    for (i, rgb) in pixels.iter().enumerate() {
        if let (Some(rgb), Some((sum, count))) = (rgb, sums.get_mut(block(i))) {
            let light = linear(*rgb);
            (0..3).for_each(|c| sum[c] += light[c]);
            *count += 1;
        }
    }
    let means: Vec<_> =
        sums.iter().map(|(sum, n)| (*n > 0).then(|| sum.map(|s| level(s / *n as f32)))).collect();
    (0..pixels.len()).map(|i| pixels[i].and_then(|_| means.get(block(i)).copied()?)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_means_of_linear_light() {
        let white = Some([255; 3]);
        let black = Some([0; 3]);
        let pixels = [white, black, white, black, black, None, white, white, white];
        let means = blocks(&pixels, 3, 2);
        // The mean of one white and three black half cells is a linear light of 0.25, which is the
        // 8-bit level 137.
        let mean = Some([137; 3]);
        assert_eq!(means[..3], [mean, mean, white]);
        assert_eq!(means[3..6], [mean, mean, None]);
        assert_eq!(means[6..], [white, white, white]);
        assert_eq!(blocks(&[], 0, 2), []);
    }
}
