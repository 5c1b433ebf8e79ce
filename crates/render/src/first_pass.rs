//! First pass over a picture: traces the first sample of every pixel in stages, from a coarse
//! lattice of pixels to all pixels.

use crate::film::{Film, TILE, TILE_PIXELS, Tile, TileHandle, lattice_pixels};
use crate::pass::{PassContext, TileRenderer};
use crate::wave::{JobReport, Wave, WaveReport};
use rayon::prelude::*;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use zerkalo_kernel::lanes::SimdFloat;
use zerkalo_world::{Counts, TileTracer, World};

/// Number of adjacent tiles that share packets in stages that add only a few pixels to each tile.
const STRIP_TILES: usize = 8;

/// Largest step \[pixels\] of a stage in which one tile has enough pixels to fill packets.
const SHARED_ABOVE: usize = 2;

/// Time after which the first stage can be cancelled. The first stage of most scenes is complete
/// before, so that there is a coarse picture while the scene is being edited.
const FIRST_STAGE: Duration = Duration::from_millis(250);

/// Traces the first sample of every pixel in the tiles of `wave`, in replicate A: first every 8th
/// pixel in x and y, then in three stages the pixels between, with steps of 4, 2 and 1. Calls
/// `on_stage` with the film after every stage except the last. A cancelled pass starts no jobs of
/// later stages, nor of a first stage that is slow, and returns `None`.
pub fn run<L: SimdFloat>(
    world: &World<L>,
    film: &mut Film,
    wave: &Wave,
    context: PassContext,
    on_stage: &mut dyn FnMut(&Film),
) -> Option<WaveReport> {
    let PassContext { pool, cancel, .. } = context;
    let renderer = TileRenderer::new(world, &context);
    let tiles: Vec<usize> = wave.jobs.iter().map(|job| job.tile as usize).collect();
    let mut counts = vec![Counts::default(); tiles.len()];
    let mut previous_step = 0;
    let start = Instant::now();
    for step in [8, 4, 2, 1] {
        let mut strips: Vec<(Vec<TileHandle>, &mut [Counts])> = Vec::new();
        let mut slots = film.slots(&tiles).into_iter();
        for counts in counts.chunks_mut(STRIP_TILES) {
            strips.push((slots.by_ref().take(counts.len()).collect(), counts));
        }
        let complete = pool.install(|| {
            strips
                .into_par_iter()
                .map(|(slots, counts)| {
                    let may_end = step != 8 || start.elapsed() >= FIRST_STAGE;
                    if may_end && cancel.load(Ordering::Relaxed) {
                        return false;
                    }
                    renderer.lattice(slots, (previous_step, step), counts);
                    true
                })
                .reduce(|| true, |a, b| a & b)
        });
        if complete && step != 1 {
            on_stage(film);
        }
        if !complete || (step != 1 && cancel.load(Ordering::Relaxed)) {
            return None;
        }
        previous_step = step;
    }
    let report = |c: Counts| Some(JobReport { rays: c.rays, glossy: c.glossy, error: None });
    Some(counts.into_iter().map(report).collect())
}

struct StripPixel {
    /// Index of the tile in its strip.
    tile: usize,
    /// Number of the pixel in its tile, row by row.
    pixel: usize,
    position: (u32, u32),
}

/// Returns the pixels of `tiles` that a stage adds: those whose x and y are multiples of `step`,
/// but not both multiples of `previous_step` (0: none are left out). `tiles` has the first pixel of
/// each tile.
fn pixels_to_add(
    tiles: &[([usize; 2], &mut Tile)],
    (previous_step, step): (usize, usize),
) -> Vec<StripPixel> {
    let mut pixels = Vec::with_capacity(TILE_PIXELS);
    for (index, (origin, tile)) in tiles.iter().enumerate() {
        let extent = tile.extent;
        let inside = |p: &usize| p % TILE < extent[0] && p / TILE < extent[1];
        pixels.extend(lattice_pixels(previous_step, step).filter(inside).map(|pixel| {
            let (x, y) = (origin[0] + pixel % TILE, origin[1] + pixel / TILE);
            StripPixel { tile: index, pixel, position: (x as u32, y as u32) }
        }));
    }
    pixels
}

impl<L: SimdFloat> TileRenderer<'_, L> {
    /// Traces the pixels that one stage adds to adjacent tiles. `steps` has the lattice steps of
    /// the previous stage (0: none) and of this stage.
    fn lattice(&self, slots: Vec<TileHandle>, steps: (usize, usize), counts: &mut [Counts]) {
        let mut tiles: Vec<_> =
            slots.into_iter().map(|slot| (slot.origin, slot.prepare())).collect();
        let (_, step) = steps;
        if step > SHARED_ABOVE {
            let pixels = pixels_to_add(&tiles, steps);
            let tracer = self.tracer.scattered(0, pixels.iter().map(|p| p.position));
            self.add_pixels(&mut tiles, tracer, &pixels, counts);
        } else {
            for (tile, counts) in tiles.chunks_mut(1).zip(counts.chunks_mut(1)) {
                let pixels = pixels_to_add(tile, steps);
                let (origin, extent) = (tile[0].0, tile[0].1.extent);
                let positions = pixels.iter().map(|p| p.position);
                if let Some(culled) = self.tracer.tile(origin, extent) {
                    let tracer = self.tracer.pixels(&culled, 0, positions);
                    self.add_pixels(tile, tracer, &pixels, counts);
                }
            }
        }
        tiles.into_iter().for_each(|(_, tile)| tile.set_lattice(step));
    }

    /// Traces the first sample of each of `pixels` with `tracer`, which was created for them.
    fn add_pixels(
        &self,
        tiles: &mut [([usize; 2], &mut Tile)],
        mut tracer: TileTracer<L>,
        pixels: &[StripPixel],
        counts: &mut [Counts],
    ) {
        tracer.radiance_shared::<1>(0, |packet, radiance| {
            let packet_pixels = &pixels[packet];
            self.replace_faults(radiance, |lane, fault| {
                if let Some(pixel) = packet_pixels.get(lane) {
                    tiles[pixel.tile].1.count_fault(fault);
                }
            });
            self.sum_by_pixel::<1, _>(radiance, packet_pixels, |p, group, sums| {
                tiles[p.tile].1.add_group(0, p.pixel, group, sums);
            });
        });
        // The rays of packets with pixels of several tiles are divided among the tiles in
        // proportion to their pixels, so that ray counts do not depend on the packet width. Random
        // choices are recorded only for packets of a single tile.
        let packet_counts = tracer.counts();
        if let [counts] = counts {
            counts.rays += packet_counts.rays;
            counts.glossy |= packet_counts.glossy;
        } else {
            let (rays, sharing) = (packet_counts.rays, pixels.len().max(1) as u64);
            counts[0].rays += rays % sharing;
            pixels.iter().for_each(|p| counts[p.tile].rays += rays / sharing);
        }
    }
}
