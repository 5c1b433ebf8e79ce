//! The film and the decisions of an adaptive rendering do not depend on the number of threads.

use crate::driver::{Verdict, compare, compare_many};
use crate::support::{begin, pool, settings, trace};
use zerkalo::film::Noise;
use zerkalo::render::schedule::{Step, Stop, StoppedBy};
use zerkalo::scene::Scene;
use zerkalo::world::Precision;

/// Samples of a pixel, in the mean: several decisions.
const SAMPLES: u32 = 40;

/// What a rendering came to.
#[derive(PartialEq)]
struct End {
    bytes: Vec<u8>,
    noise: Option<Noise>,
    waves: usize,
    rays: u64,
    reason: StoppedBy,
}

fn end(scene: &Scene, threads: usize) -> End {
    let mut rendering = begin(scene, 3, Precision::Auto);
    let stop = Stop { spp: Some(SAMPLES), noise_codes: Some(0.5), ..Stop::default() };
    let mut schedule = rendering.schedule(settings(true, scene.film.rays_per_pixel, stop));
    let (pool, mut waves) = (pool(threads), 0);
    loop {
        match schedule.next(0.0) {
            Step::Finished(reason) => {
                let (noise, rays) = (schedule.noise(), schedule.rays());
                return End { bytes: rendering.film.bytes(), noise, waves, rays, reason };
            }
            Step::Trace(wave) => {
                let report = trace(&mut rendering, &wave, &pool);
                schedule.complete(&wave, &report);
                waves += 1;
            }
        }
    }
}

fn same_end(scene: &Scene) -> Verdict {
    let one = end(scene, 1);
    for threads in [2, 5] {
        let other = end(scene, threads);
        if other != one {
            let told = |e: &End| format!("{} waves, {} rays, {:?}", e.waves, e.rays, e.noise);
            return Verdict::Different(format!(
                "1 thread: {}; {threads} threads: {}",
                told(&one),
                told(&other)
            ));
        }
    }
    Verdict::Same
}

#[test]
fn threads() {
    compare("threads", 0..48, same_end);
}

#[test]
#[ignore = "as many scenes as the environment asks for"]
fn many_threads() {
    compare_many("threads", same_end);
}
