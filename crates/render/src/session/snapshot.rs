//! Snapshots: picture and progress of a render at one moment, published by the session.

use crate::film::{
    DirtyTile, Display, Film, IncrementalDownsample, LightWeights, PixelProbe, Thumbnail,
};
use crate::first_hit_buffer::FirstHitBuffer;
use crate::relighting::Relighting;
use crate::session::report::Report;
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};
use zerkalo_scene::Scene;

/// Contents that a client requests of snapshots: the size of the picture, and the pixel to probe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct View {
    /// Columns and rows of [`Snapshot::picture`] and [`Snapshot::first_hits`]. If it is `None`,
    /// snapshots have neither of them, and no [`Snapshot::tiles`].
    pub raster: Option<[usize; 2]>,
    /// Column and row of the pixel whose samples and error are requested. `None` requests none.
    pub probe: Option<[usize; 2]>,
}

/// State of a render at one moment. All fields describe the version of the scene with the number
/// `report.generation`.
#[derive(Clone, Debug, Default)]
pub struct Snapshot {
    /// Progress of the render.
    pub report: Report,
    /// Picture in the size that [`View::raster`] requests. It has the mean radiance of each light
    /// group (lights that share one weight) in each pixel. The client applies the light weights.
    /// `None` if no picture is requested, or without a film.
    pub picture: Option<Thumbnail>,
    /// Light weights of the scene that the report describes; empty without a film.
    pub mix: LightWeights,
    /// Light groups of the film. [`Snapshot::mix_for`] uses them to compute the light weights of a
    /// newer scene in which only lights were edited. `None` without a film.
    pub lighting: Option<Arc<Relighting>>,
    /// First hits of camera rays, one for each pixel of the size that [`View::raster`] requests.
    /// `None` if no size is requested, or without a scene. Before the first complete picture it is
    /// also `None` if tracing the hits would delay that picture too much.
    pub first_hits: Option<Arc<FirstHitBuffer>>,
    /// Error and number of samples of each tile; empty if no picture is requested, or without a
    /// film.
    pub tiles: Arc<TileMaps>,
    /// Samples and error of the requested pixel. `None` if the pixel is outside of the film or none
    /// is requested.
    pub probe: Option<PixelProbe>,
}

impl Snapshot {
    /// Returns the light weights with which this picture shows `scene`, which may be newer than the
    /// snapshot. Returns `None` if `scene` needs new samples, because more than light colours and
    /// intensities differ. The picture can then only show its own scene, with the weights
    /// [`Snapshot::mix`].
    pub fn mix_for(&self, scene: &Scene) -> Option<LightWeights> {
        self.lighting.as_ref()?.mix(scene)
    }
}

/// RMSE and sample count of each tile of the film, in row order. A tile covers
/// [`TILE`](crate::film::TILE) x [`TILE`](crate::film::TILE) pixels, fewer at the right and lower
/// edge.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TileMaps {
    /// Number of tiles in a row of tiles.
    pub columns: usize,
    /// Number of rows of tiles of the film.
    pub rows: usize,
    /// Estimated RMSE of each tile as displayed, in 8-bit levels; empty before the first estimate.
    pub noise_levels: Vec<f32>,
    /// Samples per pixel of each tile, over both replicates (halves of the samples).
    pub spp: Vec<u32>,
}

impl TileMaps {
    pub(super) fn of(film: &Film, noise_levels: Vec<f32>) -> Self {
        let count = |tile: usize| {
            let [a, b] = film.counts(tile);
            a.saturating_add(b)
        };
        let columns = film.tile_columns();
        let rows = film.tile_count() / columns;
        Self { columns, rows, noise_levels, spp: (0..film.tile_count()).map(count).collect() }
    }
}

/// Inputs of a snapshot besides the film: the contents that the client requests, light weights,
/// display transform and first hits.
pub(super) struct Frame {
    pub view: View,
    pub mix: LightWeights,
    pub display: Display,
    pub lighting: Option<Arc<Relighting>>,
    pub first_hits: Option<Arc<FirstHitBuffer>>,
}

impl Frame {
    /// Creates a snapshot of `film`. `noise_levels` has the RMSE of each tile in 8-bit levels.
    /// `downsample` caches the contributions of the film's tiles to the picture between snapshots,
    /// so that only changed tiles are read again.
    pub fn snapshot(
        &self,
        film: &Film,
        noise_levels: Vec<f32>,
        report: Report,
        downsample: &mut Option<IncrementalDownsample>,
        pool: &rayon::ThreadPool,
    ) -> Snapshot {
        let picture = self.view.raster.map(|[columns, rows]| {
            let cached = downsample.take().filter(|cached| cached.is_for(film, columns, rows));
            let downsample = downsample
                .insert(cached.unwrap_or_else(|| IncrementalDownsample::new(film, columns, rows)));
            let stale = downsample.stale(film);
            if !stale.is_empty() {
                pool.install(|| stale.into_par_iter().for_each(DirtyTile::refresh));
            }
            downsample.thumbnail()
        });
        let tiles = match self.view.raster {
            Some(_) => Arc::new(TileMaps::of(film, noise_levels)),
            None => Arc::default(),
        };
        let probe = self
            .view
            .probe
            .and_then(|pixel| PixelProbe::of_film(film, pixel, &self.mix, &self.display));
        Snapshot {
            report,
            picture,
            mix: self.mix.clone(),
            lighting: self.lighting.clone(),
            first_hits: self.first_hits.clone(),
            tiles,
            probe,
        }
    }
}

/// Slot that holds the latest snapshot of a render. A new snapshot replaces one that has not been
/// taken.
#[derive(Debug, Default)]
pub(super) struct Slot(Mutex<Option<Snapshot>>);

impl Slot {
    pub fn put(&self, snapshot: Snapshot) {
        *self.lock() = Some(snapshot);
    }

    pub fn take(&self) -> Option<Snapshot> {
        self.lock().take()
    }

    pub fn is_empty(&self) -> bool {
        self.lock().is_none()
    }

    /// Locks the slot. A lock that was poisoned by a panic of another client is still usable,
    /// because the slot always holds a complete snapshot or none.
    fn lock(&self) -> std::sync::MutexGuard<'_, Option<Snapshot>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
