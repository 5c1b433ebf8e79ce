//! Radiance HDR files: lines of text, then rows of pixels that consist of three mantissas and a
//! common exponent (RGBE).
//!
//! A row has one of two encodings. In the newer one, the four components follow one another, each
//! as a sequence of runs. In the older one, a pixel (1, 1, 1, n) repeats the pixel before it n
//! times; in a sequence of such pixels, the n are the digits of the count to base 256, lowest
//! first. Source: G. Ward, "Real Pixels", Graphics Gems II, and the file `color.c` of Radiance.

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::file::FileContents;
use std::borrow::Cow;

/// Radiance HDR file whose header has been read.
pub struct HdrFile<'a> {
    /// Width and height of the image in pixels.
    pub size: [u32; 2],
    /// Product of the exposures in the header, above 0. A radiance is the value of a pixel divided
    /// by the exposure.
    exposure: f32,
    /// Encoded rows of pixels.
    rows: &'a [u8],
}

impl<'a> HdrFile<'a> {
    /// Reads the header of a file whose first line begins with `#?RADIANCE`.
    pub fn parse(source: &'a FileContents) -> Result<Self, AssetError> {
        let mut lines = Lines { rest: &source.bytes, number: 0 };
        let end =
            || source.fault("the header cannot be read: the file ends in it", "a whole image");
        lines.next().ok_or_else(end)?;
        let mut exposure = 1.0;
        loop {
            let line = lines.next().ok_or_else(end)?;
            if line.is_empty() {
                break;
            }
            let error = |found: String, expected: &str| {
                source.error(FileLocation::Line(lines.number), found, expected)
            };
            let (key, value) = line.split_once('=').unwrap_or_default();
            match (key.trim(), value.trim()) {
                // Comments, other lines without a value.
                (_, "") => {}
                (comment, _) if comment.starts_with('#') => {}
                ("FORMAT", RGBE) => {}
                ("FORMAT", other) => {
                    let found = format!("the pixels have the format `{}`", shortened(other));
                    return Err(error(found, &format!("the format `{RGBE}`")));
                }
                ("EXPOSURE", number) => {
                    let found = || format!("`{}` is no number", shortened(number));
                    let factor = number.parse::<f32>();
                    exposure *= factor.map_err(|_| error(found(), "an exposure above 0"))?;
                }
                _ => {}
            }
        }
        if !(exposure.is_finite() && exposure > 0.0) {
            let found = format!("the exposure of the image is {exposure}");
            return Err(source.fault(found, "an exposure above 0"));
        }
        let line = lines.next().ok_or_else(end)?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let size = match words[..] {
            ["-Y", height, "+X", width] => width.parse().ok().zip(height.parse().ok()),
            _ => None,
        };
        let Some((width, height)) = size else {
            let found = format!("the size `{}` cannot be read", shortened(&line));
            let expected = "`-Y HEIGHT +X WIDTH`, for rows from the top, from left to right";
            return Err(source.error(FileLocation::Line(lines.number), found, expected));
        };
        Ok(Self { size: [width, height], exposure, rows: lines.rest })
    }

    /// Decodes the pixels (red, green, blue) of the file `source`, row by row from the top. The
    /// image must have pixels.
    pub fn pixels(&self, source: &FileContents) -> Result<Vec<[f32; 3]>, AssetError> {
        let [width, height] = self.size.map(|n| n as usize);
        let (scales, factor) = (scales(), 1.0 / self.exposure);
        let mut rest = self.rows;
        let mut row = vec![[0; 4]; width];
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            decode_row(&mut rest, &mut row).map_err(|fault| {
                let found = format!("the Radiance image cannot be read: {fault}");
                source.error(FileLocation::Part(format!("row {y}")), found, "a whole image")
            })?;
            pixels.extend(row.iter().map(|[r, g, b, exponent]| {
                let scale = scales[usize::from(*exponent)];
                [r, g, b].map(|mantissa| scale * f32::from(*mantissa) * factor)
            }));
        }
        Ok(pixels)
    }
}

/// Value of the header line `FORMAT` for pixels of red, green, blue and exponent.
const RGBE: &str = "32-bit_rle_rgbe";

/// Lines of a header.
struct Lines<'a> {
    /// Bytes of the file after the line that was read last.
    rest: &'a [u8],
    /// Number of the line that was read last, counted from 1.
    number: usize,
}

impl<'a> Lines<'a> {
    /// Returns the next line. Returns `None` at the end of the file.
    fn next(&mut self) -> Option<Cow<'a, str>> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|byte| *byte == b'\n');
        let (line, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        self.rest = rest.get(1..).unwrap_or_default();
        self.number += 1;
        Some(String::from_utf8_lossy(line))
    }
}

/// Returns the beginning of `text`, for an error message.
fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}

/// Returns the values of mantissa 1 for all exponents: 2^(exponent - 136), but 0 for the exponent 0.
fn scales() -> [f32; 256] {
    let mut scales = [0.0; 256];
    scales[1] = f32::exp2(-120.0) * f32::exp2(-15.0);
    for exponent in 2..256 {
        scales[exponent] = 2.0 * scales[exponent - 1];
    }
    scales
}

