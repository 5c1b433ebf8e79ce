//! Sixel: an image is sent in horizontal strips, each with its own palette.

use crate::cells::Raster;
use crate::image::transfer::Transfer;
use crossterm::cursor::MoveTo;
use icy_sixel::{EncodeOptions, sixel_encode};
use ratatui::layout::Rect;

/// Largest number of strips: xterm keeps at most 16 images.
pub const MAX_STRIPS: u16 = 16;

/// Returns the bytes that show `image` at `place` in strips of one or more rows of cells, each with
/// at most `colors` colours. `cell_height` is in pixels. Other output can be sent between strips.
///
/// # Errors
/// Fails if the image is empty.
pub fn transfer(
    image: &Raster,
    place: Rect,
    cell_height: usize,
    colors: u16,
) -> Result<Transfer, String> {
    let mut transfer = Transfer { is_divisible: true, ..Transfer::default() };
    let rows = place.height.div_ceil(MAX_STRIPS).max(1);
    let width = image.width;
    let strips = image.pixels.chunks(width.max(1) * cell_height * usize::from(rows));
    for (strip, row) in strips.zip((place.y..).step_by(usize::from(rows))) {
        transfer.add(encoded(strip, width, [place.x, row], colors)?.as_bytes());
    }
    Ok(transfer)
}

/// Returns the sequence that shows rows of `width` pixels at a cell (column, row).
///
/// # Errors
/// Fails if there are no pixels.
pub fn encoded(
    pixels: &[[u8; 3]],
    width: usize,
    [x, y]: [u16; 2],
    colors: u16,
) -> Result<String, String> {
    let options = EncodeOptions { max_colors: colors.clamp(2, 256), ..EncodeOptions::default() };
    let rgba: Vec<u8> = pixels.iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect();
    let height = pixels.len() / width.max(1);
    let sixel = sixel_encode(&rgba, width, height, &options).map_err(|error| error.to_string())?;
    Ok(format!("{}{sixel}", MoveTo(x, y)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use icy_sixel::SixelImage;

    #[test]
    fn strips_decode_to_the_image() {
        let (width, height) = (50, 100);
        let pixel = |i: usize| [(5 * (i % width)) as u8, (2 * (i / width)) as u8, 90];
        let image = Raster::from_fn(width, height, pixel);
        let place = Rect { x: 2, y: 3, width: 7, height: 7 };
        let transfer = transfer(&image, place, 16, 256).unwrap();
        let text = String::from_utf8(transfer.bytes.clone()).unwrap();
        let strips: Vec<_> = text.split("\x1b[").skip(1).collect();
        assert_eq!((strips.len(), transfer.stops.len()), (7, 7));
        let mut shown = Vec::new();
        for (strip, row) in strips.iter().zip(4..) {
            let sixel = strip.strip_prefix(&format!("{row};3H")).unwrap();
            assert!(sixel.starts_with("\x1bP") && sixel.ends_with("\x1b\\"));
            let image = SixelImage::decode(sixel.as_bytes()).unwrap();
            assert_eq!(image.width, width);
            // A sixel encodes a column of six pixels. If the height of a strip is no multiple of 6,
            // the surplus rows of pixels below the strip are transparent.
            let drawn = image.pixels[..].chunks_exact(4).filter(|pixel| pixel[3] > 0);
            shown.extend(drawn.map(|p| [p[0], p[1], p[2]]));
        }
        assert_eq!(shown.len(), image.pixels.len());
        let difference = |(a, b): (&[u8; 3], &[u8; 3])| {
            (0..3).map(|c| f64::from(a[c].abs_diff(b[c]))).sum::<f64>() / 3.0
        };
        let total: f64 = shown.iter().zip(&image.pixels).map(difference).sum();
        let mean = total / shown.len() as f64;
        assert!(mean < 6.0, "mean error of {mean} levels");
    }

    #[test]
    fn number_of_strips_is_bounded() {
        for rows in 1..70 {
            let place = Rect { x: 0, y: 0, width: 1, height: rows };
            let image = Raster::from_fn(6, 6 * usize::from(rows), |_| [1, 2, 3]);
            let transfer = transfer(&image, place, 6, 16).unwrap();
            assert!(transfer.stops.len() <= usize::from(MAX_STRIPS), "{rows}");
        }
    }
}
