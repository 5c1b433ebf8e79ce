//! The first sample of every pixel, coarse to fine.

use crate::film::{Film, TILE, TILE_PIXELS, Tile, TileHandle, lattice_pixels};
use crate::lanes::SimdFloat;
use crate::render::pass::{PacketScratch, TileRenderer};
use crate::render::wave::{JobReport, Wave, WaveReport};
use crate::sampling::SampleSettings;
use crate::world::{AnyWorld, Counts, TileCandidates, World};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// The first sample of replicate A in interleaved order: every 8th pixel in x and y, then the gaps in
/// three stages, each over the whole picture; `shown` sees the film after all but the last. Once `abandon`
/// is raised the later stages are left out, and there is no report.
pub fn run(
    world: &AnyWorld,
    film: &mut Film,
    wave: &Wave,
    sampling: &SampleSettings,
    pool: &rayon::ThreadPool,
    abandon: &AtomicBool,
    shown: &mut dyn FnMut(&Film),
) -> Option<WaveReport> {
    match world {
        AnyWorld::Single(w) => {
            trace_first_pass_typed(w, film, wave, sampling, pool, abandon, shown)
        }
        AnyWorld::Double(w) => {
            trace_first_pass_typed(w, film, wave, sampling, pool, abandon, shown)
        }
    }
}

/// Tiles side by side that share packets while the lattice is coarse.
const STRIP_TILES: usize = 8;

/// They do while the lattice's step is larger than this \[pixels\]; then the tiles' own pixels fill packets.
const SHARED_ABOVE: usize = 2;

fn trace_first_pass_typed<L: SimdFloat>(
    world: &World<L>,
    film: &mut Film,
    wave: &Wave,
    sampling: &SampleSettings,
    pool: &rayon::ThreadPool,
    abandon: &AtomicBool,
    shown: &mut dyn FnMut(&Film),
) -> Option<WaveReport> {
    let tracer = TileRenderer::new(world, sampling);
    let tiles: Vec<usize> = wave.jobs.iter().map(|job| job.tile as usize).collect();
    let mut counts = vec![Counts::default(); tiles.len()];
    let mut before = 0;
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
                    if step != 8 && abandon.load(Ordering::Relaxed) {
                        return false;
                    }
                    tracer.lattice(slots, before, step, counts);
                    true
                })
                .reduce(|| true, |a, b| a & b)
        });
        if complete && step != 1 {
            shown(film);
        }
        if !complete || (step != 1 && abandon.load(Ordering::Relaxed)) {
            return None;
        }
        before = step;
    }
    let report = |c: Counts| Some(JobReport { rays: c.rays, glossy: c.glossy, error: None });
    Some(WaveReport { reports: counts.into_iter().map(report).collect() })
}

impl<L: SimdFloat> TileRenderer<'_, L> {
    /// The first sample of the pixels that a lattice of `step` pixels adds to one of `before` (0:
    /// none) in tiles side by side, whose pixels share packets while they are few.
    fn lattice(&self, slots: Vec<TileHandle>, before: usize, step: usize, counts: &mut [Counts]) {
        let mut tiles: Vec<_> =
            slots.into_iter().map(|slot| (slot.origin, slot.prepare())).collect();
        if step > SHARED_ABOVE {
            self.add_pixels(&mut tiles, None, (before, step), counts);
        } else {
            for (tile, counts) in tiles.chunks_mut(1).zip(counts.chunks_mut(1)) {
                let candidates = self.world.candidates(tile[0].0, tile[0].1.extent());
                if !candidates.as_ref().is_some_and(|candidates| self.world.is_black(candidates)) {
                    self.add_pixels(tile, candidates, (before, step), counts);
                }
            }
        }
        tiles.into_iter().for_each(|(_, tile)| tile.set_lattice(step));
    }

    /// Samples of those pixels in tiles, given with their origins, that share packets. `candidates`: of all
    /// of them.
    fn add_pixels(
        &self,
        tiles: &mut [([usize; 2], &mut Tile)],
        candidates: Option<TileCandidates>,
        (before, step): (usize, usize),
        counts: &mut [Counts],
    ) {
        let mut pixels = Vec::with_capacity(TILE_PIXELS);
        for (t, (origin, tile)) in tiles.iter().enumerate() {
            let extent = tile.extent();
            let inside = |p: &usize| p % TILE < extent[0] && p / TILE < extent[1];
            pixels.extend(lattice_pixels(before, step).filter(inside).map(|p| (t, *origin, p)));
        }
        let place = |(_, origin, p): &(usize, [usize; 2], usize)| {
            ((origin[0] + p % TILE) as u32, (origin[1] + p / TILE) as u32)
        };
        let sites = self.sites(0, pixels.iter().map(place));
        let points = self.sampler.block(0, 1);
        let mut work = PacketScratch::new(0, candidates);
        for range in sites.packets(L::WIDTH) {
            let packet = &pixels[range.clone()];
            self.pixels::<1>(&mut work, &points, &sites, range, 0);
            self.sum_of_each::<1, _>(&work.radiance, packet, |(t, _, p), group, sums| {
                tiles[*t].1.add_group(0, *p, group, sums);
            });
            let tile_of = |x, y| packet.iter().find(|p| place(p) == (x, y)).map(|(t, ..)| *t);
            for bad in work.bad.drain(..) {
                if let Some(t) = tile_of(bad.x, bad.y) {
                    tiles[t].1.record_bad(bad);
                }
            }
            for bright in work.saturated.drain(..) {
                if let Some(t) = tile_of(bright.x, bright.y) {
                    tiles[t].1.record_saturated(1);
                }
            }
        }
        // Which tile of several the rays were for, packets do not say; and what each is told must not depend on
        // how many pixels share one. Of glossy lobes tiles learn from their own packets, later.
        if let [counts] = counts {
            counts.rays += work.counts.rays;
            counts.glossy |= work.counts.glossy;
        } else {
            let (rays, sharing) = (work.counts.rays, pixels.len().max(1) as u64);
            counts[0].rays += rays % sharing;
            pixels.iter().for_each(|(t, ..)| counts[*t].rays += rays / sharing);
        }
    }
}
