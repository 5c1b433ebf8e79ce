//! Snapshots: the picture and progress that a session publishes.

use crate::film::{
    DirtyTile, Display, Film, IncrementalDownsample, LightWeights, Probe, Thumbnail,
};
use crate::render::feature_buffer::FeatureBuffer;
use crate::render::relighting::Relighting;
use crate::render::session::report::Report;
use crate::scene::Scene;
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// Requested contents of snapshots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct View {
    /// Columns and rows of [`Snapshot::picture`] and [`Snapshot::guide`]; `None`: no picture, no
    /// feature buffer, no tile maps.
    pub raster: Option<[usize; 2]>,
    /// Column and row of the film's pixel to probe.
    pub probe: Option<[usize; 2]>,
}

/// The state of a render at one moment. All fields describe the scene of `report.generation`.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Progress of the render.
    pub report: Report,
    /// Means per light group over the cells of [`View::raster`], to be weighted by the client; `None`
    /// if not requested, or without a film.
    pub picture: Option<Thumbnail>,
    /// Light weights of the scene; empty without a film.
    pub mix: LightWeights,
    /// Light weights for other scenes; `None` without a film.
    pub lighting: Option<Arc<Relighting>>,
    /// First hit in each cell of [`View::raster`]. A slow one comes a snapshot later than the first
    /// picture.
    pub guide: Option<Arc<FeatureBuffer>>,
    /// Error and samples of each tile.
    pub tiles: Arc<TileMaps>,
    /// The requested pixel; `None` if it lies outside of the film.
    pub probe: Option<Probe>,
}

impl Snapshot {
    /// Snapshot of a report without a film.
    pub(super) fn without_film(report: Report) -> Self {
        Self {
            report,
            picture: None,
            mix: LightWeights { weights: Vec::new() },
            lighting: None,
            guide: None,
            tiles: Arc::default(),
            probe: None,
        }
    }

    /// Light weights with which this picture shows `scene`, which may be newer than the snapshot.
    /// `None` if the scene needs samples of its own; the picture then fits only [`Snapshot::mix`].
    pub fn mix_for(&self, scene: &Scene) -> Option<LightWeights> {
        self.lighting.as_ref()?.mix(scene)
    }
}

/// Values of the film's tiles, row by row. A tile covers
/// [`TILE`](crate::film::TILE) x [`TILE`](crate::film::TILE) pixels, less at the right and lower edge.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TileMaps {
    /// Tiles in a row.
    pub columns: usize,
    /// Rows of tiles.
    pub rows: usize,
    /// Estimated RMSE in 8-bit levels; empty before the first estimate.
    pub noise_codes: Vec<f32>,
    /// Samples per pixel, A and B together.
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

/// Fields that all snapshots of one film share.
pub(super) struct Frame {
    pub view: View,
    pub mix: LightWeights,
    pub display: Display,
    pub lighting: Arc<Relighting>,
    pub guide: Option<Arc<FeatureBuffer>>,
}

impl Frame {
    /// Snapshot of the current film. `downsample` caches the tiles that it has read.
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
            lighting: Some(Arc::clone(&self.lighting)),
            guide: self.guide.clone(),
            tiles,
            probe,
        }
    }
}

/// Slot for one snapshot; a newer one replaces an untaken one.
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

    /// Ignores poisoning: a client that panicked while it held the lock leaves a whole snapshot.
    fn lock(&self) -> std::sync::MutexGuard<'_, Option<Snapshot>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
