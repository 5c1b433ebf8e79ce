//! Unit tests of film files.

use super::*;
use crate::FileError;
use crate::film::testing::{Rng, TestFilm, each_tile, film, white};
use crate::film::{Film, TILE};
use std::io::Cursor;
use std::path::Path;
use zerkalo_scene::Tone;

/// Returns a film whose integer sums need 0 to 8 bytes. Some of its tiles have no samples, some are
/// cut by the edge of the picture, and their sample counts differ.
fn sample_film() -> Film {
    let mut film = film(150, 37, &[2f64.powi(20), 2f64.powi(-3)]);
    let mut rng = Rng(7);
    each_tile(&mut film, |tile, [x0, _]| {
        if x0 / TILE % 4 == 3 {
            return;
        }
        let counts = [1 << (rng.bits() % 20), (rng.bits() % 3) as u32];
        for (replicate, count) in counts.into_iter().enumerate() {
            let [width, height] = tile.extent;
            for pixel in (0..height).flat_map(|y| (0..width).map(move |x| y * TILE + x)) {
                let largest = (u64::from(count) << 49).min(1 << (rng.bits() % 62));
                let sums: Vec<i64> = (0..6).map(|_| (rng.bits() % largest.max(1)) as i64).collect();
                tile.add(replicate, pixel, &sums);
            }
            tile.advance(replicate, count);
        }
        if x0 == 0 {
            tile.bad_samples += 2;
            tile.saturated_samples += 5;
        }
    });
    film
}

fn header_of(film: &Film) -> FilmFileHeader {
    FilmFileHeader {
        film: film.header.clone(),
        weights: white(film.groups()),
        group_names: vec!["lamp".to_string(), "ambient".to_string()],
        display: Display { exposure_ev: -1.5, tone: Tone::Neutral },
        metadata: vec![("Source".to_string(), "r\u{e4}ume.toml".to_string())],
        chunks: BTreeMap::from([(*b"SCEN", b"[film]".to_vec()), (*b"XTRA", vec![9; 70_000])]),
    }
}

fn pieces(film: &Film) -> Vec<Vec<u8>> {
    EncodedFilm::new(&header_of(film), film, None).pieces
}

fn read(bytes: &[u8]) -> Result<SavedFilm, FileError> {
    FilmReader::new(Path::new("a.zk"), Cursor::new(bytes), bytes.len() as u64)?.read()
}

#[test]
fn film_file_restores_every_bit() {
    let film = sample_film();
    let bytes = pieces(&film).concat();
    let SavedFilm { header, film: restored } = read(&bytes).unwrap();
    assert_eq!(header, header_of(&film));
    assert_eq!(restored.bytes(), film.bytes());
    assert_eq!(restored.saturated_samples(), film.saturated_samples());
    assert_eq!(pieces(&restored).concat(), bytes);
}

#[test]
fn saturated_sums_are_restored() {
    let mut film = film(20, 3, &[1.0]);
    each_tile(&mut film, |tile, _| {
        for _ in 0..2 {
            tile.add(0, 1, &[1 << 62, 1, 0]);
        }
        tile.advance(0, 1 << 20);
    });
    assert_eq!(film.saturated_pixels(), 2);
    let restored = read(&pieces(&film).concat()).unwrap().film;
    assert_eq!(restored.saturated_pixels(), 2);
    assert_eq!(restored.bytes(), film.bytes());
}

#[test]
fn files_of_disjoint_samples_add_up() {
    let film = sample_film();
    let bytes = pieces(&film).concat();
    let mut twice = Film::new(film.header.clone());
    for _ in 0..2 {
        let length = bytes.len() as u64;
        let reader = FilmReader::new(Path::new("a.zk"), Cursor::new(&bytes[..]), length).unwrap();
        reader.add_to(&mut twice).unwrap();
    }
    let mut expected = sample_film();
    expected.add(&film).unwrap();
    assert_eq!(twice.bytes(), expected.bytes());
}

#[test]
fn film_of_another_render_is_refused() {
    let bytes = pieces(&sample_film()).concat();
    let reader =
        FilmReader::new(Path::new("a.zk"), Cursor::new(&bytes[..]), bytes.len() as u64).unwrap();
    let mut other = film(150, 37, &[2f64.powi(20), 2f64.powi(-4)]);
    let error = reader.add_to(&mut other).unwrap_err().to_string();
    assert!(error.contains("cannot use a.zk") && error.contains("light group scales"), "{error}");
}

#[test]
fn truncated_files_are_refused_at_every_length() {
    let bytes = pieces(&sample_film()).concat();
    for length in (0..2000).chain((2000..bytes.len()).step_by(97)).chain([bytes.len() - 1]) {
        let error = read(&bytes[..length]).unwrap_err();
        assert!(error.what.contains("it ends in the middle of"), "{length}: {error}");
        assert!(error.remedy.contains("copy it again"), "{error}");
    }
}

#[test]
fn altered_bytes_are_refused() {
    let bytes = pieces(&sample_film()).concat();
    let mut rng = Rng(3);
    for round in 0..600 {
        let mut altered = bytes.clone();
        // The first 300 rounds each alter one of the first 300 bytes, which include the magic
        // bytes, the version and the `HEAD` chunk. All other rounds alter a random byte.
        let at = if round < 300 { round } else { rng.bits() as usize % bytes.len() };
        altered[at] ^= 1 << (rng.bits() % 8);
        let error = read(&altered).unwrap_err();
        assert!(!error.what.is_empty() && !error.remedy.is_empty());
    }
    let error = read(b"\x89PNG\r\n\x1a\n0000").unwrap_err().to_string();
    assert!(error.contains("it is not a film file") && error.contains("--checkpoint"), "{error}");
    let mut newer = bytes.clone();
    newer[8] = 5;
    let error = read(&newer).unwrap_err().to_string();
    assert!(error.contains("version 5 of the format, and this program reads 4"), "{error}");
    let error = read(&[&bytes[..], b"x"].concat()).unwrap_err().to_string();
    assert!(error.contains("1 bytes follow its end"), "{error}");
}

/// Checks that a file composed of parts of two valid files is refused.
#[test]
fn parts_of_different_files_are_refused() {
    let film = sample_film();
    let ours = pieces(&film);
    let mut doubled = sample_film();
    doubled.add(&film).unwrap();
    let theirs = pieces(&doubled);
    for exchanged in 0..ours.len() {
        let mut mixed = ours.clone();
        mixed[exchanged].clone_from(&theirs[exchanged]);
        assert_eq!(read(&mixed.concat()).is_ok(), ours[exchanged] == theirs[exchanged]);
    }
    let missing = [&ours[..1], &ours[2..]].concat().concat();
    assert!(read(&missing).is_err());
}

/// Checks that a short file that claims a film of two terabytes is refused before memory is
/// allocated.
#[test]
#[cfg(target_os = "linux")]
fn film_that_does_not_fit_is_refused() {
    let film = film(1, 1, &[1.0, 1.0]);
    let mut header = header_of(&film);
    (header.film.width, header.film.height) = (1 << 17, 1 << 17);
    let file = EncodedFilm::new(&header, &film, None).pieces.concat();
    let reader = FilmReader::new(Path::new("a.zk"), Cursor::new(&file[..]), 1 << 40).unwrap();
    let error = reader.read().unwrap_err();
    assert!(error.what.starts_with("its film of 131072 x 131072 pixels needs 19"), "{error}");
    assert!(error.what.contains(" are available"), "{error}");
    assert_eq!(error.remedy, "free some, or use a machine with more");
}
