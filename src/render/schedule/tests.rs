//! The schedule against pictures that are nothing but numbers.

use super::*;
use crate::film::TileNoise;
use crate::render::wave::JobReport;

/// Pixels of a whole tile.
const PIXELS: u32 = 256;

/// Uniform in (0, 1) and standard normal numbers (SplitMix64, Box-Muller).
struct Chance(u64);

impl Chance {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 + f64::MIN_POSITIVE
    }
    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// A tile whose error is known: the RMSE of one replicate after n samples is `sigma * n^-slope`.
#[derive(Clone, Copy)]
struct Truth {
    sigma: f64,
    slope: f64,
    glossy: bool,
    rays_per_sample: u64,
}

const CALM: Truth = Truth { sigma: 0.0, slope: 0.5, glossy: false, rays_per_sample: 2 };
const NOISY: Truth = Truth { sigma: 40.0, slope: 0.5, glossy: true, rays_per_sample: 3 };

/// A picture that answers waves.
struct Model {
    truth: Vec<Truth>,
    pixels: Vec<u32>,
    columns: usize,
    /// Samples per replicate of each tile.
    counts: [Vec<u32>; 2],
    /// Sums of the errors of `[replicate][tile][effective pixel]`, as random walks; empty: exact.
    walks: [Vec<Vec<f64>>; 2],
    chance: Chance,
    waves: usize,
}

impl Model {
    fn exact(truth: Vec<Truth>, columns: usize) -> Self {
        let tiles = truth.len();
        Self {
            truth,
            pixels: vec![PIXELS; tiles],
            columns,
            counts: [vec![0; tiles], vec![0; tiles]],
            walks: [vec![vec![]; tiles], vec![vec![]; tiles]],
            chance: Chance(1),
            waves: 0,
        }
    }

    /// Errors by chance, for slope 0.5: each tile's error sits in `effective` independent values.
    fn random(truth: Vec<Truth>, columns: usize, effective: usize, seed: u64) -> Self {
        let tiles = truth.len();
        let walks = vec![vec![0.0; effective]; tiles];
        Self { walks: [walks.clone(), walks], chance: Chance(seed), ..Self::exact(truth, columns) }
    }

    /// The estimate from A - B, if the film holds equally many of both.
    fn estimate(&self, tile: usize) -> f64 {
        let n = f64::from(self.counts[0][tile]);
        let [a, b] = [&self.walks[0][tile], &self.walks[1][tile]];
        if a.is_empty() {
            return self.true_mse(tile);
        }
        let squares: f64 = a.iter().zip(b).map(|(a, b)| ((a - b) / n).powi(2)).sum();
        squares / 4.0 / a.len() as f64
    }

    /// The squared error that the picture (A + B) / 2 really has.
    fn true_mse(&self, tile: usize) -> f64 {
        let t = self.truth[tile];
        let n = f64::from(self.counts[0][tile]);
        let [a, b] = [&self.walks[0][tile], &self.walks[1][tile]];
        if a.is_empty() {
            return t.sigma.powi(2) * n.powf(-2.0 * t.slope) / 2.0;
        }
        a.iter().zip(b).map(|(a, b)| ((a + b) / (2.0 * n)).powi(2)).sum::<f64>() / a.len() as f64
    }

    fn rmse(&self) -> f64 {
        let sum: f64 = (0..self.truth.len()).map(|i| self.true_mse(i)).sum();
        (sum / self.truth.len() as f64).sqrt()
    }

    fn run(&mut self, wave: &Wave) -> WaveReport {
        self.waves += 1;
        let reports = wave.jobs.iter().map(|job| Some(self.job(wave, job))).collect();
        WaveReport { reports }
    }

    fn job(&mut self, wave: &Wave, job: &Job) -> JobReport {
        let tile = job.tile as usize;
        let count = &mut self.counts[wave.replicate][tile];
        assert_eq!(*count, job.first, "tile {tile}: every index once, in order");
        assert!(job.count > 0);
        let packets = job.first.is_multiple_of(PACKET);
        assert!(packets || (job.first < PACKET && job.first.is_power_of_two()), "{job:?}");
        *count += job.count;
        let truth = self.truth[tile];
        let step = truth.sigma * f64::from(job.count).sqrt();
        for sum in &mut self.walks[wave.replicate][tile] {
            *sum += step * self.chance.normal();
        }
        let error = wave.estimate.then(|| {
            assert_eq!(self.counts[0][tile], self.counts[1][tile], "estimate with unequal counts");
            let mse = self.estimate(tile);
            TileNoise { codes_mse: mse, linear_mse: mse * 1e-6, pixels: PIXELS }
        });
        let rays = u64::from(job.count) * u64::from(self.pixels[tile]) * truth.rays_per_sample;
        JobReport { rays, glossy: truth.glossy, error }
    }

