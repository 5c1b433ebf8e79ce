//! Snapshots: picture and progress of a render at one moment.

use crate::film::{
    Display, Estimator, Film, IncrementalDownsample, LightWeights, PixelProbe, Thumbnail, TileNoise,
};
use crate::first_hit_buffer::FirstHitBuffer;
use crate::relighting::Relighting;
use crate::session::active_render::WorkContext;
use crate::session::report::Report;
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

impl Snapshot {
    /// Returns the light weights with which this picture shows `scene`, which may be newer than the
    /// snapshot. `None` if `scene` needs new samples.
    pub fn weights_for(&self, scene: &Scene) -> Option<LightWeights> {
        self.lighting.as_ref()?.weights(scene)
    }

    /// Adds the parts that the client has requested. `estimates` are the errors of the tiles of
    /// `film`, empty before the first estimate. `downsample` caches the contributions of tiles to
    /// the picture, so that only changed tiles are read again.
    pub(super) fn with_view(
        mut self,
        film: &Film,
        display: &Display,
        estimates: &[Option<TileNoise>],
        context: &WorkContext,
        downsample: &mut Option<IncrementalDownsample>,
    ) -> Self {
        if let Some([columns, rows]) = context.view.raster {
            let cached = downsample.take().filter(|cached| cached.is_for(film, columns, rows));
            let downsample = downsample
                .insert(cached.unwrap_or_else(|| IncrementalDownsample::new(film, columns, rows)));
            downsample.update(film, Some(&context.pool));
            self.picture = Some(downsample.thumbnail());
            self.tiles = Arc::new(TileMaps::of(film, estimates));
        }
        let probe = |pixel| PixelProbe::of_film(film, pixel, &self.weights, display);
        self.probe = context.view.probe.and_then(probe);
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
