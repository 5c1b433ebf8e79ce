//! Tests of the allocation of samples to tiles by their estimated noise.

use crate::schedule::allocation::EXPLORATION;
use crate::schedule::tests::*;

#[test]
fn adaptive_spp_is_the_mean_and_noisy_tiles_get_most() {
    let mut model = Model::exact(clustered(400, 0.3));
    let (schedule, reason) = model.finish(until(spp(200), true));
    assert_eq!(reason, StoppedBy::Spp);
    let spp = schedule.spp();
    assert!(spp.mean <= 200.0 && spp.mean > 199.9, "{spp:?}");
    // The picture has a mean of 200 samples per pixel. The tiles without noise, 0.7 of all tiles,
    // share the rays of exploration: 200 * EXPLORATION / 0.7 samples per pixel, in whole blocks.
    assert!((2 * MIN_SAMPLES..=40).contains(&spp.min), "{spp:?}");
    assert!(spp.max > 500, "{spp:?}");
}

/// Renders a simulated picture twice to the same error: uniformly, then adaptively. Returns the
/// gain of adaptive sampling: the mean sample count of the uniform render divided by that of the
/// adaptive render. `share` is the fraction of tiles that are noisy.
///
/// An exact model of the best allocation gives 8.4, 2.6 and 1.1 for shares of 0.05, 0.3 and 0.9,
/// with tiles of different noise. With 1024 samples per pixel in all noisy tiles and 32 in the
/// others, the gain would be 1 / (share + (1 - share) 32 / 1024): 12.5, 3.1 and 1.11.
fn gain(share: f64) -> f64 {
    let tiles = 2000;
    let mut uniform = Model::exact(clustered(tiles, share));
    uniform.finish(until(spp(1024), false));
    let target = uniform.rmse();
    let mut adaptive = Model::exact(clustered(tiles, share));
    let (schedule, reason) = adaptive.finish(until(noise(target), true));
    assert_eq!(reason, StoppedBy::Noise);
    assert!(adaptive.rmse() <= target && adaptive.rmse() > 0.99 * target);
    assert!(adaptive.waves < 200, "{} waves", adaptive.waves);
    1024.0 / schedule.spp().mean
}

#[test]
fn adaptive_sampling_saves_samples() {
    // If 90 % of the tiles are noisy, the gain is at most 1 / 0.9. Two losses reduce it: 2 %
    // because the RMSE ends 1 % below the target, and 0.5 % because sample counts grow in whole
    // blocks of about a quarter of the count.
    for (share, least) in [(0.05, 8.4), (0.3, 2.6), (0.9, 1.08)] {
        // The noisy tiles do not get the rays of exploration, a share `EXPLORATION` of all rays.
        let (gain, least) = (gain(share), (1.0 - EXPLORATION) * least);
        assert!(gain >= least, "{share}: {gain}");
    }
}

/// Checks that tiles whose error vanishes at the light period get no more samples from there on.
/// The light period is the number of samples that together trace a shadow ray to each light once.
/// The schedule must discard the noise estimates from fewer samples, because they would keep the
/// expected error of these tiles high.
#[test]
fn tiles_without_error_after_the_light_period_get_no_more_samples() {
    let least = |light_period| {
        let mut model = Model::exact(vec![NOISY; 400]);
        model.periodic = (100..400).collect();
        model.light_period = light_period;
        let (schedule, reason) = model.finish(until(noise(1.0), true));
        assert_eq!(reason, StoppedBy::Noise);
        schedule.spp().min
    };
    assert_eq!(least(PERIOD as u32), 2 * PERIOD as u32);
    assert!(least(1) > 2 * PERIOD as u32);
}

#[test]
fn noise_target_is_reached_without_overshoot() {
    for adaptive in [false, true] {
        for (seed, target) in [(2, 0.5), (3, 1.0), (4, 1.7)] {
            let mut model = Model::random(clustered(600, 0.3), 64, seed);
            let (schedule, reason) = model.finish(until(noise(target), adaptive));
            assert_eq!(reason, StoppedBy::Noise);
            let reached = schedule.noise.unwrap().rmse.levels;
            assert!(reached <= target, "{reached} > {target}");
            // A uniform render stops only at multiples of `SAMPLE_ALIGNMENT` samples per replicate.
            // Its error may therefore end further below the target than that of an adaptive render.
            let packet =
                if adaptive { 0.0 } else { f64::from(2 * SAMPLE_ALIGNMENT) / schedule.spp().mean };
            let least = (0.98 - 0.5 * packet) * target;
            assert!(reached > least, "adaptive {adaptive}: {reached} far below {target}");
        }
    }
}

