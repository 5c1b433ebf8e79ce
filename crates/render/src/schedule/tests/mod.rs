//! Tests of the schedule of samples, with simulated pictures in place of a film.

mod adaptive;
mod changes;
mod prediction;
mod stops;

use crate::film::testing::Rng;
use crate::film::{ByMeasure, TileNoise};
use crate::schedule::*;
use crate::wave::{JobReport, WaveReport};

/// Value of [`TileNoise::squares`] in all simulated estimates: that of an error spread over very
/// many pixels.
const SPREAD_OUT: ByMeasure = ByMeasure { linear: f64::MIN_POSITIVE, levels: f64::MIN_POSITIVE };
/// Light period of the simulated pictures, in samples per replicate. From this count on, the tiles
/// in [`Model::periodic`] have no error.
const PERIOD: f64 = 16.0;
/// Number of pixels of each simulated tile.
const PIXELS: u32 = 256;

/// Simulated tile. After n samples in a replicate, the RMSE of the replicate is `sigma * n^-slope`.
#[derive(Clone, Copy)]
struct Truth {
    sigma: f64,
    slope: f64,
    glossy: bool,
    rays_per_sample: u64,
}

const CALM: Truth = Truth { sigma: 0.0, slope: 0.5, glossy: false, rays_per_sample: 2 };
const NOISY: Truth = Truth { sigma: 40.0, slope: 0.5, glossy: true, rays_per_sample: 3 };

/// Simulated picture. After each wave it reports the estimated errors of tiles, as a film does.
struct Model {
    truth: Vec<Truth>,
    pixels: Vec<u32>,
    /// Samples per pixel of each simulated tile: `[replicate][tile]`.
    counts: [Vec<u32>; 2],
    /// Independent errors of each simulated tile: `[replicate][tile][error]`. Each is a random
    /// walk, the sum of the errors of all samples so far. The innermost lists are empty if the
    /// picture has exact errors instead of random ones.
    walks: [Vec<Vec<f64>>; 2],
    rng: Rng,
    waves: usize,
    /// `true` if each job must start at a sample index that is a multiple of [`SAMPLE_ALIGNMENT`],
    /// or a power of two below [`SAMPLE_ALIGNMENT`].
    aligned: bool,
    /// Numbers of the tiles with errors only in their validation pixels, which do not select tiles
    /// for samples. The allocation estimate of these tiles is 0.
    hidden: Vec<usize>,
    /// Numbers of the tiles that have no error from [`PERIOD`] samples per replicate on.
    periodic: Vec<usize>,
    /// Value of [`Schedule::light_period`]: the number of samples that together trace a shadow ray
    /// to each light once.
    light_period: u32,
}

impl Model {
    fn exact(truth: Vec<Truth>) -> Self {
        let tiles = truth.len();
        Self {
            truth,
            pixels: vec![PIXELS; tiles],
            counts: [vec![0; tiles], vec![0; tiles]],
            walks: [vec![vec![]; tiles], vec![vec![]; tiles]],
            rng: Rng(1),
            waves: 0,
            aligned: true,
            hidden: Vec::new(),
            periodic: Vec::new(),
            light_period: 1,
        }
    }

    /// Creates a simulated picture with random errors, RMSE ~ n^-0.5 for n samples. The error of
    /// each tile is the root mean square of `effective` independent values.
    fn random(truth: Vec<Truth>, effective: usize, seed: u64) -> Self {
        let tiles = truth.len();
        let walks = vec![vec![0.0; effective]; tiles];
        Self { walks: [walks.clone(), walks], rng: Rng(seed), ..Self::exact(truth) }
    }

