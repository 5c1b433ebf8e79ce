//! Radiance HDR writer: linear radiance in 32 bits per pixel, without layers, for environments.

use crate::film::Replicates;
use crate::film::file::FilmFileHeader;
use crate::image_file::metadata::padded;
use crate::image_file::output::{Bands, Depth, WriteSeek, replace_start};
use std::io;

/// Shortest run of equal bytes that is written as a run.
const SHORTEST_RUN: usize = 4;
/// Most bytes of a run, and of a sequence that is written as it is.
const MOST: usize = 127;

/// Writes a picture row by row. The metadata are comments of the header.
pub(super) fn encode(
    header: &FilmFileHeader,
    _: Depth,
    bands: &mut dyn Bands,
    sink: &mut dyn WriteSeek,
) -> io::Result<()> {
    let [width, height] = [header.film.width, header.film.height];
    let start = |metadata: &[(String, String)]| {
        let line = |(key, value): &(String, String)| {
            format!("# {key}: {}\n", padded(&value.replace(['\n', '\r'], " ")))
        };
        let lines: String = metadata.iter().map(line).collect();
        format!("#?RADIANCE\n{lines}FORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n")
    };
    sink.write_all(start(&header.metadata).as_bytes())?;
    for y in 0..height {
        let film = bands.film_with_row(y)?;
        let row = film.row(y - film.first_row, Replicates::Both, &header.weights);
        let row: Vec<[u8; 4]> = row.into_iter().map(rgbe).collect();
        if !(8..1 << 15).contains(&width) {
            sink.write_all(row.as_flattened())?;
            continue;
        }
        let mut line = vec![2, 2, (width >> 8) as u8, width as u8];
        for component in 0..4 {
            append_runs(&row.iter().map(|pixel| pixel[component]).collect::<Vec<_>>(), &mut line);
        }
        sink.write_all(&line)?;
    }
    match bands.final_metadata() {
        Some(last) => {
            replace_start(sink, start(&header.metadata).as_bytes(), start(&last).as_bytes())
        }
        None => Ok(()),
    }
}

/// Returns mantissas and common exponent of a radiance. The reader takes mantissas as they are, so
/// that the error is at most 1/256 of the largest channel.
fn rgbe(rgb: [f64; 3]) -> [u8; 4] {
    let largest = rgb.into_iter().fold(0.0, f64::max);
    // Smallest and largest exponent of the format.
    if largest < 2f64.powi(-127) {
        return [0; 4];
    }
    let mut exponent = (largest.log2().floor() + 1.0).min(127.0) as i32;
    if (largest * 2f64.powi(8 - exponent)).round() > 255.0 {
        exponent = (exponent + 1).min(127);
    }
    let [r, g, b] = rgb.map(|x| (x * 2f64.powi(8 - exponent)).round() as u8);
    [r, g, b, (exponent + 128) as u8]
}

/// Appends `bytes` as runs of equal bytes, and as sequences of other bytes.
fn append_runs(bytes: &[u8], line: &mut Vec<u8>) {
    let (mut i, mut begin) = (0, 0);
    let plain = |range: std::ops::Range<usize>, line: &mut Vec<u8>| {
        for part in bytes[range].chunks(MOST) {
            line.push(part.len() as u8);
            line.extend(part);
        }
    };
    while i < bytes.len() {
        let run = bytes[i..].iter().take(MOST).take_while(|byte| **byte == bytes[i]).count();
        if run >= SHORTEST_RUN {
            plain(begin..i, line);
            line.extend([(128 + run) as u8, bytes[i]]);
            begin = i + run;
        }
        i += run;
    }
    plain(begin..i, line);
}