const TOO_SHORT: &str = "the file ends";
const TOO_LONG: &str = "a run is longer than the row";

/// Removes the first `N` bytes from `bytes` and returns them.
fn take<const N: usize>(bytes: &mut &[u8]) -> Result<[u8; N], &'static str> {
    let (taken, rest) = bytes.split_first_chunk().ok_or(TOO_SHORT)?;
    *bytes = rest;
    Ok(*taken)
}

/// Decodes a row of at least one pixel, and removes it from `bytes`.
fn decode_row(bytes: &mut &[u8], row: &mut [[u8; 4]]) -> Result<(), &'static str> {
    let first = take(bytes)?;
    match first {
        [2, 2, 0..128, _] => (0..4).try_for_each(|c| decode_component(bytes, row, c)),
        [1, 1, 1, _] => Err("its first pixel repeats another one"),
        _ => decode_pixels(bytes, row, first),
    }
}

/// Decodes a component (red, green, blue or exponent) of a row in the newer encoding. It consists
/// of runs. The first byte of a run is the number of values that follow, or 128 more than the
/// number of times that one value follows.
fn decode_component(
    bytes: &mut &[u8],
    row: &mut [[u8; 4]],
    component: usize,
) -> Result<(), &'static str> {
    let mut column = 0;
    while column < row.len() {
        let [code] = take(bytes)?;
        let repeats = code > 128;
        let length = usize::from(if repeats { code - 128 } else { code });
        let run = row.get_mut(column..column + length).ok_or(TOO_LONG)?;
        if repeats {
            let [value] = take(bytes)?;
            run.iter_mut().for_each(|pixel| pixel[component] = value);
        } else {
            let (values, rest) = bytes.split_at_checked(length).ok_or(TOO_SHORT)?;
            run.iter_mut().zip(values).for_each(|(pixel, value)| pixel[component] = *value);
            *bytes = rest;
        }
        column += length;
    }
    Ok(())
}

