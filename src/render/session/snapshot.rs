//! What a session shows its guests.

use crate::film::{
    DirtyTile, Display, Film, IncrementalDownsample, LightWeights, Probe, Thumbnail,
};
use crate::render::feature_buffer::FeatureBuffer;
use crate::render::relighting::Relighting;
use crate::render::session::report::Report;
use crate::scene::Scene;
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// What snapshots are to contain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct View {
    /// Columns and rows of the raster for [`Snapshot::picture`] and [`Snapshot::guide`]; `None`: no
    /// picture, no guide, no tile maps.
    pub raster: Option<[usize; 2]>,
    /// Column and row of the film's pixel to look at closely.
    pub probe: Option<[usize; 2]>,
}

/// The state of the work at one moment. All of it is about the scene of `report.generation`.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Where the work stands.
    pub report: Report,
    /// Means per light group over the cells of the guest's raster, to be mixed by the guest; `None`:
    /// not asked for, or there is no film.
    pub picture: Option<Thumbnail>,
    /// The mix of the scene; empty without a film.
    pub mix: LightWeights,
    /// How the picture is mixed for other scenes; `None`: there is no film.
    pub lighting: Option<Arc<Relighting>>,
    /// What is seen in each cell of the guest's raster. May come a snapshot later than the first
    /// picture, if it takes long.
    pub guide: Option<Arc<FeatureBuffer>>,
    /// Error and samples of each tile.
    pub tiles: Arc<TileMaps>,
    /// The pixel that the guest asked for; `None` also if it lies outside of the film.
    pub probe: Option<Probe>,
}

impl Snapshot {
    /// A report without a film.
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

    /// The mix in which this picture shows `scene`, which may be newer than the snapshot; `None`: it
    /// needs samples of its own, and this picture can only be shown in its own [`Snapshot::mix`].
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
    /// Estimated RMSE in codes; empty before the first estimate.
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

/// What snapshots of one film share.
pub(super) struct Frame {
    pub view: View,
    pub mix: LightWeights,
    pub display: Display,
    pub lighting: Arc<Relighting>,
    pub guide: Option<Arc<FeatureBuffer>>,
}

impl Frame {
    /// The film as it is now. `raster` remembers what it has seen of the film.
    pub fn snapshot(
        &self,
        film: &Film,
        noise_codes: Vec<f32>,
        report: Report,
        raster: &mut Option<IncrementalDownsample>,
        pool: &rayon::ThreadPool,
    ) -> Snapshot {
        let picture = self.view.raster.map(|[columns, rows]| {
            let known = raster.take().filter(|raster| raster.is_for(film, columns, rows));
            let raster = raster
                .insert(known.unwrap_or_else(|| IncrementalDownsample::new(film, columns, rows)));
            let stale = raster.stale(film);
            if !stale.is_empty() {
                pool.install(|| stale.into_par_iter().for_each(DirtyTile::refresh));
            }
            raster.thumbnail()
        });
        let tiles = match self.view.raster {
            Some(_) => Arc::new(TileMaps::of(film, noise_codes)),
            None => Arc::default(),
        };
        let probe = self.view.probe.and_then(|at| film.probe(at, &self.mix, &self.display));
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

/// A place for one snapshot: a newer one replaces what has not been taken.
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

    /// A guest that panicked while it held the lock leaves a whole snapshot behind.
    fn lock(&self) -> std::sync::MutexGuard<'_, Option<Snapshot>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