    /// Returns the noise estimate of a tile from the difference of its replicates A and B. Both
    /// must have equally many samples.
    fn estimate(&self, tile: usize) -> TileNoise {
        let n = f64::from(self.counts[0][tile]);
        let [a, b] = [&self.walks[0][tile], &self.walks[1][tile]];
        let mse = |levels: f64| ByMeasure { levels, linear: levels * 1e-6 };
        let [mut allocation, mut reported] = [0, 1].map(|half| {
            if a.is_empty() {
                return mse(self.true_mse(tile));
            }
            let values = a.iter().zip(b).skip(half).step_by(2);
            let squares: f64 = values.map(|(a, b)| ((a - b) / n).powi(2)).sum();
            mse(squares / 2.0 / a.len() as f64)
        });
        if self.hidden.contains(&tile) {
            (allocation, reported) = (mse(0.0), mse(2.0 * reported.levels));
        }
        let samples = self.counts[0][tile];
        TileNoise {
            reported,
            allocation,
            squares: SPREAD_OUT,
            captures: Default::default(),
            sliver: 0.0,
            pixels: PIXELS,
            samples,
        }
    }

    /// Returns the true mean squared error of the mean of both replicates in a tile.
    fn true_mse(&self, tile: usize) -> f64 {
        let t = self.truth[tile];
        let n = f64::from(self.counts[0][tile]);
        let [a, b] = [&self.walks[0][tile], &self.walks[1][tile]];
        if self.periodic.contains(&tile) && n >= PERIOD {
            return 0.0;
        }
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
        wave.jobs.iter().map(|job| Some(self.job(wave, job))).collect()
    }

    fn job(&mut self, wave: &Wave, job: &Job) -> JobReport {
        let tile = job.tile as usize;
        let count = &mut self.counts[wave.replicate][tile];
        assert_eq!(*count, job.first, "tile {tile}: every index once, in order");
        assert!(job.count > 0);
        let packets = job.first.is_multiple_of(SAMPLE_ALIGNMENT);
        let early = job.first < SAMPLE_ALIGNMENT && job.first.is_power_of_two();
        assert!(packets || early || !self.aligned, "{job:?}");
        *count += job.count;
        let truth = self.truth[tile];
        let step = truth.sigma * f64::from(job.count).sqrt();
        for sum in &mut self.walks[wave.replicate][tile] {
            *sum += step * self.rng.normal();
        }
        // As in a film, there is no estimate while replicate B has fewer samples than replicate A.
        let equal = self.counts[0][tile] == self.counts[1][tile];
        let error = (wave.estimate && equal).then(|| self.estimate(tile));
        let rays = u64::from(job.count) * u64::from(self.pixels[tile]) * truth.rays_per_sample;
        JobReport { rays, glossy: truth.glossy, error }
    }

    fn schedule(&self, settings: Settings) -> Schedule {
        let light_period = self.light_period;
        Schedule { light_period, ..Schedule::new(&self.pixels, settings) }
    }

    /// Renders the simulated picture to the end, at one nanosecond per ray. Returns the schedule
    /// and the reason for the end. Panics if the render does not end.
    fn finish(&mut self, settings: Settings) -> (Schedule, StoppedBy) {
        let mut schedule = self.schedule(settings);
        for _ in 0..100_000 {
            match schedule.next(schedule.rays as f64 * 1e-9) {
                Step::Finished(reason) => return (schedule, reason),
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
    Settings { adaptive, ..Settings::until(stop) }
}

fn noise(levels: f64) -> Stop {
    Stop { noise_levels: Some(levels), ..Stop::default() }
}

fn spp(spp: u32) -> Stop {
    Stop { spp: Some(spp), ..Stop::default() }
}

/// Returns `tiles` simulated tiles. The fraction `share` of them is noisy: the first ones of the
/// list, because noisy tiles of real pictures are neighbours too.
fn clustered(tiles: usize, share: f64) -> Vec<Truth> {
    (0..tiles).map(|i| if (i as f64) < share * tiles as f64 { NOISY } else { CALM }).collect()
}

fn model_of(truth: Truth) -> Model {
    Model::exact(vec![truth; 25])
}
