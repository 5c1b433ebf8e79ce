//! Snapshots: picture and progress of a render at one moment.

use crate::film::{
    Detail, Display, Estimator, Film, IncrementalDownsample, LightWeights, PixelProbe, Thumbnail,
    TileNoise, Window,
};
use crate::first_hit_buffer::FirstHitBuffer;
use crate::relighting::Relighting;
use crate::session::active_render::WorkContext;
use crate::session::report::{Report, State};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use zerkalo_scene::Scene;

/// Parts of a snapshot that a client requests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct View {
    /// Columns and rows of [`Snapshot::picture`] and [`Snapshot::first_hits`]. `None` requests
    /// neither of them, nor [`Snapshot::tiles`].
    pub raster: Option<[usize; 2]>,
    /// Columns and rows of the first hits if they differ from those of the picture.
    pub hits: Option<[usize; 2]>,
    /// Window of the film that the picture and the first hits show; `None` for the whole film.
    pub window: Option<Window>,
    /// Window of [`Snapshot::detail`], and its columns and rows.
    pub detail: Option<(Window, [usize; 2])>,
    /// Window of the film whose tiles get samples, after the first noise estimate; `None` for all.
    pub region: Option<Window>,
    /// Column and row of the pixel whose samples and error are requested.
    pub probe: Option<[usize; 2]>,
}

/// State of a render at one moment, for the scene with the generation in the report.
#[derive(Clone, Debug, Default)]
pub struct Snapshot {
    pub report: Report,
    /// Picture of the requested size: mean radiance of each light group, to which the client
    /// applies light weights.
    pub picture: Option<Thumbnail>,
    /// Window of the film that the picture shows.
    pub window: Window,
    /// Requested window as displayed. While the render is tracing, it is made again when the samples
    /// have grown by [`DETAIL_GROWTH`]. `None` before the first complete picture.
    pub detail: Option<Arc<Detail>>,
    /// Light weights of the scene of the report.
    pub weights: LightWeights,
    /// Light groups of the film, for [`Snapshot::weights_for`].
    pub lighting: Option<Arc<Relighting>>,
    /// First hits of the requested size. `None` before the first complete picture if they would
    /// delay it too much.
    pub first_hits: Option<Arc<FirstHitBuffer>>,
    /// Error and sample count of each tile, if a picture is requested.
    pub tiles: Arc<TileMaps>,
    /// Samples and error of the requested pixel, if it is inside the film.
    pub probe: Option<PixelProbe>,
}

/// Parts of snapshots that are kept, so that only what has changed is computed again.
#[derive(Default)]
pub(super) struct ViewCache {
    downsample: Option<IncrementalDownsample>,
    detail: Option<Arc<Detail>>,
}

/// Growth of the number of samples after which a detail is made again: that after which a terminal
/// compares all cells.
pub const DETAIL_GROWTH: f64 = 1.189;

impl View {
    /// Returns the window of the picture on a film of `size` pixels.
    pub(super) fn window_of(&self, size: [usize; 2]) -> Window {
        self.window.unwrap_or(Window::whole(size)).clipped(size)
    }
}

impl Snapshot {
    /// Returns the light weights with which this picture shows `scene`, which may be newer than the
    /// snapshot. `None` if `scene` needs new samples.
    pub fn weights_for(&self, scene: &Scene) -> Option<LightWeights> {
        self.lighting.as_ref()?.weights(scene)
    }

    /// Adds the parts that the client has requested. `estimates` are the errors of the tiles of
    /// `film`, empty before the first estimate.
    pub(super) fn with_view(
        mut self,
        film: &Film,
        display: &Display,
        estimates: &[Option<TileNoise>],
        context: &WorkContext,
        cache: &mut ViewCache,
    ) -> Self {
        let size = [film.header.width, film.header.height];
        self.window = context.view.window_of(size);
        if let Some([columns, rows]) = context.view.raster {
            let window = self.window;
            let cached = cache.downsample.take();
            let cached = cached.filter(|cached| cached.is_for(film, window, columns, rows));
            let new = || IncrementalDownsample::new(film, window, columns, rows);
            let downsample = cache.downsample.insert(cached.unwrap_or_else(new));
            downsample.update(film, Some(&context.pool));
            self.picture = Some(downsample.thumbnail());
            self.tiles = Arc::new(TileMaps::of(film, estimates));
        }
        let probe = |pixel| PixelProbe::of_film(film, pixel, &self.weights, display);
        self.probe = context.view.probe.and_then(probe);
        let is_complete = context.view.detail.is_some() && Detail::is_possible(film);
        self.detail = context.view.detail.filter(|_| is_complete).map(|(window, size)| {
            let is_tracing = matches!(self.report.state, State::Tracing);
            let growth = if is_tracing { DETAIL_GROWTH } else { 1.0 };
            let spp = self.report.spp.mean;
            let is_fresh = |old: &Arc<Detail>| {
                (old.window, old.size) == (window, size)
                    && (&old.display, &old.weights) == (display, &self.weights)
                    && old.generation == self.report.generation
                    && (old.spp..=old.spp * growth).contains(&spp)
            };
            let kept = cache.detail.take().filter(is_fresh);
            let new = || {
                let shown = (&self.weights, display);
                let pixels = Detail::of_film(film, shown, window, size, &context.pool);
                Arc::new(Detail { spp, generation: self.report.generation, ..pixels })
            };
            Arc::clone(cache.detail.insert(kept.unwrap_or_else(new)))
        });
        self
    }
}

/// RMSE and sample count of each tile of the film, in row order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TileMaps {
    pub columns: usize,
    pub rows: usize,
    /// RMSE of each tile as displayed, in 8-bit levels; empty before the first estimate.
    pub noise_levels: Vec<f32>,
    /// Samples per pixel of each tile, over both replicates.
    pub spp: Vec<u32>,
}

impl TileMaps {
    fn of(film: &Film, estimates: &[Option<TileNoise>]) -> Self {
        let levels =
            |tile: &Option<TileNoise>| tile.map_or(0.0, |t| t.of_all().levels.sqrt() as f32);
        let columns = film.tile_columns();
        Self {
            columns,
            rows: film.tile_count() / columns,
            noise_levels: estimates.iter().map(levels).collect(),
            spp: (0..film.tile_count()).map(|tile| film.spp(tile)).collect(),
        }
    }
}

/// Estimates the error of every tile. The replicates of a tile may have different counts, as in a
/// checkpoint. Returns `None` if `cancel` becomes `true` before the end.
pub(super) fn tile_estimates(
    film: &Film,
    estimator: &Estimator,
    pool: &rayon::ThreadPool,
    cancel: &AtomicBool,
) -> Option<Vec<Option<TileNoise>>> {
    let estimate = |tile| film.tile(tile).and_then(|tile| estimator.tile_so_far(tile));
    let unless_cancelled = |tile| (!cancel.load(Ordering::Relaxed)).then(|| estimate(tile));
    let tiles = (0..film.tile_count()).into_par_iter().with_min_len(16);
    pool.install(|| tiles.map(unless_cancelled).collect())
}
