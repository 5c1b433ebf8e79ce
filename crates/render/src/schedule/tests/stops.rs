//! Tests of the numbers of samples in a wave, of stop criteria and of estimated remaining times.

use crate::schedule::tests::*;

#[test]
fn waves_are_aligned_to_the_sequence() {
    let mut model = Model::exact(vec![NOISY; 4]);
    let mut schedule = model.schedule(until(spp(100), false));
    let mut seen = Vec::new();
    while let Step::Trace(wave) = schedule.next(0.0) {
        assert_eq!(wave.jobs.len(), 4);
        seen.push((wave.replicate, wave.jobs[0].first, wave.jobs[0].count));
        let report = model.run(&wave);
        schedule.complete(&wave, &report);
    }
    let blocks = [(0, 1), (1, 1), (2, 2), (4, 4), (8, 8), (16, 16), (32, 16), (48, 2)];
    let expected: Vec<_> = blocks.iter().flat_map(|(f, c)| [(0, *f, *c), (1, *f, *c)]).collect();
    assert_eq!(seen, expected);
    assert_eq!(schedule.next(0.0), Step::Finished(StoppedBy::Spp));
    assert_eq!(schedule.spp(), Spp { min: 100, mean: 100.0, max: 100 });
    assert_eq!(schedule.samples, 100 * 4 * 256);
    assert!(schedule.noise.is_some(), "the last wave ends with an estimate");
}

#[test]
fn spp_rounds_up_to_even_and_two_samples_have_a_noise() {
    for (requested, traced) in [(1, 2), (2, 2), (7, 8), (33, 34)] {
        for adaptive in [false, true] {
            let mut model = Model::exact(vec![CALM; 9]);
            let (schedule, reason) = model.finish(until(spp(requested), adaptive));
            assert_eq!(reason, StoppedBy::Spp);
            assert_eq!(schedule.spp().mean, f64::from(traced), "{requested} adaptive {adaptive}");
            assert!(schedule.noise.is_some());
        }
    }
}

#[test]
fn caps_hold_for_glossy_tiles_only() {
    for adaptive in [false, true] {
        let mut model = Model::exact(clustered(100, 0.5));
        model.truth.iter_mut().for_each(|t| t.sigma = 30.0);
        let settings = Settings { rays_per_pixel: 41, ..until(noise(1.0), adaptive) };
        let (schedule, reason) = model.finish(settings);
        assert_eq!(reason, StoppedBy::RaysPerPixel, "adaptive {adaptive}");
        assert!(schedule.tiles.iter().all(|t| !t.glossy || t.done == 20));
        assert!(schedule.tiles.iter().any(|t| !t.glossy && t.done > 200));
        assert!(
            schedule.noise.unwrap().rmse.levels > 1.0,
            "the noise is that of the whole picture"
        );

        // All tiles are glossy, and noisy. When each has the largest number of samples per pixel
        // (the cap), no work is left.
        let mut model = Model::exact(vec![NOISY; 25]);
        let (schedule, reason) = model.finish(settings);
        assert_eq!((reason, schedule.spp().max), (StoppedBy::RaysPerPixel, 40));
        // A mean sample count below the cap is reached in spite of the cap.
        let (_, reason) = model_of(NOISY).finish(Settings { stop: spp(30), ..settings });
        assert_eq!(reason, StoppedBy::Spp);
    }
}

#[test]
fn time_ends_the_work_with_equal_replicates() {
    let mut model = model_of(NOISY);
    let stop = Stop { seconds: Some(1e-3), ..Stop::default() };
    let (schedule, reason) = model.finish(until(stop, true));
    assert_eq!(reason, StoppedBy::Time);
    assert_eq!(model.counts[0], model.counts[1]);
    assert!(schedule.spp().min >= 2);
    // A time limit of 0 still gives a picture.
    let stop = Stop { seconds: Some(0.0), ..Stop::default() };
    let (schedule, _) = model_of(NOISY).finish(until(stop, true));
    assert_eq!(schedule.spp().min, 2);
}

#[test]
fn time_is_overshot_by_little() {
    for tiles in [1, 12, 400] {
        for adaptive in [false, true] {
            let stop = Stop { seconds: Some(0.5), ..Stop::default() };
            let mut model = Model::exact(vec![NOISY; tiles]);
            let (schedule, _) = model.finish(until(stop, adaptive));
            // One ray takes a nanosecond.
            let seconds = schedule.rays as f64 * 1e-9;
            assert!(seconds < 0.66, "{tiles} tiles, adaptive {adaptive}: {seconds} s");
        }
    }
}

