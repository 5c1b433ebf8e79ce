//! Fuzz tests: seeded mutations of valid files must cause no panic, no hang and no large
//! allocation.

mod files;
mod mutate;

use crate::harness::*;
use mutate::Random;
use std::sync::LazyLock;
use zerkalo_render::SampleInputs;
use zerkalo_render::film::file::FilmFileHeader;

/// Number of mutations that are read for each format; `ZERKALO_CASES` sets another one.
static CASES: LazyLock<u64> = LazyLock::new(|| {
    std::env::var("ZERKALO_CASES").map_or(3_000, |n| n.parse().expect("a number of cases"))
});

/// Longest allowed time for reading one file. The fastest of up to five attempts counts, because
/// other programs may slow down the others.
const LONGEST: Duration = Duration::from_secs(1);

/// Limit on the peak memory of the test process, in KiB.
const MEMORY_KIB: u64 = 512 << 10;

/// Returns the peak memory of this process in KiB. Returns 0 if the system does not report it.
fn peak_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.trim().split(' ').next()?.parse().ok()).unwrap_or(0)
}

/// Reads [`CASES`] mutations of the files `seeds` and returns the number of accepted ones. `read`
/// returns `true` if it accepts a file; it must accept the unchanged files.
fn read_mutations(name: &str, seeds: &[Vec<u8>], mut read: impl FnMut(&[u8]) -> bool) -> u64 {
    for (i, seed) in seeds.iter().enumerate() {
        assert!(read(seed), "seed {i} of {name} is not good");
    }
    let mut accepted = 0;
    for case in 0..*CASES {
        let mut random = Random::new(case << 8 | name.len() as u64);
        let seed = &seeds[random.below(seeds.len())];
        let other = &seeds[random.below(seeds.len())];
        let mut bytes = random.mutated(seed, other);
        if name == "png" && case % 4 != 0 {
            // With a wrong checksum, the reader would refuse the file before it parses the mutated
            // data.
            files::repair_png(&mut bytes);
        }
        let begin = Instant::now();
        accepted += u64::from(read(&bytes));
        let mut spent = begin.elapsed();
        // Other programs may have taken processor time in the first attempt.
        for _ in 0..4 {
            if spent < LONGEST {
                break;
            }
            let begin = Instant::now();
            read(&bytes);
            spent = spent.min(begin.elapsed());
        }
        assert!(spent < LONGEST, "{name} case {case} took {spent:?}");
    }
    let cases = *CASES;
    println!("{name}: {accepted} of {cases} accepted, peak memory {} MiB", peak_kib() >> 10);
    assert!(peak_kib() < MEMORY_KIB, "{name}: {} MiB", peak_kib() >> 10);
    accepted
}

/// Checks that some mutations are accepted and some are refused. If none were accepted, the first
/// check in the reader might refuse all of them, and later checks would not be tested.
fn assert_mixed(accepted: u64) {
    let cases = *CASES;
    assert!(accepted > cases / 50 && accepted < cases, "{accepted} of {cases} were accepted");
}

/// Writes a new file at `path` in place of the old one. If the old file were truncated instead,
/// ext4 would flush it to the disk at closing, which takes longer than the rest of the test.
fn write(path: &Path, bytes: &[u8]) {
    // Before the first case there is no file.
    let _ = std::fs::remove_file(path);
    std::fs::write(path, bytes).unwrap();
}

/// Writes `bytes` to the mesh file `path` and reads it. Returns `true` if the file is accepted.
fn mesh(path: &Path, bytes: &[u8]) -> bool {
    write(path, bytes);
    accepts_mesh(path)
}

