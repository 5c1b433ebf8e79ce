//! Features of renders that are divided among machines.

use crate::features::row::{Verdict, ensure, material, row};
use crate::support::{begin, begin_with, follow, pool, settings, shipped, sized};
use zerkalo::film::{Display, Film};
use zerkalo::render::plan::{Plan, PlanSettings, PlannedTile, ShardRender};
use zerkalo::render::schedule::Stop;
use zerkalo::sampling::{SampleSettings, SamplerKind};
use zerkalo::scene::Scene;
use zerkalo::world::Precision;

const SIZE: [u32; 2] = [100, 70];
const SEED: u64 = 5;

/// Film of an adaptive render by one process, whose tiles get different sample counts.
fn film_of_one(scene: &Scene) -> Film {
    let mut state = begin(&sized(scene.clone(), SIZE), SEED, Precision::Auto);
    follow(&mut state, settings(true, 0, Stop { spp: Some(96), ..Stop::default() }), &pool(2));
    state.film
}

/// Plan of `shards` shards for the sample counts of `film`, with 4 samples of each tile as the base.
fn plan(film: &Film, shards: u32) -> Plan {
    let tile = |i: usize| PlannedTile {
        base: 4,
        end: film.tile(i).map_or(0, |tile| tile.counts()[0]),
        rays_per_sample: 2.0,
        glossy: false,
    };
    Plan {
        settings: PlanSettings {
            source: String::new(),
            scene_hash: String::new(),
            size: SIZE,
            seed: SEED,
            sampler: SamplerKind::Sobol,
            precision: film.header().precision.clone(),
            display: Display::default(),
            rays_per_pixel: 0,
            noise_codes: 1.0,
            shards,
            base_plan: None,
        },
        predicted_codes: 1.0,
        slopes: [0.7; 2],
        tiles: (0..film.tile_count()).map(tile).collect(),
    }
}

/// Films of the base and of all shards.
fn parts(scene: &Scene, plan: &Plan) -> Result<Vec<Film>, String> {
    let scene = sized(scene.clone(), SIZE);
    let part = |shard: u32| {
        let sampling = SampleSettings { seed: SEED, kind: SamplerKind::Sobol };
        let state = begin_with(&scene, sampling, Precision::Auto);
        let mut render = ShardRender::new(state, &plan.ranges(shard), 0, 2)?;
        while render.step() {}
        Ok(render.into_state().film)
    };
    (0..=plan.settings.shards).map(part).collect()
}

/// The films of `shards` shards add to the film `one`, in ascending and descending order.
fn shards_add_to(one: &Film, scene: &Scene, shards: u32) -> Verdict {
    let parts = parts(scene, &plan(one, shards))?;
    for descending in [false, true] {
        let mut sum = Film::new(one.header().clone());
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
    let mut left_out = Film::new(one.header().clone());
    for part in &parts(&shipped("mirror-room.toml"), &plan).unwrap()[..3] {
        left_out.add(part).unwrap();
    }
    assert!(left_out.bytes() != one.bytes(), "a shard left out");
    assert!(plan.differing_tile(&left_out, &[0, 1, 2]).is_none());
}