#[test]
fn first_reached_criterion_ends_the_work() {
    let stop = Stop { spp: Some(64), noise_levels: Some(1e-3), ..Stop::default() };
    assert_eq!(model_of(NOISY).finish(until(stop, true)).1, StoppedBy::Spp);
    let stop = Stop { spp: Some(1 << 20), rmse_linear: Some(1e-3), ..Stop::default() };
    assert_eq!(model_of(NOISY).finish(until(stop, true)).1, StoppedBy::Rmse);
}

#[test]
fn clean_picture_ends_at_the_minimum_of_sparse_ones() {
    let (schedule, reason) = model_of(CALM).finish(until(noise(0.5), true));
    let spp = schedule.spp();
    assert_eq!(
        (reason, spp.min, spp.max),
        (StoppedBy::Noise, 2 * SPARSE_MIN_SAMPLES, 2 * SPARSE_MIN_SAMPLES)
    );
}

#[test]
fn cancelled_jobs_are_traced_later() {
    let mut model = Model::random(clustered(100, 0.5), 16, 3);
    let mut whole = Model::random(clustered(100, 0.5), 16, 3);
    let settings = until(spp(100), false);
    let (expected, _) = whole.finish(settings);
    let mut schedule = model.schedule(settings);
    let mut cancelled = 0;
    while let Step::Trace(wave) = schedule.next(0.0) {
        // Only the first third of every wave is traced.
        let part = wave.jobs.len().div_ceil(3);
        cancelled += wave.jobs.len() - part;
        let run = Wave { jobs: wave.jobs[..part].to_vec(), ..wave.clone() };
        let mut report = model.run(&run);
        report.resize(wave.jobs.len(), None);
        schedule.complete(&wave, &report);
    }
    assert!(cancelled > 0);
    assert_eq!(model.counts, whole.counts);
    assert_eq!(schedule.samples, expected.samples);
}

#[test]
fn estimated_time_left_is_a_range_that_holds() {
    for slope in [0.5, 0.75, 0.95] {
        for adaptive in [false, true] {
            let mut model = model_of(Truth { slope, ..NOISY });
            let settings = until(noise(0.05), adaptive);
            let mut schedule = model.schedule(settings);
            let mut estimates = Vec::new();
            let seconds = |s: &Schedule| s.rays as f64 * 1e-9;
            while let Step::Trace(wave) = schedule.next(seconds(&schedule)) {
                let report = model.run(&wave);
                schedule.complete(&wave, &report);
                let now = seconds(&schedule);
                estimates.extend(schedule.eta_seconds(now).map(|range| (now, range)));
            }
            let end = seconds(&schedule);
            let late = estimates.iter().filter(|(now, _)| *now > 0.05 * end && *now < 0.8 * end);
            let mut checked = 0;
            for (now, Interval { low, high }) in late {
                let seconds_left = end - now;
                assert!(
                    low <= high && *low < seconds_left * 1.02 && *high > seconds_left * 0.98,
                    "slope {slope} adaptive {adaptive}: {seconds_left} not in {low}..{high}"
                );
                assert!(high / low < 1.6, "{low}..{high}");
                checked += 1;
            }
            assert!(checked > 2);
        }
    }
    let mut model = model_of(NOISY);
    let mut schedule = model.schedule(until(spp(100), false));
    assert_eq!(schedule.eta_seconds(0.0), None);
    for _ in 0..10 {
        let Step::Trace(wave) = schedule.next(1.0) else { panic!("early end") };
        let report = model.run(&wave);
        schedule.complete(&wave, &report);
    }
    // 32 of 100 samples took one second.
    let Interval { low, high } = schedule.eta_seconds(1.0).unwrap();
    assert!((low - 68.0 / 32.0).abs() < 1e-9 && low == high);
    assert!((schedule.progress(1.0).unwrap() - 0.32).abs() < 1e-9);
}

#[test]
fn p95_is_the_percentile_of_tiles() {
    let truth = (0..100).map(|i| Truth { sigma: f64::from(i), ..NOISY }).collect();
    let mut model = Model::exact(truth);
    let (schedule, _) = model.finish(until(spp(32), false));
    // The 95th of 100 tiles by error is tile 94, with sigma 94. Both replicates have 16 samples, so
    // that the RMSE of their mean is 94 / sqrt(32).
    assert!((schedule.noise.unwrap().p95_levels - 94.0 / 32f64.sqrt()).abs() < 1e-9);
}