#[test]
fn estimate_stays_unbiased_when_it_decides() {
    for effective in [16, 256] {
        let (mut ratio, runs) = (0.0, 5);
        for seed in 0..runs {
            let truth = clustered(600, 0.3).into_iter().enumerate();
            let truth = truth.map(|(i, t)| Truth { sigma: t.sigma + 10.0 * (i % 7) as f64, ..t });
            let mut model = Model::random(truth.collect(), effective, seed);
            let (schedule, _) = model.finish(until(spp(256), true));
            ratio += model.rmse() / schedule.noise.unwrap().rmse.levels / f64::from(runs as u32);
        }
        assert!((0.98..1.045).contains(&ratio), "{effective}: true/estimate {ratio}");
    }
}

#[test]
fn rounds_are_deterministic_and_independent_of_time() {
    let waves = |speed: f64| {
        let mut model = Model::random(clustered(300, 0.2), 64, 7);
        let mut schedule = model.schedule(until(noise(0.7), true));
        let mut waves = Vec::new();
        while let Step::Trace(wave) = schedule.next(waves.len() as f64 * speed) {
            let report = model.run(&wave);
            schedule.complete(&wave, &report);
            waves.push(wave);
        }
        waves
    };
    assert_eq!(waves(0.0), waves(1000.0));
}

/// Checks that a tile gets further samples even if only its validation pixels are noisy. These
/// pixels do not select tiles for samples. The adaptive picture must take at most 1.5 times the
/// rays of a uniform picture with the same true error.
#[test]
fn noise_in_validation_pixels_is_sampled_away() {
    for hidden in [vec![7], (0..100).step_by(3).collect::<Vec<_>>()] {
        let truth = |i: usize| if hidden.contains(&i) { NOISY } else { CALM };
        let model = || {
            let truth = (0..100).map(truth).collect();
            Model { hidden: hidden.clone(), ..Model::exact(truth) }
        };
        for target in [2.0, 0.5] {
            let mut picture = model();
            let (adaptive, reason) = picture.finish(until(noise(target), true));
            assert_eq!(reason, StoppedBy::Noise, "{hidden:?}");
            let (uniform, reason) = model().finish(until(noise(picture.rmse()), false));
            assert_eq!(reason, StoppedBy::Noise);
            let ratio = adaptive.rays as f64 / uniform.rays as f64;
            assert!(ratio <= 1.5, "{hidden:?}, {target}: {ratio} times the rays");
        }
    }
}

/// Checks that tiles without any estimated error are sampled in turn, the tile with the fewest
/// samples first.
#[test]
fn clean_tiles_are_explored_evenly() {
    let mut model = Model::exact(clustered(400, 0.1));
    let (schedule, _) = model.finish(until(spp(4096), true));
    let counts: Vec<u32> = schedule.tiles[40..].iter().map(|t| t.done).collect();
    let (least, most) = (counts.iter().min().unwrap(), counts.iter().max().unwrap());
    assert!(*least > 64 && *most <= 2 * least, "{least} to {most}");
}

/// Checks that tiles of equal noise get about equal sample counts, although their noise estimates
/// differ by chance.
#[test]
fn chance_in_estimates_of_equal_tiles_draws_no_samples() {
    let mut model = Model::random(vec![NOISY; 400], 64, 5);
    let (schedule, _) = model.finish(until(spp(64), true));
    let spp = schedule.spp();
    assert!(
        f64::from(spp.max) <= 2.0 * spp.mean && f64::from(spp.min) >= 0.5 * spp.mean,
        "{spp:?}"
    );
}

/// Checks that no tile gets more than [`MAX_SAMPLES`] samples per replicate, and that twice this
/// number fits 32 bits.
#[test]
fn full_tiles_have_a_count_that_fits_32_bits() {
    let mut model = Model::exact(vec![CALM; 2]);
    let mut schedule = model.schedule(until(Stop::default(), false));
    schedule.tiles.iter_mut().for_each(|t| t.done = MAX_SAMPLES - SAMPLE_ALIGNMENT);
    model.counts =
        [vec![MAX_SAMPLES - SAMPLE_ALIGNMENT; 2], vec![MAX_SAMPLES - SAMPLE_ALIGNMENT; 2]];
    loop {
        match schedule.next(0.0) {
            Step::Finished(reason) => break assert_eq!(reason, StoppedBy::Full),
            Step::Trace(wave) => {
                let report = model.run(&wave);
                schedule.complete(&wave, &report);
            }
        }
    }
    assert_eq!(schedule.spp().max, 2 * MAX_SAMPLES);
    assert_eq!(u64::from(schedule.spp().max), 2 * u64::from(MAX_SAMPLES));
}

#[test]
fn expensive_tiles_get_fewer_samples() {
    let truth = (0..64).map(|i| Truth { rays_per_sample: if i < 32 { 2 } else { 18 }, ..NOISY });
    let mut model = Model::exact(truth.collect());
    let (schedule, _) = model.finish(until(spp(2000), true));
    let ratio = f64::from(schedule.tiles[8].done) / f64::from(schedule.tiles[56].done);
    // At slope 0.5, the best sample count is in proportion to sqrt(1 / rays per sample). The tiles
    // take 2 or 18 rays per sample, so that the ideal ratio of counts is 3.
    assert!((2.2..4.0).contains(&ratio), "{ratio}");
}
