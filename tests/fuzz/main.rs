//! Broken files: seeded mutations of good ones. Nothing panics, nothing hangs, memory stays small.

#[path = "../common/mod.rs"]
mod common;
mod files;
mod mutate;

use mutate::Random;
use std::path::Path;
use std::time::{Duration, Instant};
use zerkalo::asset::Assets;
use zerkalo::scene::Scene;

/// Mutations of each kind of file.
const CASES: u64 = 5_000;

/// The longest that one file may take.
const LONGEST: Duration = Duration::from_secs(1);

/// The most memory that the whole test may ever have taken [KiB].
const MEMORY_KIB: u64 = 512 << 10;

/// The most memory that this process has had so far [KiB], where the system tells.
fn peak_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.trim().split(' ').next()?.parse().ok()).unwrap_or(0)
}

/// Reads `CASES` mutations of `seeds`; `read` says whether the file was taken. How many were.
fn storm(name: &str, seeds: &[Vec<u8>], mut read: impl FnMut(&[u8]) -> bool) -> u64 {
    for (i, seed) in seeds.iter().enumerate() {
        assert!(read(seed), "seed {i} of {name} is not good");
    }
    let mut taken = 0;
    for case in 0..CASES {
        let mut random = Random::new(case << 8 | name.len() as u64);
        let seed = &seeds[random.below(seeds.len())];
        let other = &seeds[random.below(seeds.len())];
        let mut bytes = random.mutated(seed, other);
        if name == "png" && case % 4 != 0 {
            // Else the checksums would hide almost everything behind them.
            files::repair_png(&mut bytes);
        }
        let begin = Instant::now();
        taken += u64::from(read(&bytes));
        let spent = begin.elapsed();
        assert!(spent < LONGEST, "{name} case {case} took {spent:?}");
    }
    println!("{name}: {taken} of {CASES} taken, peak memory {} MiB", peak_kib() >> 10);
    assert!(peak_kib() < MEMORY_KIB, "{name}: {} MiB", peak_kib() >> 10);
    taken
}

/// The mutations reach behind the first check, and do not pass all of them.
fn balanced(taken: u64) {
    assert!(taken > CASES / 50 && taken < CASES, "{taken} of {CASES} were taken");
}

/// Whether a file with these bytes is taken, written to `path` first.
fn mesh(path: &Path, bytes: &[u8]) -> bool {
    std::fs::write(path, bytes).unwrap();
    match Assets::default().mesh(path) {
        Ok(mesh) => {
            let mesh = mesh.mesh();
            let count = mesh.positions.len();
            assert!(mesh.triangles.iter().flatten().all(|i| (*i as usize) < count));
            assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()));
            true
        }
        Err(error) => {
            assert!(!error.found.is_empty() && !error.expected.is_empty());
            false
        }
    }
}

fn meshes(name: &str, seeds: &[Vec<u8>]) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.mtl"), files::MTL).unwrap();
    let path = folder.path().join(format!("a.{name}"));
    balanced(storm(name, seeds, |bytes| mesh(&path, bytes)));
}

#[test]
fn obj() {
    meshes("obj", &files::obj());
}

#[test]
fn mtl() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let taken = storm("mtl", &[files::MTL.into()], |bytes| {
        std::fs::write(folder.path().join("a.mtl"), bytes).unwrap();
        mesh(&path, &files::obj()[0])
    });
    assert_eq!(taken, CASES, "colours that cannot be read are left out");
}

#[test]
fn ply() {
    meshes("ply", &files::ply());
}

#[test]
fn stl() {
    meshes("stl", &files::stl());
}

#[test]
fn glb() {
    meshes("glb", &files::glb());
}

#[test]
fn gltf() {
    meshes("gltf", &files::gltf());
}

fn images(name: &str, seeds: &[Vec<u8>]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a");
    balanced(storm(name, seeds, |bytes| {
        std::fs::write(&path, bytes).unwrap();
        Assets::default().image(&path).is_ok()
    }));
}

#[test]
fn png() {
    images("png", &files::png());
}

#[test]
fn jpeg() {
    images("jpeg", &files::jpeg());
}

#[test]
fn toml() {
    let seeds = files::toml();
    // In the folder of the meshes that some name.
    let name = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/a.toml");
    balanced(storm("toml", &seeds, |bytes| {
        std::str::from_utf8(bytes).is_ok_and(|text| Scene::parse(text, name).is_ok())
    }));
}
