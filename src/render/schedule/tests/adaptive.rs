//! Where samples go.

use super::*;

#[test]
fn adaptive_spp_is_the_mean_and_goes_where_the_noise_is() {
    let mut model = Model::exact(clustered(400, 0.3), 20);
    let (schedule, reason) = model.finish(until(spp(200), true));
    assert_eq!(reason, StoppedBy::Spp);
    let spp = schedule.spp();
    assert!(spp.mean <= 200.0 && spp.mean > 199.9, "{spp:?}");
    assert_eq!(spp.min, 2 * FLOOR);
    assert!(spp.max > 500, "{spp:?}");
}

/// Samples that adaptive sampling saves at equal error, against the uniform count.
fn gain(share: f64) -> f64 {
    let tiles = 2000;
    let mut uniform = Model::exact(clustered(tiles, share), 50);
    uniform.finish(until(spp(1024), false));
    let target = uniform.rmse();
    let mut adaptive = Model::exact(clustered(tiles, share), 50);
    let (schedule, reason) = adaptive.finish(until(noise(target), true));
    assert_eq!(reason, StoppedBy::Noise);
    assert!(adaptive.rmse() <= target && adaptive.rmse() > 0.99 * target);
    assert!(adaptive.waves < 200, "{} waves", adaptive.waves);
    1024.0 / schedule.spp().mean
}

#[test]
fn adaptive_order_pays() {
    for (share, least) in [(0.05, 8.4), (0.3, 2.6), (0.9, 1.1)] {
        let gain = gain(share);
        assert!(gain >= least, "{share}: {gain}");
    }
}

#[test]
fn a_target_is_reached_without_overshoot() {
    for adaptive in [false, true] {
        for (seed, target) in [(1, 0.3), (2, 0.5), (3, 1.0), (4, 1.7)] {
            let mut model = Model::random(clustered(600, 0.3), 30, 64, seed);
            let (schedule, reason) = model.finish(until(noise(target), adaptive));
            assert_eq!(reason, StoppedBy::Noise);
            let reached = schedule.noise().unwrap().rmse_codes;
            assert!(reached <= target, "{reached} > {target}");
            // A uniform picture cannot stop between packets of 8.
            let packet = if adaptive { 0.0 } else { f64::from(2 * PACKET) / schedule.spp().mean };
            let least = (0.98 - 0.5 * packet) * target;
            assert!(reached > least, "adaptive {adaptive}: {reached} far below {target}");
        }
    }
}

#[test]
fn the_estimate_stays_honest_when_it_decides() {
    for effective in [16, 64, 256] {
        let (mut ratio, runs) = (0.0, 8);
        for seed in 0..runs {
            let truth = clustered(600, 0.3).into_iter().enumerate();
            let truth = truth.map(|(i, t)| Truth { sigma: t.sigma + 10.0 * (i % 7) as f64, ..t });
            let mut model = Model::random(truth.collect(), 30, effective, seed);
            let (schedule, _) = model.finish(until(spp(256), true));
            ratio += model.rmse() / schedule.noise().unwrap().rmse_codes / f64::from(runs as u32);
        }
        assert!((0.98..1.045).contains(&ratio), "{effective}: true/estimate {ratio}");
    }
}

#[test]
fn decisions_repeat_and_do_not_look_at_the_clock() {
    let waves = |speed: f64| {
        let mut model = Model::random(clustered(300, 0.2), 20, 64, 7);
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

#[test]
fn a_quiet_tile_among_noisy_ones_is_not_starved() {
    // Tile 60 shows no error yet; its neighbours do.
    let truth = (0..121).map(|i| if i == 60 { CALM } else { NOISY }).collect();
    let mut model = Model::exact(truth, 11);
    let (schedule, _) = model.finish(until(spp(4096), true));
    let quiet = schedule.tiles[60].done;
    assert!(quiet > 4 * FLOOR && quiet < 512, "{quiet}");
    // A calm region far from noise stays at its floor.
    let mut model = Model::exact(clustered(400, 0.1), 20);
    let (schedule, _) = model.finish(until(spp(256), true));
    assert_eq!(schedule.tiles[399].done, FLOOR);
}

#[test]
fn dear_tiles_get_fewer_samples() {
    let truth = (0..64).map(|i| Truth { rays_per_sample: if i < 32 { 2 } else { 18 }, ..NOISY });
    let mut model = Model::exact(truth.collect(), 8);
    let (schedule, _) = model.finish(until(spp(2000), true));
    let ratio = f64::from(schedule.tiles[8].done) / f64::from(schedule.tiles[56].done);
    // n ~ sqrt(1 / cost) at slope 0.5.
    assert!((2.2..4.0).contains(&ratio), "{ratio}");
}
