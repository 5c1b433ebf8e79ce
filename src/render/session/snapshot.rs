//! Snapshots: picture and progress of a render at one moment, published by the session.

use crate::film::{
    DirtyTile, Display, Film, IncrementalDownsample, LightWeights, Probe, Thumbnail,
};
use crate::render::first_hit_buffer::FirstHitBuffer;
use crate::render::relighting::Relighting;
use crate::render::session::report::Report;
use crate::scene::Scene;
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// Contents of snapshots that a client requests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct View {
    /// Columns and rows of [`Snapshot::picture`] and [`Snapshot::first_hits`]. `None` requests
    /// neither picture nor first-hit buffer nor tile maps.
    pub raster: Option<[usize; 2]>,
    /// Column and row of the pixel to probe. `None` requests no probe.
    pub probe: Option<[usize; 2]>,
}

/// The state of a render at one moment. All fields describe the scene of `report.generation`.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Progress of the render.
    pub report: Report,
    /// Mean of each light group over each cell of [`View::raster`]. The client applies the light
    /// weights. `None` if no picture is requested, or without a film.
    pub picture: Option<Thumbnail>,
    /// Light weights of the scene in the report; empty without a film.
    pub mix: LightWeights,
    /// Relighting that computes the light weights of other scenes. `None` without a film.
    pub lighting: Option<Arc<Relighting>>,
    /// First hit in each cell of [`View::raster`]. If tracing it takes long, it is missing in
    /// snapshots before the first complete picture.
    pub first_hits: Option<Arc<FirstHitBuffer>>,
    /// Error and number of samples of each tile.
    pub tiles: Arc<TileMaps>,
    /// Probe of the requested pixel. `None` if the pixel is outside of the film or no probe is
    /// requested.
    pub probe: Option<Probe>,
}

impl Snapshot {
    /// Creates a snapshot with `report` and without a film.
    pub(super) fn without_film(report: Report) -> Self {
        Self {
            report,
            picture: None,
            mix: LightWeights { weights: Vec::new() },
            lighting: None,
            first_hits: None,
            tiles: Arc::default(),
            probe: None,
        }
    }

    /// Returns the light weights with which this picture shows `scene`, which may be newer than the
    /// snapshot. Returns `None` if `scene` needs new samples; only [`Snapshot::mix`] then fits the
    /// picture.
    pub fn mix_for(&self, scene: &Scene) -> Option<LightWeights> {
        self.lighting.as_ref()?.mix(scene)
    }
}

/// Values of the film's tiles, in row order. A tile covers [`TILE`](crate::film::TILE) x
/// [`TILE`](crate::film::TILE) pixels, fewer at the right and lower edge.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TileMaps {
    /// Number of tiles in a row.
    pub columns: usize,
    /// Number of rows of tiles.
    pub rows: usize,
    /// Estimated RMSE of each tile in 8-bit levels; empty before the first estimate.
    pub noise_codes: Vec<f32>,
    /// Samples per pixel of each tile, over both replicates.
    pub spp: Vec<u32>,
}

impl TileMaps {
    pub(super) fn of(film: &Film, noise_codes: Vec<f32>) -> Self {
        let count = |tile: usize| {
            film.tile(tile).map_or(0, |tile| tile.counts()[0].saturating_add(tile.counts()[1]))
        };
        let columns = film.tile_columns();
        let rows = film.tile_count() / columns;
        Self { columns, rows, noise_codes, spp: (0..film.tile_count()).map(count).collect() }
    }
}

/// Fields whose values are equal in all snapshots of one film.
pub(super) struct Frame {
    pub view: View,
    pub mix: LightWeights,
    pub display: Display,
    pub lighting: Option<Arc<Relighting>>,
    pub first_hits: Option<Arc<FirstHitBuffer>>,
}

impl Frame {
    /// Creates a snapshot of the current film. `downsample` caches the contributions of tiles, so
    /// that only changed tiles are read.
    pub fn snapshot(
        &self,
        film: &Film,
        noise_codes: Vec<f32>,
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
            Some(_) => Arc::new(TileMaps::of(film, noise_codes)),
            None => Arc::default(),
        };
        let probe =
            self.view.probe.and_then(|pixel| Probe::of_film(film, pixel, &self.mix, &self.display));
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

/// Slot that holds the latest snapshot. A new snapshot replaces one that has not been taken.
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

    /// Locks the slot. A poisoned lock is used as well, because a client that panicked with the
    /// lock has left a complete snapshot.
    fn lock(&self) -> std::sync::MutexGuard<'_, Option<Snapshot>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
