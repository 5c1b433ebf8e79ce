//! Divisions of the samples of random scenes: a sample has the same bits alone in its packet, in any
//! range of indices, in shards and in regions.

use crate::harness::*;
use crate::random_scenes::driver::{Verdict, compare, many};
use zerkalo_render::RegionRender;

const SEED: u64 = 3;
/// Ranges of samples, first index and count, that divide sixteen: odd, and in groups that packets of
/// several pixels trace.
const DIVISIONS: [&[(u32, u32)]; 3] =
    [&[(0, 5), (5, 11)], &[(0, 1), (1, 2), (3, 13)], &[(0, 4), (4, 4), (8, 8)]];

/// Returns a difference between `whole`, 16 samples of each replicate, and the same samples in
/// regions of one row of tiles.
fn regions(scene: &Scene, whole: &RenderState, precision: Precision) -> Option<String> {
    let mut options = render_options(sobol(SEED));
    options.world.precision = precision;
    let how = settings(false, scene.film.rays_per_pixel, spp_stop(32));
    let mut render =
        RegionRender::new(&Arc::new(scene.clone()), &options, how, 16, 2).expect("a region");
    let size = scene.film.size.map(|n| n as usize);
    let differs = (0..size[1]).flat_map(|y| [Replicates::A, Replicates::B].map(|part| (y, part)));
    let mut differs = differs.filter(|(y, part)| {
        let film = render.film_with_row(*y, &mut |_: &_| Ok(())).expect("a region");
        let row = film.row(y - film.first_row, *part, &whole.weights);
        row != whole.film.row(*y, *part, &whole.weights)
    });
    differs.next().map(|(y, _)| format!("row {y} differs in regions"))
}

fn same_samples(scene: &Scene) -> Verdict {
    let pool = pool(2);
    for precision in [Precision::Single, Precision::Double] {
        let different = |what: String| Verdict::Different(format!("{precision:?}: {what}"));
        let whole = rendered(scene, SEED, precision, 16);
        for ranges in DIVISIONS {
            let mut resumed = begin(scene, SEED, precision);
            let mut merged = begin(scene, SEED, precision).film;
            for (first, count) in ranges {
                uniform(&mut resumed, *first, *count, &pool);
                let mut shard = begin(scene, SEED, precision);
                uniform(&mut shard, *first, *count, &pool);
                merged.add(&shard.film).expect("films of one scene");
            }
            if resumed.film.bytes() != whole.film.bytes() {
                return different(format!("resumed after {ranges:?}"));
            }
            if merged.bytes() != whole.film.bytes() {
                return different(format!("shards of {ranges:?}"));
            }
        }
        if scene.film.rays_per_pixel == 0
            && let Some(what) = regions(scene, &whole, precision)
        {
            return different(what);
        }
    }
    let mut small = scene.clone();
    small.film.size = small.film.size.map(|n| n.min(20));
    if samples::<Single>(&small, 8) != lone_samples::<Single>(&small, 8)
        || samples::<Double>(&small, 8) != lone_samples::<Double>(&small, 8)
    {
        return Verdict::Different("samples traced alone".into());
    }
    Verdict::Same
}

scene_tests!(divisions, 0..8, many_divisions, many(), same_samples);
