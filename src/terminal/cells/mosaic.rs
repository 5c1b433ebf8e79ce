//! A picture in large blocks of one colour, which needs few bytes.

use crate::terminal::cells::oklab::{code, linear};

/// For each half cell the mean, in linear light, of the block of `side` x `side` half cells that it is
/// in; where `pixels` has none, none. Row by row, `width` to a row.
pub fn blocks(pixels: &[Option<[u8; 3]>], width: usize, side: usize) -> Vec<Option<[u8; 3]>> {
    if width == 0 {
        return Vec::new();
    }
    let columns = width.div_ceil(side);
    let block = |at: usize| at / width / side * columns + at % width / side;
    let mut sums = vec![([0.0f32; 3], 0u32); columns * (pixels.len() / width).div_ceil(side)];
    for (at, rgb) in pixels.iter().enumerate() {
        if let (Some(rgb), Some((sum, count))) = (rgb, sums.get_mut(block(at))) {
            let light = linear(*rgb);
            (0..3).for_each(|c| sum[c] += light[c]);
            *count += 1;
        }
    }
    let means: Vec<_> =
        sums.iter().map(|(sum, n)| (*n > 0).then(|| sum.map(|s| code(s / *n as f32)))).collect();
    (0..pixels.len()).map(|at| pixels[at].and_then(|_| means.get(block(at)).copied()?)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_of_blocks() {
        let white = Some([255; 3]);
        let black = Some([0; 3]);
        let pixels = [white, black, white, black, black, None, white, white, white];
        let found = blocks(&pixels, 3, 2);
        // A quarter of the light of white is code 137.
        let mean = Some([137; 3]);
        assert_eq!(found[..3], [mean, mean, white]);
        assert_eq!(found[3..6], [mean, mean, None]);
        assert_eq!(found[6..], [white, white, white]);
        assert_eq!(blocks(&[], 0, 2), []);
    }
}