/// Decodes a row in the older encoding, whose pixel `first` has been taken from `bytes` already.
fn decode_pixels(
    bytes: &mut &[u8],
    row: &mut [[u8; 4]],
    first: [u8; 4],
) -> Result<(), &'static str> {
    row[0] = first;
    let (mut column, mut previous, mut unit) = (1, first, 1usize);
    while column < row.len() {
        let pixel = take(bytes)?;
        if let [1, 1, 1, digit] = pixel {
            let length = unit.saturating_mul(digit.into());
            let run = row[column..].get_mut(..length).ok_or(TOO_LONG)?;
            run.fill(previous);
            column += length;
            unit = unit.saturating_mul(256);
        } else {
            row[column] = pixel;
            column += 1;
            (previous, unit) = (pixel, 1);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::path::PathBuf;

    /// Returns a file with the lines `header` and `size`, and encoded rows.
    fn file(header: &str, size: &str, rows: &[u8]) -> FileContents {
        let text = format!("#?RADIANCE\n{header}\n{size}\n");
        FileContents { path: PathBuf::from("a.hdr"), bytes: [text.as_bytes(), rows].concat() }
    }

    fn pixels(source: &FileContents) -> Result<Vec<[f32; 3]>, AssetError> {
        HdrFile::parse(source)?.pixels(source)
    }

    /// Returns the row of `width` pixels that `bytes` encode, or the error.
    fn row(width: usize, mut bytes: &[u8]) -> Result<Vec<[u8; 4]>, &'static str> {
        let mut row = vec![[0; 4]; width];
        decode_row(&mut bytes, &mut row)?;
        assert!(bytes.is_empty(), "{} bytes are left", bytes.len());
        Ok(row)
    }

    #[test]
    fn pixels_have_a_common_exponent() {
        for (exponent, scale) in scales().into_iter().enumerate().skip(1) {
            assert_eq!(f64::from(scale), f64::exp2(exponent as f64 - 136.0));
        }
        let source = file("", "-Y 2 +X 1", &[128, 1, 255, 136, 128, 1, 255, 0]);
        assert_eq!(pixels(&source).unwrap(), [[128.0, 1.0, 255.0], [0.0; 3]]);
    }

    #[test]
    fn runs_are_repeated() {
        // Newer encoding: runs of 3 and 1 for red, single values for green and blue, a run of 4.
        let runs = [2, 2, 0, 4, 131, 9, 1, 8, 4, 1, 2, 3, 4, 2, 5, 6, 2, 7, 0, 132, 1];
        let expected = [[9, 1, 5, 1], [9, 2, 6, 1], [9, 3, 7, 1], [8, 4, 0, 1]];
        assert_eq!(row(4, &runs).unwrap(), expected);
        // Older encoding: the second pixel is repeated 1 + 2 * 256 times, the third one twice.
        let pixels = [[9, 8, 7, 6], [5; 4], [1, 1, 1, 1], [1, 1, 1, 2], [4; 4], [1, 1, 1, 2]];
        let decoded = row(1 + 514 + 3, pixels.as_flattened()).unwrap();
        assert_eq!(decoded[0], [9, 8, 7, 6]);
        assert!(decoded[1..515].iter().all(|pixel| *pixel == [5; 4]));
        assert!(decoded[515..].iter().all(|pixel| *pixel == [4; 4]));
        for (bytes, fault) in [
            (&runs[..20], TOO_SHORT),
            (&[2, 2, 0, 4, 5, 1, 1, 1, 1, 1], TOO_LONG),
            (&[2, 2, 0, 4, 133, 1], TOO_LONG),
            (&[9, 9, 9, 9, 1, 1, 1, 4], TOO_LONG),
            (&[1, 1, 1, 1], "its first pixel repeats another one"),
        ] {
            assert_eq!(row(4, bytes), Err(fault), "{bytes:?}");
        }
        // The digits of a count exceed all numbers.
        let digits = [&[9; 4][..], &[1, 1, 1, 0].repeat(9), &[1, 1, 1, 1]].concat();
        assert_eq!(row(4, &digits), Err(TOO_LONG));
    }

    #[test]
    fn exposures_are_divided_out() {
        let header = "# EXPOSURE=3\nEXPOSURE=4\npfilt -x 8\n EXPOSURE = 0.5\nGAMMA=2\nVIEW=\n\
                      FORMAT=32-bit_rle_rgbe\n";
        let source = file(header, "-Y 1 +X 1", &[128, 64, 32, 136]);
        assert_eq!(pixels(&source).unwrap(), [[64.0, 32.0, 16.0]]);
    }

    #[test]
    fn header_errors_have_line_numbers() {
        for (header, size, message) in [
            ("EXPOSURE=bright\n", "-Y 1 +X 1", "a.hdr:2: `bright` is no number"),
            ("EXPOSURE=2\nEXPOSURE=-1\n", "-Y 1 +X 1", "a.hdr: the exposure of the image is -2"),
            ("EXPOSURE=1e39\n", "-Y 1 +X 1", "a.hdr: the exposure of the image is inf"),
            ("\0=1\nFORMAT=32-bit_rle_xyze\n", "-Y 1 +X 1", "a.hdr:3: the pixels have the format"),
            ("", "+Y 1 +X 1", "a.hdr:3: the size `+Y 1 +X 1` cannot be read"),
            ("", "-Y 1 +X 4294967296", "a.hdr:3: the size"),
            ("", "-Y 1 +X 1 1", "a.hdr:3: the size"),
            ("", "", "a.hdr:3: the size `` cannot be read"),
            ("", "-Y 2 +X 1", "a.hdr, row 1: the Radiance image cannot be read: the file ends"),
        ] {
            let error = pixels(&file(header, size, &[1, 2, 3, 4])).unwrap_err().to_string();
            assert!(error.starts_with(message), "{error}");
        }
        let open = FileContents { bytes: b"#?RADIANCE\na=b".to_vec(), ..file("", "", &[]) };
        let error = pixels(&open).unwrap_err().to_string();
        assert!(error.contains("the file ends"), "{error}");
    }

    /// Encodes a row in the newer encoding. `lengths` are the longest lengths of the runs, in turn.
    fn encoded(row: &[[u8; 4]], lengths: &[usize]) -> Vec<u8> {
        let mut bytes = vec![2, 2, (row.len() >> 8) as u8, row.len() as u8];
        let mut lengths = lengths.iter().cycle();
        for component in 0..4 {
            let values: Vec<u8> = row.iter().map(|pixel| pixel[component]).collect();
            let mut rest = &values[..];
            while let Some(first) = rest.first() {
                let longest = rest.len().min(*lengths.next().unwrap());
                let equal = rest[..longest].iter().take_while(|value| *value == first).count();
                if equal > 1 && equal < 128 {
                    bytes.extend([128 + equal as u8, *first]);
                    rest = &rest[equal..];
                } else {
                    bytes.push(longest as u8);
                    bytes.extend(&rest[..longest]);
                    rest = &rest[longest..];
                }
            }
        }
        bytes
    }

    proptest! {
        #[test]
        fn runs_are_inverse_to_encoding(
            pixels in prop::collection::vec([0..3u8, 0..3u8, 0..3u8, 0..3u8], 1..400),
            lengths in prop::collection::vec(1..=128usize, 1..9),
        ) {
            prop_assert_eq!(row(pixels.len(), &encoded(&pixels, &lengths)), Ok(pixels));
        }

        #[test]
        fn any_bytes_are_read_without_panic(
            start in prop::sample::select(vec![&[2, 2, 0, 9][..], &[9, 9, 9, 9], &[]]),
            bytes in prop::collection::vec(prop_oneof![Just(1u8), any::<u8>()], 0..99),
            width in 1..40usize,
        ) {
            let bytes = [start, &bytes].concat();
            let mut rest = &bytes[..];
            let mut row = vec![[0; 4]; width];
            while decode_row(&mut rest, &mut row).is_ok() {}
            prop_assert!(rest.len() <= bytes.len());
        }
    }
}
