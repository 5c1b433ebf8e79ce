//! Tests of renders that are divided among machines.

use crate::features::row::*;
use crate::harness::*;
use std::time::SystemTime;
use zerkalo_render::film::file::EncodedFilm;
use zerkalo_render::film::testing::header;
use zerkalo_render::plan::{FilmFiles, Part, PartShard, PlannedTile, ShardRender, WatchedState};

const SIZE: [u32; 2] = [100, 70];
const SEED: u64 = 5;

/// Returns the film of an adaptive render by one process. The tiles of the film have different
/// sample counts.
fn film_of_one(scene: &Scene) -> Film {
    let mut state = begin(&sized(scene.clone(), SIZE), SEED, Precision::Auto);
    follow(&mut state, settings(true, 0, spp_stop(96)), &pool(2));
    state.film
}

/// Returns a plan that divides a render with the sample counts of `film` into `shards` shards.
fn plan(film: &Film, shards: u32) -> Plan {
    let tile = |i: usize| PlannedTile {
        base: 0,
        end: film.tile(i).map_or(0, |tile| tile.counts[0]),
        rays_per_sample: 2.0,
        glossy: false,
        earlier: Default::default(),
    };
    Plan {
        settings: PlanSettings {
            source: String::new(),
            scene_hash: String::new(),
            size: SIZE,
            seed: SEED,
            sampler: SamplerKind::Sobol,
            precision: film.header.precision,
            display: Display::default(),
            rays_per_pixel: 0,
            noise_levels: 1.0,
            shards,
            round: 1,
            base_plan: None,
            base_rays: 0,
            total_rays: 0.0,
        },
        predicted_levels: 1.0,
        slopes: [0.7; 2],
        tiles: (0..film.tile_count()).map(tile).collect(),
    }
}

fn parts(scene: &Scene, plan: &Plan) -> Result<Vec<Film>, String> {
    let scene = sized(scene.clone(), SIZE);
    let part = |shard: u32| {
        let sampling = sobol(SEED);
        let state = begin_with(&scene, sampling, Precision::Auto);
        let mut render = ShardRender::new(state, plan, plan.share(shard), 2)?;
        while render.step() {}
        Ok(render.state.film)
    };
    (1..=plan.settings.shards).map(part).collect()
}

fn shards_add_to(one: &Film, scene: &Scene, shards: u32) -> Verdict {
    let parts = parts(scene, &plan(one, shards))?;
    for descending in [false, true] {
        let mut sum = Film::new(one.header.clone());
        for i in 0..parts.len() {
            let part = if descending { parts.len() - 1 - i } else { i };
            sum.add(&parts[part]).map_err(|e| e.to_string())?;
        }
        ensure(sum.bytes() == one.bytes(), || format!("{shards} shards make another film"))?;
    }
    Ok(())
}

#[test]
fn e1_shards() {
    let one = film_of_one(&shipped("mirror-room.toml"));
    let check = |scene: &Scene| [1, 3, 16].iter().try_for_each(|n| shards_add_to(&one, scene, *n));
    row(
        "mirror-room.toml",
        check,
        &[
            ("another mirror", &|s| material(s, "mirror").roughness = 0.3),
            ("another camera", &|s| s.camera.eye[0] += 0.1),
            ("no lights", &|s| s.lights.clear()),
        ],
    );
    let plan = plan(&one, 3);
    let mut left_out = Film::new(one.header.clone());
    for part in &parts(&shipped("mirror-room.toml"), &plan).unwrap()[..2] {
        left_out.add(part).unwrap();
    }
    assert!(left_out.bytes() != one.bytes(), "a shard left out");
    assert!(plan.differing_tile(&left_out).is_some() && plan.differing_tile(&one).is_none());
}

/// Returns the bytes of the film file of shard `number` with the samples of `film`. If `complete`
/// is `false`, the file says that the shard is unfinished.
fn part_file(plan: &Plan, number: u32, complete: bool, film: &Film) -> Vec<u8> {
    let mut header = header(film);
    header.film.height = SIZE[1] as usize;
    let samples = [film.samples(), plan.samples(&plan.share(number))];
    let shards = vec![PartShard { number, complete, samples }];
    Part { plan: Arc::new(plan.head()), shards, rays: 0 }.record(&mut header);
    EncodedFilm::new(&header, film, None).pieces.concat()
}

/// Watches the film files of the shards of `scene` while they are written. Each file is first
/// damaged, then unfinished, then complete. Compares the sum of the films with `one`, the film of a
/// render by one process.
fn watched_parts_add_to(one: &Film, scene: &Scene, folder: &Path) -> Verdict {
    let plan = plan(one, 3);
    let parts = parts(scene, &plan)?;
    let path = |number: u32| folder.join(format!("job-{number}.zk"));
    let write = |number: u32, bytes: &[u8]| {
        zerkalo_scene::disk::write(&path(number), bytes).map_err(|e| e.to_string())
    };
    fs::write(folder.join("job.plan"), plan.text()).map_err(|e| e.to_string())?;
    (1..4).for_each(|number| drop(fs::remove_file(path(number))));
    let mut films = FilmFiles::open(&[folder.join("job.plan")])?;
    ensure(films.sum.is_none(), || "a film without files".to_string())?;
    let mut sum = Film::new(one.header.clone());
    for (number, film) in (1..).zip(&parts) {
        let whole = part_file(&plan, number, true, film);
        write(number, &whole[..whole.len() - 1])?;
        films.poll();
        let refused = |state: &WatchedState| matches!(state, WatchedState::Refused(_));
        let rows = films.shards(SystemTime::now());
        ensure(refused(&rows[0].state), || format!("a damaged part is {:?}", rows[0].state))?;
        let empty = Film::new(film.header.clone());
        write(number, &part_file(&plan, number, false, &empty))?;
        films.poll();
        ensure(films.sum.as_ref().is_some_and(|s| s.film.bytes() == sum.bytes()), || {
            format!("samples of shard {number} before they are traced")
        })?;
        write(number, &whole)?;
        films.poll();
        sum.add(film).map_err(|e| e.to_string())?;
        ensure(films.sum.as_ref().is_some_and(|s| s.film.bytes() == sum.bytes()), || {
            format!("the sum lacks samples of shard {number}")
        })?;
    }
    let film = &films.sum.as_ref().ok_or("no film")?.film;
    ensure(film.bytes() == one.bytes(), || "another film".to_string())
}

#[test]
fn e2_watching() {
    let one = film_of_one(&shipped("mirror-room.toml"));
    let folder = tempfile::tempdir().unwrap();
    row(
        "mirror-room.toml",
        |scene: &Scene| watched_parts_add_to(&one, scene, folder.path()),
        &[
            ("another mirror", &|s| material(s, "mirror").roughness = 0.3),
            ("no lights", &|s| s.lights.clear()),
        ],
    );
    // The files in the folder are those of the last mutation. The files of the original scene
    // replace them.
    watched_parts_add_to(&one, &shipped("mirror-room.toml"), folder.path()).unwrap();
    // The samples of a film file that is removed no longer count.
    let mut films = FilmFiles::open(&[folder.path().join("job.plan")]).unwrap();
    fs::remove_file(folder.path().join("job-2.zk")).unwrap();
    assert!(
        films.poll() && films.sum.as_ref().unwrap().film.bytes() != one.bytes(),
        "a shard left out"
    );
}
