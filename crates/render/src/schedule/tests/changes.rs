//! Tests of changes during a render: other stop criteria, other noise estimates, and waves of which
//! only a part is traced.

use crate::schedule::tests::*;

/// Renders the simulated picture to the end in pieces. Before each wave is traced, [`Wave::cut`]
/// shortens its jobs to at most `longest` samples per pixel. It then keeps jobs with about `tiles`
/// times `longest` samples per pixel in total. Later waves trace what was cut off.
fn finish_in_pieces(
    model: &mut Model,
    schedule: &mut Schedule,
    tiles: u64,
    longest: u32,
) -> StoppedBy {
    loop {
        match schedule.next(0.0) {
            Step::Finished(reason) => return reason,
            Step::Trace(wave) => {
                let piece = wave.cut(tiles * u64::from(longest) * u64::from(PIXELS), longest);
                assert!(piece.jobs.iter().all(|job| job.count <= longest));
                let report = model.run(&piece);
                schedule.complete(&piece, &report);
            }
        }
    }
}

fn mixed() -> Vec<Truth> {
    (0..36).map(|i| if i % 3 == 0 { NOISY } else { Truth { sigma: 4.0, ..CALM } }).collect()
}

#[test]
fn pieces_do_not_change_rounds() {
    for adaptive in [false, true] {
        let settings = until(noise(0.6), adaptive);
        let (whole, reason) = Model::exact(mixed()).finish(settings);
        for (tiles, longest) in
            [(1, SAMPLE_ALIGNMENT), (5, 2 * SAMPLE_ALIGNMENT), (100, 3 * SAMPLE_ALIGNMENT)]
        {
            let mut model = Model::exact(mixed());
            let mut schedule = model.schedule(settings);
            assert_eq!(finish_in_pieces(&mut model, &mut schedule, tiles, longest), reason);
            let done = |s: &Schedule| s.tiles.iter().map(|t| t.done).collect::<Vec<_>>();
            assert_eq!(done(&schedule), done(&whole), "{tiles} x {longest}, adaptive {adaptive}");
            assert_eq!((schedule.samples, schedule.rays), (whole.samples, whole.rays));
            assert_eq!(schedule.noise, whole.noise);
        }
    }
}

#[test]
fn higher_target_resumes_after_the_lower_one() {
    for adaptive in [false, true] {
        for low in [2, 6, 22, 50, 150] {
            let mut model = Model::exact(mixed());
            let mut schedule = model.schedule(until(spp(low), adaptive));
            assert_eq!(
                finish_in_pieces(&mut model, &mut schedule, 100, MAX_SAMPLES),
                StoppedBy::Spp
            );
            assert_eq!(schedule.spp().mean, f64::from(low));
            schedule.settings.stop = spp(2000);
            // Jobs may now start at any sample index. The simulated picture still panics if samples
            // are repeated or out of order.
            model.aligned = false;
            let mut ends = Vec::new();
            while let Step::Trace(wave) = schedule.next(0.0) {
                let even = |j: &Job| {
                    let end = j.first + j.count;
                    end.is_multiple_of(SAMPLE_ALIGNMENT)
                        || (end < SAMPLE_ALIGNMENT && end.is_power_of_two())
                };
                ends.push(wave.jobs.iter().all(even));
                let report = model.run(&wave);
                schedule.complete(&wave, &report);
            }
            // Jobs end at aligned counts in all rounds but the last, which adds the remaining
            // samples. The last two waves are those of the last round, for the replicates A and B.
            assert!(ends[..ends.len() - 2].iter().all(|even| *even), "after {low} {adaptive}");
            assert_eq!(schedule.spp().mean, 2000.0);
            // The lower target is reached at once.
            schedule.settings.stop = spp(low);
            assert_eq!(schedule.next(0.0), Step::Finished(StoppedBy::Spp));
            schedule.settings.stop = noise(1e6);
            assert_eq!(schedule.next(0.0), Step::Finished(StoppedBy::Noise));
        }
    }
}

#[test]
fn new_estimates_replace_the_old_ones() {
    let mut model = Model::exact(mixed());
    let mut schedule = model.schedule(until(noise(0.6), true));
    finish_in_pieces(&mut model, &mut schedule, 100, MAX_SAMPLES);
    let (before, samples) = (schedule.noise.unwrap(), schedule.samples);
    schedule.forget_estimates();
    assert_eq!((schedule.noise, schedule.eta_seconds(1.0)), (None, None));
    // The picture becomes three times as bright on the display, and its error three times as large.
    model.truth.iter_mut().for_each(|t| t.sigma *= 3.0);
    let estimates: Vec<_> = (0..36).map(|tile| Some(model.estimate(tile))).collect();
    schedule.set_estimates(&estimates);
    let after = schedule.noise.unwrap();
    assert!((after.rmse.levels / before.rmse.levels - 3.0).abs() < 1e-9);
    assert_eq!(schedule.samples, samples);
    // The convergence of the new picture is unknown. The estimated range is wide, but contains the
    // true time.
    let Interval { low, high } = schedule.eta_seconds(1.0).unwrap();
    assert!(high > 2.0 * low, "{low}..{high}");
    let rays = schedule.rays as f64;
    assert_eq!(finish_in_pieces(&mut model, &mut schedule, 100, MAX_SAMPLES), StoppedBy::Noise);
    assert!((model.rmse() / 0.6 - 1.0).abs() < 0.1);
    let needed = schedule.rays as f64 / rays - 1.0;
    assert!((low..high).contains(&needed), "{needed} not in {low}..{high}");
}