fn accepts_mesh(path: &Path) -> bool {
    match Assets::default().mesh(path) {
        Ok(mesh) => {
            let mesh = &mesh.mesh;
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
    assert_mixed(read_mutations(name, seeds, |bytes| mesh(&path, bytes)));
}

#[test]
fn obj() {
    meshes("obj", &files::obj());
}

#[test]
fn mtl() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    // A small mesh with both materials.
    let obj =
        b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\nusemtl grey\nf 3 2 1\n";
    write(&path, obj);
    let accepted = read_mutations("mtl", &[files::MTL.into()], |bytes| {
        write(&folder.path().join("a.mtl"), bytes);
        accepts_mesh(&path)
    });
    assert_eq!(accepted, *CASES, "colours that cannot be read are left out");
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
    assert_mixed(read_mutations(name, seeds, |bytes| {
        write(&path, bytes);
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
fn hdr() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.hdr");
    assert_mixed(read_mutations("hdr", &files::hdr(), |bytes| {
        write(&path, bytes);
        Assets::default().radiance_map(&path).is_ok()
    }));
}

#[test]
fn toml() {
    let seeds = files::toml();
    // The path is in the folder `scenes`, because some scenes refer to meshes relative to it.
    let name = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/a.toml");
    assert_mixed(read_mutations("toml", &seeds, |bytes| {
        std::str::from_utf8(bytes).is_ok_and(|text| Scene::parse(text, name).is_ok())
    }));
}

#[test]
fn plan() {
    let mut parsed = Vec::new();
    let accepted = read_mutations("plan", &files::plan(), |bytes| {
        let repaired = files::repaired_plan(bytes);
        // Half of the files keep their wrong checksum, like files that are damaged in a transfer.
        let bytes = if bytes.len() % 2 == 0 { &repaired } else { bytes };
        let plan = Plan::parse(Path::new("a.plan"), bytes);
        parsed.extend(plan.clone().ok().filter(|_| parsed.len() < 100));
        plan.is_ok()
    });
    let cases = *CASES;
    assert!(accepted > 20 && accepted < cases, "{accepted} of {cases} were accepted");
    for plan in parsed {
        let again = Plan::parse(Path::new("a.plan"), plan.text().as_bytes()).unwrap();
        assert_eq!(again, plan);
        // Every sample of an accepted plan belongs to one shard (part of the render for one
        // process).
        let shards = plan.settings.shards.min(50);
        let ranges = (1..=shards).flat_map(|shard| plan.share(shard).ranges);
        let samples: u64 = ranges.map(|range| range.len() as u64).sum();
        let all: u64 = plan.tiles.iter().map(|tile| u64::from(tile.end)).sum();
        assert!(samples == all || shards < plan.settings.shards, "{samples} of {all}");
    }
}

/// Returns the bytes of two checkpoints of a small render, one of them written in the middle of an
/// allocation round.
fn checkpoints() -> Vec<Vec<u8>> {
    let scene = Scene::parse(
        "light = [{ point = { position = [2.0, 4.0, 3.0] } }]\n[film]\nsize = [40, 21]\n\
         [materials.m]\nreflection = 0.5\nroughness = 0.3\n[[object]]\nmaterial = \"m\"\n\
         shape.sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }\n",
        "test",
    );
    let scene = Arc::new(scene.unwrap_or_else(|e| panic!("{e}")));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.zk");
    [8, 200]
        .map(|spp| {
            let mut session = session(spp);
            session.set_scene(Arc::clone(&scene));
            wait(&session);
            let (sender, receiver) = std::sync::mpsc::channel();
            let provenance = Provenance {
                source: "a.toml".to_string(),
                scene_hash: "none".to_string(),
                sampler: SamplerKind::Sobol,
                adaptive: true,
            };
            session.submit(move |picture| {
                sender.send(picture.unwrap().checkpoint(&provenance)).unwrap();
            });
            receiver.recv().unwrap().expect("a picture").write(&path, Existing::Replace).unwrap();
            std::fs::read(&path).unwrap()
        })
        .to_vec()
}

fn session(spp: u32) -> Session {
    let options = render_options(sobol(0));
    let stop = spp_stop(spp);
    let criterion = Criterion::Levels;
    let settings = Settings { adaptive: true, criterion, rays_per_pixel: 0, stop };
    Session::new(1, options, settings).unwrap()
}

/// Waits until the session has finished or failed. Returns `true` if it has finished.
fn wait(session: &Session) -> bool {
    loop {
        match session.wait(Duration::from_secs(60)).expect("a report").report.state {
            State::Finished(_) => return true,
            State::Failed(_) => return false,
            State::Idle | State::Tracing | State::Paused => {}
        }
    }
}

fn film(bytes: &[u8]) -> Option<(FilmFileHeader, Vec<u8>)> {
    let reader = FilmReader::new(Path::new("a.zk"), bytes, bytes.len() as u64);
    let read = reader.and_then(FilmReader::read).ok()?;
    Some((read.header, read.film.bytes()))
}

/// Checks that a mutated checkpoint is refused unless its contents are those of the original.
#[test]
fn film_files() {
    let seeds = checkpoints();
    let originals: Vec<_> = seeds.iter().map(|seed| film(seed).expect("a film")).collect();
    read_mutations("film files", &seeds, |bytes| match film(bytes) {
        Some(read) => {
            assert!(originals.contains(&read), "a wrong picture was accepted");
            true
        }
        None => false,
    });
}

/// Checks that checkpoints with mutated parts and correct checksums cause no panic, neither when
/// they are read nor when their render continues.
#[test]
fn film_files_with_repaired_checksums() {
    let seeds = checkpoints();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.zk");
    let mut continued = 0;
    let accepted = read_mutations("film", &seeds, |bytes| {
        let bytes = files::repair_film(bytes);
        let Some(_) = film(&bytes) else { return false };
        write(&path, &bytes);
        let Ok(checkpoint) = Checkpoint::read(&path) else { return false };
        let inputs = SampleInputs::of(&checkpoint.header).expect("inputs");
        if continued < 200
            && let Ok(scene) = Scene::parse(&inputs.scene, "a.toml")
        {
            continued += 1;
            // The target of 2 samples per pixel is already met and ends the render at once. A
            // mutated allocation round could trace for hours.
            let mut session = session(2);
            session.continue_from(Arc::new(scene), checkpoint);
            session.with(|_, _| ());
        }
        true
    });
    assert!(accepted > 20 && continued > 20, "{accepted} accepted, {continued} continued");
}
