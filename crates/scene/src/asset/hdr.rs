//! Radiance HDR files: lines of text, then lines of pixels that consist of three mantissas and a
//! common exponent (RGBE). A line is a row or a column of the image.
//!
//! A line has one of two encodings. In the newer one, the four components follow one another, each
//! as a sequence of runs. In the older one, a pixel (1, 1, 1, n) repeats the pixel before it n
//! times; in a sequence of such pixels, the n are the digits of the count to base 256, lowest
//! first. Source: G. Ward, "Real Pixels", Graphics Gems II, and the file `color.c` of Radiance.

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::file::FileContents;
use crate::asset::text::{Lines, numbers, shown, words};

/// Radiance HDR file whose header has been read.
pub struct HdrFile<'a> {
    /// Width and height of the image in pixels.
    pub size: [u32; 2],
    order: PixelOrder,
    /// Products, in red, green and blue, of the exposures and colour corrections in the header, above
    /// 0. A radiance is the value of a pixel divided by them.
    factors: [f32; 3],
    /// Encoded lines of pixels.
    lines: &'a [u8],
}

/// Order of the pixels in a file.
#[derive(Clone, Copy)]
struct PixelOrder {
    /// `true` if the lines are columns of the image.
    by_columns: bool,
    from_bottom: bool,
    from_right: bool,
}

impl<'a> HdrFile<'a> {
    /// Reads the header of a file whose first line begins with `#?`.
    pub fn parse(source: &'a FileContents) -> Result<Self, AssetError> {
        let mut lines = Lines::new(&source.bytes);
        let mut next = || {
            lines.next().ok_or_else(|| {
                source.fault("the header cannot be read: the file ends in it", "a whole image")
            })
        };
        next()?;
        let mut factors = [1.0; 3];
        loop {
            let (number, line) = next()?;
            if line.is_empty() {
                break;
            }
            let line_factors = line_factors(line).map_err(|(found, expected)| {
                source.error(FileLocation::Line(number), found, expected)
            })?;
            factors.iter_mut().zip(line_factors).for_each(|(product, factor)| *product *= factor);
        }
        let factors = factors.map(|factor| factor as f32);
        let is_valid = |factor: &f32| factor.is_finite() && *factor > 0.0;
        if let Some(factor) = factors.iter().find(|factor| !is_valid(factor)) {
            let found = format!("the exposure of the image is {factor}");
            return Err(source.fault(found, "an exposure above 0"));
        }
        let (number, line) = next()?;
        let Some((size, order)) = parse_size(line) else {
            let found = format!("the size `{}` cannot be read", shown(line));
            let expected = "`-Y HEIGHT +X WIDTH`, with any signs and in any order";
            return Err(source.error(FileLocation::Line(number), found, expected));
        };
        Ok(Self { size, order, factors, lines: lines.rest })
    }

    /// Decodes the pixels (red, green, blue) of the file `source`, row by row from the top. The
    /// image must have pixels.
    pub fn pixels(&self, source: &FileContents) -> Result<Vec<[f32; 3]>, AssetError> {
        let [width, height] = self.size.map(|n| n as usize);
        let PixelOrder { by_columns, from_bottom, from_right } = self.order;
        let (count, length) = if by_columns { (width, height) } else { (height, width) };
        let factors = self.factors.map(|factor| 1.0 / factor);
        let (scales, mut rest) = (scales(), self.lines);
        let mut line = vec![[0; 4]; length];
        let mut pixels = vec![[0.0; 3]; width * height];
        for number in 0..count {
            decode_line(&mut rest, &mut line).map_err(|fault| {
                let found = format!("the Radiance image cannot be read: {fault}");
                let kind = if by_columns { "column" } else { "row" };
                let place = FileLocation::Part(format!("{kind} {number}"));
                source.error(place, found, "a whole image")
            })?;
            for (i, [mantissas @ .., exponent]) in line.iter().enumerate() {
                let (x, y) = if by_columns { (number, i) } else { (i, number) };
                let x = if from_right { width - 1 - x } else { x };
                let y = if from_bottom { height - 1 - y } else { y };
                let scale = scales[usize::from(*exponent)];
                pixels[y * width + x] =
                    std::array::from_fn(|c| scale * f32::from(mantissas[c]) * factors[c]);
            }
        }
        Ok(pixels)
    }
}

/// Returns the factors in red, green and blue by which radiances were multiplied, as a line of the
/// header states them. Fails with what was found and what was expected.
fn line_factors(line: &[u8]) -> Result<[f64; 3], (String, &'static str)> {
    let equals = line.iter().position(|byte| *byte == b'=').unwrap_or(line.len());
    let (key, value) = (line[..equals].trim_ascii(), line[equals..].get(1..).unwrap_or_default());
    let value = value.trim_ascii();
    let factors = match key {
        b"FORMAT" if ![&b"32-bit_rle_rgbe"[..], b""].contains(&value) => {
            let found = format!("the pixels have the format `{}`", shown(value));
            return Err((found, "the format `32-bit_rle_rgbe`"));
        }
        b"EXPOSURE" if !value.is_empty() => numbers(words(value)).map(|[exposure]| [exposure; 3]),
        b"COLORCORR" if !value.is_empty() => numbers(words(value)),
        // Comments, lines without a value, keys of other programs.
        _ => Some([1.0; 3]),
    };
    factors.ok_or_else(|| {
        let found = format!("the {} `{}` cannot be read", shown(key), shown(value));
        (found, "1 number for EXPOSURE, 3 for COLORCORR")
    })
}

