//! Downscaling of images in linear light.

use zerkalo_render::film::box_means;
use zerkalo_terminal::cells::{Raster, level, linear};

/// Downscales `image` to `size` (width, height), which is not larger. A new pixel is the mean of an
/// area of the old image in linear light.
pub fn shrunk(image: &Raster, [width, height]: [usize; 2]) -> Raster {
    if [image.width, image.height] == [width, height] {
        return image.clone();
    }
    let light = |pixel: usize| linear(image.pixels[pixel]).map(f64::from);
    let means = box_means([image.width, image.height], [width, height], light);
    let pixels = means.into_iter().map(|mean| mean.map(|c| level(c as f32))).collect();
    Raster { width, height, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_linear() {
        let checkers = vec![[0; 3], [255; 3], [255; 3], [0; 3]];
        let checkers = Raster { width: 2, height: 2, pixels: checkers };
        // The mean of black and white in linear light is 0.5, which is the 8-bit level 188.
        assert_eq!(shrunk(&checkers, [1, 1]).pixels, [[188; 3]]);
        assert_eq!(shrunk(&checkers, [2, 2]), checkers);
        let empty = Raster::default();
        assert_eq!(shrunk(&empty, [0, 0]), empty);
    }

    #[test]
    fn constant_pictures_stay_constant() {
        for (from, to) in [(7, 3), (640, 417), (1000, 999), (5, 1), (9, 9)] {
            let plain = |width, height| Raster::from_fn(width, height, |_| [3, 99, 250]);
            assert_eq!(shrunk(&plain(from, 2), [to, 1]), plain(to, 1));
        }
    }
}