#[test]
fn cap_may_rise_and_fall() {
    let mut model = Model::exact(mixed());
    let mut schedule = model.schedule(until(spp(100), false));
    schedule.settings.rays_per_pixel = 40;
    assert_eq!(finish_in_pieces(&mut model, &mut schedule, 100, MAX_SAMPLES), StoppedBy::Spp);
    assert_eq!((schedule.spp().min, schedule.spp().max), (40, 100));
    schedule.settings.rays_per_pixel = 0;
    // The cap was 20 samples per replicate, which is no multiple of `SAMPLE_ALIGNMENT`. Jobs after
    // it start at unaligned samples.
    model.aligned = false;
    assert_eq!(finish_in_pieces(&mut model, &mut schedule, 100, MAX_SAMPLES), StoppedBy::Spp);
    assert_eq!((schedule.spp().min, schedule.spp().max), (100, 100));
}

#[test]
fn tiles_outside_of_a_region_rest_until_it_ends() {
    let mut model = Model::exact(vec![NOISY; 100]);
    let mut schedule = model.schedule(until(noise(1.0), true));
    schedule.set_resting(|tile| tile >= 30);
    let end = finish_in_pieces(&mut model, &mut schedule, 100, MAX_SAMPLES);
    assert_eq!(end, StoppedBy::RaysPerPixel);
    let (inside, outside) = schedule.tiles.split_at(30);
    assert!(outside.iter().all(|tile| tile.done == MIN_SAMPLES));
    assert!(inside.iter().all(|tile| (600..1200).contains(&tile.done)), "sigma 40: to 1 level");
    assert!(schedule.noise.unwrap().rmse.levels > 10.0, "the noise is that of the whole picture");
    schedule.set_resting(|_| false);
    let end = finish_in_pieces(&mut model, &mut schedule, 100, MAX_SAMPLES);
    assert_eq!((end, schedule.noise.unwrap().rmse.levels <= 1.0), (StoppedBy::Noise, true));
    // A region goes on where the whole picture has converged.
    schedule.set_resting(|tile| tile != 7);
    schedule.tiles[7].error.iter_mut().for_each(|error| error.reported.levels *= 16.0);
    let before = schedule.tiles[7].done;
    finish_in_pieces(&mut model, &mut schedule, 100, MAX_SAMPLES);
    assert!(schedule.tiles[7].done > before && schedule.tiles[8].done < 2 * before);
}

/// Checks that a render to a mean number of samples, which is saved and resumed to more samples,
/// gives every tile as many samples as a render without interruption.
#[test]
fn resumed_sample_counts_are_those_of_a_whole_render() {
    let truth: Vec<_> =
        (0..36).map(|i| Truth { sigma: f64::from(1 + i * i % 40), ..NOISY }).collect();
    let done = |s: &Schedule| s.tiles.iter().map(|t| t.done).collect::<Vec<_>>();
    for adaptive in [false, true] {
        let (whole, _) = Model { aligned: false, ..Model::exact(truth.clone()) }
            .finish(until(spp(300), adaptive));
        for first in [2, 6, 8, 10, 22, 33, 50, 75, 128, 150] {
            let mut model = Model { aligned: false, ..Model::exact(truth.clone()) };
            let mut state = None;
            for end in [first, first + 2, first + 3, 2 * first, 300] {
                let settings = until(spp(end), adaptive);
                let mut schedule = model.schedule(settings);
                let counts = model.counts[0].iter().zip(&model.counts[1]);
                let counts: Vec<_> = counts.map(|(a, b)| [*a, *b]).collect();
                state.iter().for_each(|s: &Vec<u8>| schedule.restore(s, &counts).unwrap());
                let reason = finish_in_pieces(&mut model, &mut schedule, 7, 32);
                assert_eq!((reason, schedule.settings), (StoppedBy::Spp, settings));
                state = Some(schedule.encode());
                if end == 300 {
                    assert_eq!(done(&schedule), done(&whole), "{first}, adaptive {adaptive}");
                    assert_eq!(schedule.noise, whole.noise);
                }
            }
        }
    }
}