/// Reads the line that states size and order of the pixels, such as `-Y 512 +X 1024` for rows from
/// the top, from left to right. The first axis is that from line to line.
fn parse_size(line: &[u8]) -> Option<([u32; 2], PixelOrder)> {
    let words: Vec<_> = words(line).take(5).collect();
    let [first, count, second, length] = words[..] else { return None };
    let number = |word| std::str::from_utf8(word).ok()?.parse().ok();
    let (count, length) = (number(count)?, number(length)?);
    let by_columns = first.ends_with(b"X");
    let (x, y) = if by_columns { (first, second) } else { (second, first) };
    let is_second = |axis, directions: [&[u8]; 2]| {
        directions.iter().position(|direction| *direction == axis).map(|i| i == 1)
    };
    let from_right = is_second(x, [b"+X", b"-X"])?;
    let from_bottom = is_second(y, [b"-Y", b"+Y"])?;
    let size = if by_columns { [count, length] } else { [length, count] };
    Some((size, PixelOrder { by_columns, from_bottom, from_right }))
}

/// Returns the values of mantissa 1 for all exponents: 2^(exponent - 136), but 0 for the exponent 0.
fn scales() -> [f32; 256] {
    std::array::from_fn(|e| if e == 0 { 0.0 } else { f64::exp2(e as f64 - 136.0) as f32 })
}

/// Lengths of the lines that may have the newer encoding. Others have the older one.
const NEWER_LENGTHS: std::ops::Range<usize> = 8..1 << 15;

const TOO_SHORT: &str = "the file ends";
const TOO_LONG: &str = "a run is longer than the line";

/// Removes the first `N` bytes from `bytes` and returns them.
fn take<const N: usize>(bytes: &mut &[u8]) -> Result<[u8; N], &'static str> {
    let (taken, rest) = bytes.split_first_chunk().ok_or(TOO_SHORT)?;
    *bytes = rest;
    Ok(*taken)
}

