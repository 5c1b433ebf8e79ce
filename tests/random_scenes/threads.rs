//! Adaptive renders of random scenes with different numbers of threads, whose films and sample
//! counts must be equal.

use crate::harness::*;
use crate::random_scenes::driver::{Verdict, compare, many};
use zerkalo_render::film::Noise;

/// Mean number of samples per pixel, enough for several allocation rounds.
const SAMPLES: u32 = 40;

/// Result of one render.
#[derive(PartialEq)]
struct Outcome {
    bytes: Vec<u8>,
    noise: Option<Noise>,
    waves: usize,
    rays: u64,
    reason: StoppedBy,
}

fn render(scene: &Scene, threads: usize) -> Outcome {
    let mut rendering = begin(scene, 3, Precision::Auto);
    let stop = Stop { spp: Some(SAMPLES), noise_levels: Some(0.5), ..Stop::default() };
    let mut schedule = rendering.schedule(settings(true, scene.film.rays_per_pixel, stop));
    let (pool, mut waves) = (pool(threads), 0);
    loop {
        match schedule.next(0.0) {
            Step::Finished(reason) => {
                let (noise, rays) = (schedule.noise, schedule.rays);
                return Outcome { bytes: rendering.film.bytes(), noise, waves, rays, reason };
            }
            Step::Trace(wave) => {
                let report = trace(&mut rendering, &wave, &pool);
                schedule.complete(&wave, &report);
                waves += 1;
            }
        }
    }
}

fn same_outcome(scene: &Scene) -> Verdict {
    let one = render(scene, 1);
    for threads in [2, 5] {
        let other = render(scene, threads);
        if other != one {
            let summary =
                |e: &Outcome| format!("{} waves, {} rays, {:?}", e.waves, e.rays, e.noise);
            return Verdict::Different(format!(
                "1 thread: {}; {threads} threads: {}",
                summary(&one),
                summary(&other)
            ));
        }
    }
    Verdict::Same
}

scene_tests!(threads, 0..16, many_threads, many(), same_outcome);
