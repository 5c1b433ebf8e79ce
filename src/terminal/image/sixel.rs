//! Sixel: strips of a picture, in few colours each.

use crate::terminal::Area;
use crate::terminal::image::transfer::Transfer;
use icy_sixel::{EncodeOptions, sixel_encode};

/// A picture comes in at most so many strips: xterm remembers no more pictures than 16 at a time.
const STRIPS: u16 = 16;

/// What shows `pixels`, `width` of them in a row, on the cells of `place`, which are `cell_height` pixels
/// high, with at most so many `colors` in each strip. Between strips anything else can be sent.
///
/// # Errors
/// The picture has no size.
pub fn transfer(
    pixels: &[[u8; 3]],
    width: usize,
    place: Area,
    cell_height: usize,
    colors: u16,
) -> Result<Transfer, String> {
    let mut transfer = Transfer { divisible: true, destroys: true, ..Transfer::default() };
    let rows = place.height.div_ceil(STRIPS).max(1);
    let options = EncodeOptions { max_colors: colors.clamp(2, 256), ..EncodeOptions::default() };
    let strips = pixels.chunks(width.max(1) * cell_height * usize::from(rows));
    for (strip, row) in strips.zip((place.y..).step_by(usize::from(rows))) {
        let rgba: Vec<u8> = strip.iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect();
        let strip = sixel_encode(&rgba, width, strip.len() / width, &options)
            .map_err(|error| error.to_string())?;
        let go = format!("\x1b[{};{}H", row + 1, place.x + 1);
        transfer.add(format!("{go}{strip}").as_bytes());
    }
    Ok(transfer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use icy_sixel::SixelImage;

    #[test]
    fn strips_are_the_picture() {
        let (width, height) = (50, 100);
        let pixel = |i: usize| [(5 * (i % width)) as u8, (2 * (i / width)) as u8, 90];
        let pixels: Vec<_> = (0..width * height).map(pixel).collect();
        let place = Area { x: 2, y: 3, width: 7, height: 7 };
        let transfer = transfer(&pixels, width, place, 16, 256).unwrap();
        let text = String::from_utf8(transfer.bytes.clone()).unwrap();
        let strips: Vec<_> = text.split("\x1b[").skip(1).collect();
        assert_eq!((strips.len(), transfer.stops.len()), (7, 7));
        let mut shown = Vec::new();
        for (strip, row) in strips.iter().zip(4..) {
            let sixel = strip.strip_prefix(&format!("{row};3H")).unwrap();
            assert!(sixel.starts_with("\x1bP") && sixel.ends_with("\x1b\\"));
            let image = SixelImage::decode(sixel.as_bytes()).unwrap();
            assert_eq!(image.width, width);
            // Rows come by six: those that are too many are not drawn.
            let drawn = image.pixels[..].chunks_exact(4).filter(|pixel| pixel[3] > 0);
            shown.extend(drawn.map(|p| [p[0], p[1], p[2]]));
        }
        assert_eq!(shown.len(), pixels.len());
        let off = |(a, b): (&[u8; 3], &[u8; 3])| {
            (0..3).map(|c| f64::from(a[c].abs_diff(b[c]))).sum::<f64>() / 3.0
        };
        let mean = shown.iter().zip(&pixels).map(off).sum::<f64>() / pixels.len() as f64;
        assert!(mean < 6.0, "{mean} codes off");
    }

    #[test]
    fn there_are_never_too_many_strips() {
        for rows in 1..70 {
            let place = Area { x: 0, y: 0, width: 1, height: rows };
            let pixels = vec![[1, 2, 3]; 6 * 6 * usize::from(rows)];
            let transfer = transfer(&pixels, 6, place, 6, 16).unwrap();
            assert!(transfer.stops.len() <= usize::from(STRIPS), "{rows}");
        }
    }
}