/// Decodes a line of at least one pixel, and removes it from `bytes`.
fn decode_line(bytes: &mut &[u8], line: &mut [[u8; 4]]) -> Result<(), &'static str> {
    let first = take(bytes)?;
    match first {
        [2, 2, high @ 0..128, low] if NEWER_LENGTHS.contains(&line.len()) => {
            if usize::from(u16::from_be_bytes([high, low])) != line.len() {
                return Err("it has another length than the image");
            }
            (0..4).try_for_each(|c| decode_component(bytes, line, c))
        }
        [1, 1, 1, _] => Err("its first pixel repeats another one"),
        _ => decode_pixels(bytes, line, first),
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
        decode_line(&mut bytes, &mut row)?;
        assert!(bytes.is_empty(), "{} bytes are left", bytes.len());
        Ok(row)
    }

    #[test]
    fn pixels_have_a_common_exponent() {
        let source = file("", "-Y 2 +X 1", &[128, 1, 255, 136, 128, 1, 255, 0]);
        assert_eq!(pixels(&source).unwrap(), [[128.0, 1.0, 255.0], [0.0; 3]]);
    }

    #[test]
    fn runs_are_repeated() {
        // Newer encoding: runs of 3 and 5 for red, single values for green, runs of 4 for blue, a run
        // of 8.
        let runs = [2, 2, 0, 8, 131, 9, 133, 8, 8, 1, 2, 3, 4, 5, 6, 7, 8, 132, 5, 132, 6, 136, 1];
        let expected: [[u8; 4]; 8] = std::array::from_fn(|i| {
            [if i < 3 { 9 } else { 8 }, i as u8 + 1, if i < 4 { 5 } else { 6 }, 1]
        });
        assert_eq!(row(8, &runs).unwrap(), expected);
        // Older encoding: the second pixel is repeated 1 + 2 * 256 times, the third one twice.
        let pixels = [[9, 8, 7, 6], [5; 4], [1, 1, 1, 1], [1, 1, 1, 2], [4; 4], [1, 1, 1, 2]];
        let decoded = row(1 + 514 + 3, pixels.as_flattened()).unwrap();
        assert_eq!(decoded[0], [9, 8, 7, 6]);
        assert!(decoded[1..515].iter().all(|pixel| *pixel == [5; 4]));
        assert!(decoded[515..].iter().all(|pixel| *pixel == [4; 4]));
        for (bytes, fault) in [
            (&runs[..22], TOO_SHORT),
            (&[2, 2, 0, 8, 9, 1, 1, 1, 1, 1], TOO_LONG),
            (&[2, 2, 0, 8, 137, 1], TOO_LONG),
            (&[2, 2, 0, 9, 136, 1], "it has another length than the image"),
            (&[9, 9, 9, 9, 1, 1, 1, 8], TOO_LONG),
            (&[1, 1, 1, 1], "its first pixel repeats another one"),
        ] {
            assert_eq!(row(8, bytes), Err(fault), "{bytes:?}");
        }
        // The digits of a count exceed all numbers.
        let digits = [&[9; 4][..], &[1, 1, 1, 0].repeat(9), &[1, 1, 1, 1]].concat();
        assert_eq!(row(4, &digits), Err(TOO_LONG));
    }

    #[test]
    fn lines_of_other_lengths_have_the_older_encoding() {
        for width in [1, 2, 7, 1 << 15] {
            let pixels = vec![[2, 2, 0, 9]; width];
            assert_eq!(row(width, pixels.as_flattened()), Ok(pixels));
        }
    }

    /// Checks the eight orders of an image of 9 x 8 pixels. The pixel in column x and row y has the
    /// colour x, y, 2. Each order is tested in both encodings and with both line endings.
    #[test]
    fn images_of_all_orders_are_upright() {
        let expected: Vec<[f32; 3]> =
            (0..8u8).flat_map(|y| (0..9u8).map(move |x| [x, y, 2].map(f32::from))).collect();
        let sizes = ["-Y 8", "+Y 8"].into_iter().flat_map(|y| ["-X 9", "+X 9"].map(|x| [x, y]));
        for size in sizes.flat_map(|[x, y]| [format!("{x} {y}"), format!("{y} {x}")]) {
            // The columns and rows in the order of the file.
            let columns = (0..9u8).map(|x| if size.contains("+X") { x } else { 8 - x });
            let rows = (0..8u8).map(|y| if size.contains("-Y") { y } else { 7 - y });
            let pixel = |x: u8, y: u8| [x, y, 2, 136];
            let lines: Vec<Vec<[u8; 4]>> = if &size[1..2] == "Y" {
                rows.map(|y| columns.clone().map(|x| pixel(x, y)).collect()).collect()
            } else {
                columns.map(|x| rows.clone().map(|y| pixel(x, y)).collect()).collect()
            };
            let flat = lines.concat().as_flattened().to_vec();
            let runs: Vec<u8> = lines.iter().flat_map(|line| encoded(line, &[3, 128])).collect();
            for (bytes, end) in [(&flat, "\n"), (&runs, "\n"), (&flat, "\r\n"), (&runs, "\r\n")] {
                let text = format!("#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n").replace('\n', end);
                let bytes = [text.as_bytes(), bytes].concat();
                let source = FileContents { path: PathBuf::from("a.hdr"), bytes };
                assert_eq!(pixels(&source).unwrap(), expected, "{text:?}");
            }
        }
    }

    #[test]
    fn exposures_and_colour_corrections_are_divided_out() {
        let header = "# EXPOSURE=3\nEXPOSURE=4\npfilt -x 8\n EXPOSURE = 0.5\nGAMMA=2\nVIEW=\n\
                      FORMAT=32-bit_rle_rgbe\nCOLORCORR= 1 2 0.5\nCOLORCORR=2 2 2\n";
        let source = file(header, "-Y 1 +X 1", &[128, 64, 32, 136]);
        assert_eq!(pixels(&source).unwrap(), [[32.0, 8.0, 16.0]]);
    }

    #[test]
    fn header_errors_have_line_numbers() {
        for (header, size, message) in [
            ("EXPOSURE=bright\n", "-Y 1 +X 1", "a.hdr:2: the EXPOSURE `bright` cannot be read"),
            ("COLORCORR=1 2\n", "-Y 1 +X 1", "a.hdr:2: the COLORCORR `1 2` cannot be read"),
            ("COLORCORR=1 0 1\n", "-Y 1 +X 1", "a.hdr: the exposure of the image is 0"),
            ("EXPOSURE=2\nEXPOSURE=-1\n", "-Y 1 +X 1", "a.hdr: the exposure of the image is -2"),
            ("EXPOSURE=1e39\n", "-Y 1 +X 1", "a.hdr: the exposure of the image is inf"),
            ("\0=1\nFORMAT=32-bit_rle_xyze\n", "-Y 1 +X 1", "a.hdr:3: the pixels have the format"),
            ("", "+Y 1 +Y 1", "a.hdr:3: the size `+Y 1 +Y 1` cannot be read"),
            ("", "Y 1 X 1", "a.hdr:3: the size `Y 1 X 1` cannot be read"),
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
            pixels in prop::collection::vec([0..3u8, 0..3u8, 0..3u8, 0..3u8], 8..400),
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
            while decode_line(&mut rest, &mut row).is_ok() {}
            prop_assert!(rest.len() <= bytes.len());
        }
    }
}