    fn schedule(&self, settings: Settings) -> Schedule {
        Schedule::new(&self.pixels, self.columns, settings)
    }

    /// Runs to the end (a nanosecond per ray); panics if it does not end.
    fn finish(&mut self, settings: Settings) -> (Schedule, StoppedBy) {
        let mut schedule = self.schedule(settings);
        for _ in 0..100_000 {
            match schedule.next(schedule.rays() as f64 * 1e-9) {
                Step::Rest(reason) => return (schedule, reason),
                Step::Trace(wave) => {
                    let report = self.run(&wave);
                    schedule.complete(&wave, &report);
                }
            }
        }
        panic!("no end");
    }
}

fn until(stop: Stop, adaptive: bool) -> Settings {
    Settings { adaptive, criterion: Criterion::Codes, rays_per_pixel: 0, stop }
}

fn noise(codes: f64) -> Stop {
    Stop { noise_codes: Some(codes), ..Stop::default() }
}

fn spp(spp: u32) -> Stop {
    Stop { spp: Some(spp), ..Stop::default() }
}

/// `tiles` tiles in a square, of which the first `share` (in rows, as things in pictures cluster)
/// are noisy.
fn clustered(tiles: usize, share: f64) -> Vec<Truth> {
    (0..tiles).map(|i| if (i as f64) < share * tiles as f64 { NOISY } else { CALM }).collect()
}

#[test]
fn waves_count_as_the_sequence_likes_it() {
    let mut model = Model::exact(vec![NOISY; 4], 2);
    let mut schedule = model.schedule(until(spp(100), false));
    let mut seen = Vec::new();
    while let Step::Trace(wave) = schedule.next(0.0) {
        assert_eq!(wave.jobs.len(), 4);
        seen.push((wave.replicate, wave.jobs[0].first, wave.jobs[0].count));
        let report = model.run(&wave);
        schedule.complete(&wave, &report);
    }
    let blocks =
        [(0, 1), (1, 1), (2, 2), (4, 4), (8, 8), (16, 8), (24, 8), (32, 8), (40, 8), (48, 2)];
    let expected: Vec<_> = blocks.iter().flat_map(|(f, c)| [(0, *f, *c), (1, *f, *c)]).collect();
    assert_eq!(seen, expected);
    assert_eq!(schedule.next(0.0), Step::Rest(StoppedBy::Spp));
    assert_eq!(schedule.spp(), Spp { min: 100, mean: 100.0, max: 100 });
    assert_eq!(schedule.samples(), 100 * 4 * 256);
    assert!(schedule.noise().is_some(), "the last wave ends with an estimate");
}

#[test]
fn spp_rounds_up_to_even_and_even_two_samples_have_a_noise() {
    for (asked, given) in [(1, 2), (2, 2), (7, 8), (33, 34)] {
        for adaptive in [false, true] {
            let mut model = Model::exact(vec![CALM; 9], 3);
            let (schedule, reason) = model.finish(until(spp(asked), adaptive));
            assert_eq!(reason, StoppedBy::Spp);
            assert_eq!(schedule.spp().mean, f64::from(given), "{asked} adaptive {adaptive}");
            assert!(schedule.noise().is_some());
        }
    }
}

