//! Downscaling of images in linear light.

use crate::cells::{code, linear};
use zerkalo_render::film::box_means;

/// Downscales an image of size `from` (columns, rows) to the size `to`, which is not larger than
/// `from`. A new pixel covers an area of the old image. Its value is the mean of this area in
/// linear light.
pub fn shrunk(pixels: &[[u8; 3]], from: [usize; 2], to: [usize; 2]) -> Vec<[u8; 3]> {
    if from == to || pixels.is_empty() {
        return pixels.to_vec();
    }
    let means = box_means(from, to, |pixel| linear(pixels[pixel]).map(f64::from));
    means.into_iter().map(|mean| mean.map(|c| code(c as f32))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_linear() {
        let checkers = [[0; 3], [255; 3], [255; 3], [0; 3]];
        // The mean of black and white in linear light is 0.5, which is the 8-bit level 188.
        assert_eq!(shrunk(&checkers, [2, 2], [1, 1]), [[188; 3]]);
        assert_eq!(shrunk(&checkers, [2, 2], [2, 2]), checkers);
        assert_eq!(shrunk(&[], [0, 0], [0, 0]), [[0u8; 3]; 0]);
    }

    #[test]
    fn constant_pictures_stay_constant() {
        for (from, to) in [(7, 3), (640, 417), (1000, 999), (5, 1), (9, 9)] {
            let all = vec![[3, 99, 250]; from * 2];
            assert!(shrunk(&all, [from, 2], [to, 1]).iter().all(|p| *p == [3, 99, 250]), "{from}");
        }
    }
}
