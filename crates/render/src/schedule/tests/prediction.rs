//! Tests of the prediction of the sample counts that meet a noise target.

use crate::schedule::tests::*;

/// Renders `model` until its noise is `pilot`, and returns the prediction for a noise 5 % below
/// `target`. Both are RMSE in 8-bit levels.
fn predicted(model: &mut Model, pilot: f64, target: f64) -> Prediction {
    let (mut schedule, _) = model.finish(until(noise(pilot), true));
    schedule.settings.stop = noise(0.95 * target);
    schedule.predict([USUAL_SLOPE; 2], Goal::TO_TARGET).unwrap()
}

/// Traces the predicted samples of each tile and returns the true RMSE of the whole picture.
fn rmse_at(model: &mut Model, prediction: &Prediction) -> f64 {
    for replicate in [0, 1] {
        let jobs = prediction.tiles.iter().zip(0..).map(|(t, tile)| Job {
            tile,
            first: t.base,
            count: t.end - t.base,
        });
        let jobs = jobs.filter(|job| job.count > 0).collect();
        model.run(&Wave { replicate, jobs, estimate: false });
    }
    model.rmse()
}

#[test]
fn predicted_counts_meet_the_target() {
    for slope in [0.5, 0.6, 0.75] {
        for pilot in [1.0, 2.0] {
            let noisy = Truth { slope, ..NOISY };
            let truth = clustered(400, 0.3);
            let truth = truth.iter().map(|t| if t.glossy { noisy } else { *t }).collect();
            let mut model = Model::exact(truth);
            let prediction = predicted(&mut model, pilot, 0.5);
            // The prediction aims at 0.475. Counts grow in blocks of about a
            // quarter of the count, which takes the error further down.
            let reached = rmse_at(&mut model, &prediction);
            assert!(reached <= 0.5 && reached > 0.44, "slope {slope}, pilot {pilot}: {reached}");
            assert!((prediction.rmse / reached - 1.0).abs() < 0.02, "{prediction:?}");
        }
    }
}

#[test]
fn predicted_noise_is_close_under_random_errors() {
    for seed in 1..=6 {
        let mut model = Model::random(clustered(600, 0.3), 64, seed);
        let prediction = predicted(&mut model, 1.0, 0.5);
        let reached = rmse_at(&mut model, &prediction);
        assert!((0.9..=1.1).contains(&(reached / 0.5)), "seed {seed}: {reached}");
    }
}

#[test]
fn predicted_blocks_are_aligned_and_never_below_the_counts_at_hand() {
    let mut model = Model::random(clustered(100, 0.5), 16, 9);
    let prediction = predicted(&mut model, 2.0, 0.5);
    for tile in &prediction.tiles {
        assert!(tile.end >= tile.base, "{tile:?}");
        let aligned = tile.end.is_multiple_of(SAMPLE_ALIGNMENT) || tile.end.is_power_of_two();
        assert!(aligned, "{tile:?}");
    }
    assert!(prediction.tiles.iter().any(|tile| tile.end > tile.base));
}

#[test]
fn reached_target_needs_no_samples_beyond_exploration() {
    let mut model = Model::exact(clustered(100, 0.5));
    let prediction = predicted(&mut model, 0.5, 0.55);
    assert!(prediction.tiles.iter().all(|tile| tile.end == tile.base), "{prediction:?}");
}

#[test]
fn schedule_of_samples_predicts_what_the_schedule_does() {
    let mut model = Model::exact(clustered(100, 0.5));
    let (mut schedule, _) = model.finish(until(noise(1.0), true));
    schedule.settings.stop = noise(0.5);
    let planned = |tile: &Tile| PlannedTile {
        base: 0,
        end: tile.done,
        rays_per_sample: tile.rays_per_sample() as f32,
        glossy: tile.glossy,
        earlier: Default::default(),
    };
    let tiles: Vec<_> = schedule.tiles.iter().map(planned).collect();
    let pixels: Vec<_> = schedule.tiles.iter().map(|tile| tile.pixels).collect();
    let errors: Vec<_> = schedule.tile_estimates().collect();
    let again = Schedule::of_planned(&tiles, &pixels, &errors, until(noise(0.5), true));
    assert_eq!(again.samples, schedule.samples);
    let ratio = again.rays as f64 / schedule.rays as f64;
    assert!((ratio - 1.0).abs() < 1e-6, "`rays_per_sample` has 24 bits: {ratio}");
    assert_eq!(again.noise, schedule.noise);
    let slopes = schedule.predict([0.5; 2], Goal::TO_TARGET).unwrap().slopes;
    let (a, b) = (
        schedule.predict(slopes, Goal::TO_TARGET).unwrap(),
        again.predict(slopes, Goal::TO_TARGET).unwrap(),
    );
    let total = |p: &Prediction| p.tiles.iter().map(|tile| tile.end).sum::<u32>() as f64;
    assert!((total(&a) / total(&b) - 1.0).abs() < 0.1, "{} {}", total(&a), total(&b));
}
