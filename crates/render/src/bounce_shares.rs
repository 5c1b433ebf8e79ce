//! Shares of the bounces in the noise of a picture. The noisiest tiles are traced again with shorter
//! paths.
//!
//! Let e(k) be the squared difference of the replicates' means, as displayed, of paths with at most k
//! bounces. The share of bounce k is (e(k) - e(k - 1)) / e(all): the fall of the noise if paths end one
//! bounce earlier.

use crate::RenderState;
use crate::error_probe::radiance_of;
use crate::film::{Display, Replicates, TILE};
use rayon::prelude::*;
use std::time::Instant;
use zerkalo_kernel::lanes::Double;
use zerkalo_world::{self as world, AnyWorld, CameraTracer, Precision, World};

/// Least and largest number of samples of each replicate in each pixel. Between them, it is that of the
/// film, because the noise of later bounces falls more slowly.
const SAMPLES: [u32; 2] = [8, 32];
/// Number of shares: paths without a bounce, with one, with two, and with more.
pub const BOUNCE_SHARES: usize = 4;

/// Differences of the means of the replicates of each pixel, in radiance.
type Differences = Vec<[f64; 3]>;

impl RenderState {
    /// Returns the share of each bounce in the noise of `tiles`, as many of which as `seconds` permit
    /// are traced, in their order. Returns `None` if these have no noise.
    pub(crate) fn bounce_shares(
        &self,
        tiles: &[usize],
        seconds: f64,
        pool: &rayon::ThreadPool,
    ) -> Option<[f64; BOUNCE_SHARES]> {
        let options =
            world::Options { precision: Precision::Double, merge_lights: self.merge_lights };
        let AnyWorld::Double(mut world) = AnyWorld::compile(&self.lighting.compiled, &options)
        else {
            unreachable!("the precision is double")
        };
        let started = Instant::now();
        let part = seconds / BOUNCE_SHARES as f64;
        let traced = |world: &World<Double>, tiles: &[usize]| -> Vec<Differences> {
            let tracer = world.camera_tracer(self.sampling());
            pool.install(|| tiles.par_iter().map(|tile| self.differences(&tracer, *tile)).collect())
        };
        let mut whole = Vec::new();
        for some in tiles.chunks(4 * pool.current_num_threads()) {
            whole.extend(traced(&world, some));
            if started.elapsed().as_secs_f64() > part {
                break;
            }
        }
        let tiles = &tiles[..whole.len()];
        let error = |differences: &[Differences]| -> f64 {
            tiles.iter().zip(differences).map(|(tile, of)| self.displayed_error(*tile, of)).sum()
        };
        let all = error(&whole);
        let mut errors = [all; BOUNCE_SHARES];
        let limits = self.lighting.compiled.trace.clone();
        // A limit of 0 cannot be raised again.
        for bounces in (0..BOUNCE_SHARES - 1).rev() {
            let at_most = |limit: u32| limit.min(bounces as u32);
            let mut shorter = limits.clone();
            shorter.max_depth = at_most(limits.max_depth);
            shorter.max_diffuse_depth = at_most(limits.max_diffuse_depth);
            world.lengthen_paths(&shorter, 0);
            errors[bounces] = error(&traced(&world, tiles));
        }
        let longer = |k: usize| errors[k] - if k == 0 { 0.0 } else { errors[k - 1] };
        let shares: [f64; BOUNCE_SHARES] = std::array::from_fn(|k| longer(k).max(0.0));
        let sum: f64 = shares.iter().sum();
        (sum > 0.0).then(|| shares.map(|share| share / sum))
    }

    fn differences(&self, tracer: &CameraTracer<Double>, tile: usize) -> Differences {
        let columns = self.film.tile_columns();
        let origin = [tile % columns * TILE, tile / columns * TILE];
        let samples = (self.film.spp(tile) / 2).clamp(SAMPLES[0], SAMPLES[1]);
        let Some(extent) = self.film.tile(tile).map(|tile| tile.extent) else { return Vec::new() };
        let mut out = vec![[0.0; 3]; extent[0] * extent[1]];
        let Some(culled) = tracer.tile(origin, extent) else { return out };
        for (replicate, sign) in [(0, 1.0), (1, -1.0)] {
            let pixel = |i: usize| (origin[0] + i % extent[0], origin[1] + i / extent[0]);
            let pixels = (0..out.len()).map(pixel).map(|(x, y)| (x as u32, y as u32));
            let mut pixels = tracer.pixels(&culled, replicate, pixels);
            for sample in 0..samples {
                pixels.radiance_shared::<1>(sample, |packet, radiance| {
                    for (lane, pixel) in packet.enumerate() {
                        let radiance = radiance_of(radiance, lane, &self.weights);
                        (0..3).for_each(|c| {
                            out[pixel][c] += sign * radiance[c] / f64::from(samples);
                        });
                    }
                });
            }
        }
        out
    }

    /// Returns the squared error in levels of a tile of which the film has the mean, summed over its
    /// pixels. From the traced samples to those of the film, it falls with their square root.
    fn displayed_error(&self, tile: usize, differences: &Differences) -> f64 {
        let Some(film) = self.film.tile(tile) else { return 0.0 };
        let per_unit = self.weights.radiance_per_step(&self.film.header.scales);
        let display: Display = self.display();
        let spp = self.film.spp(tile).max(2);
        let traced = 2 * (spp / 2).clamp(SAMPLES[0], SAMPLES[1]);
        let scale = 0.25 * (f64::from(traced) / f64::from(spp)).sqrt();
        let error = |(i, difference): (usize, &[f64; 3])| {
            let pixel = film.sums(i / film.extent[0] * TILE + i % film.extent[0]);
            let mean = pixel.mean(Replicates::Both, &per_unit);
            let levels = |sign: f64| {
                display.levels([0, 1, 2].map(|c| (mean[c] + sign * scale * difference[c]).max(0.0)))
            };
            let (above, below) = (levels(1.0), levels(-1.0));
            (0..3).map(|c| (above[c] - below[c]).powi(2)).sum::<f64>()
        };
        differences.iter().enumerate().map(error).sum()
    }
}