#[test]
fn adaptive_spp_is_the_mean_and_goes_where_the_noise_is() {
    let mut model = Model::exact(clustered(400, 0.3), 20);
    let (schedule, reason) = model.finish(until(spp(200), true));
    assert_eq!(reason, StoppedBy::Spp);
    let spp = schedule.spp();
    assert!(spp.mean <= 200.0 && spp.mean > 199.9, "{spp:?}");
    assert_eq!(spp.min, 32);
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

/// An exact model of the best order gives 8.4, 2.6 and 1.1 for tiles that differ among themselves;
/// tiles that are all alike or free of noise would give at most
/// 1 / (share + (1 - share) 32 / 1024): 12.4, 3.1 and 1.11.
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

/// Choosing tiles by the estimates that also tell the error makes the estimate too low; how much
/// must stay small, even when a tile's error sits in a few pixels.
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

#[test]
fn caps_hold_for_glossy_tiles_only() {
    for adaptive in [false, true] {
        let mut model = Model::exact(clustered(100, 0.5), 10);
        model.truth.iter_mut().for_each(|t| t.sigma = 30.0);
        let settings = Settings { rays_per_pixel: 41, ..until(noise(1.0), adaptive) };
        let (schedule, reason) = model.finish(settings);
        assert_eq!(reason, StoppedBy::RaysPerPixel, "adaptive {adaptive}");
        assert!(schedule.tiles.iter().all(|t| !t.glossy || t.done == 20));
        assert!(schedule.tiles.iter().any(|t| !t.glossy && t.done > 200));
        assert!(
            schedule.noise().unwrap().rmse_codes > 1.0,
            "the noise is that of the whole picture"
        );

        // All are glossy: nothing is left to do.
        let mut model = Model::exact(vec![NOISY; 25], 5);
        let (schedule, reason) = model.finish(settings);
        assert_eq!((reason, schedule.spp().max), (StoppedBy::RaysPerPixel, 40));
        // A cap does not keep a count from being reached.
        let (_, reason) = model_of(NOISY).finish(Settings { stop: spp(30), ..settings });
        assert_eq!(reason, StoppedBy::Spp);
    }
}

fn model_of(truth: Truth) -> Model {
    Model::exact(vec![truth; 25], 5)
}

#[test]
fn time_ends_the_work_with_both_replicates_alike() {
    let mut model = model_of(NOISY);
    let stop = Stop { seconds: Some(1e-3), ..Stop::default() };
    let (schedule, reason) = model.finish(until(stop, true));
    assert_eq!(reason, StoppedBy::Time);
    assert_eq!(model.counts[0], model.counts[1]);
    assert!(schedule.spp().min >= 2);
    // Even no time at all gives a picture.
    let stop = Stop { seconds: Some(0.0), ..Stop::default() };
    let (schedule, _) = model_of(NOISY).finish(until(stop, true));
    assert_eq!(schedule.spp().min, 2);
}

#[test]
fn whichever_comes_first() {
    let stop = Stop { spp: Some(64), noise_codes: Some(1e-3), ..Stop::default() };
    assert_eq!(model_of(NOISY).finish(until(stop, true)).1, StoppedBy::Spp);
    let stop = Stop { spp: Some(1 << 20), rmse_linear: Some(1e-3), ..Stop::default() };
    assert_eq!(model_of(NOISY).finish(until(stop, true)).1, StoppedBy::Rmse);
}

#[test]
fn a_picture_without_error_ends_at_the_floor() {
    let (schedule, reason) = model_of(CALM).finish(until(noise(0.5), true));
    assert_eq!((reason, schedule.spp().max), (StoppedBy::Noise, 32));
}

#[test]
fn cancelled_jobs_come_again() {
    let mut model = Model::random(clustered(100, 0.5), 10, 16, 3);
    let mut whole = Model::random(clustered(100, 0.5), 10, 16, 3);
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
        report.reports.resize(wave.jobs.len(), None);
        schedule.complete(&wave, &report);
    }
    assert!(cancelled > 0);
    assert_eq!(model.counts, whole.counts);
    assert_eq!(schedule.samples(), expected.samples());
}

#[test]
fn the_time_left_is_told_as_a_range_that_holds() {
    for slope in [0.5, 0.75, 0.95] {
        for adaptive in [false, true] {
            let mut model = model_of(Truth { slope, ..NOISY });
            let settings = until(noise(0.05), adaptive);
            let mut schedule = model.schedule(settings);
            let mut told = Vec::new();
            let seconds = |s: &Schedule| s.rays() as f64 * 1e-9;
            while let Step::Trace(wave) = schedule.next(seconds(&schedule)) {
                let report = model.run(&wave);
                schedule.complete(&wave, &report);
                let now = seconds(&schedule);
                told.extend(schedule.eta_seconds(now).map(|range| (now, range)));
            }
            let end = seconds(&schedule);
            let late = told.iter().filter(|(now, _)| *now > 0.05 * end && *now < 0.8 * end);
            let mut checked = 0;
            for (now, (low, high)) in late {
                let left = end - now;
                assert!(
                    low <= high && *low < left * 1.02 && *high > left * 0.98,
                    "slope {slope} adaptive {adaptive}: {left} not in {low}..{high}"
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
    // 32 of 100 samples in one second.
    let (low, high) = schedule.eta_seconds(1.0).unwrap();
    assert!((low - 68.0 / 32.0).abs() < 1e-9 && low == high);
    assert!((schedule.progress(1.0).unwrap() - 0.32).abs() < 1e-9);
}

#[test]
fn the_95th_percentile_is_that_of_tiles() {
    let truth = (0..100).map(|i| Truth { sigma: f64::from(i), ..NOISY }).collect();
    let mut model = Model::exact(truth, 10);
    let (schedule, _) = model.finish(until(spp(32), false));
    // Tile 94 is the 95th of 100: sigma 94 after 16 samples of each replicate.
    assert!((schedule.noise().unwrap().p95_codes - 94.0 / 32f64.sqrt()).abs() < 1e-9);
}
