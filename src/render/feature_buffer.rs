//! Feature buffer: the first hit in each cell of a display raster.

use crate::world::FirstHit;
use rayon::prelude::*;

/// Number of rays that a thread traces at a time.
const CHUNK: usize = 512;

/// First hits of the camera rays through the centres of a raster that covers the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureBuffer {
    /// Cells in a row.
    pub columns: usize,
    /// Rows of cells.
    pub rows: usize,
    /// `[row][column]`.
    texels: Vec<FirstHit>,
}

impl FeatureBuffer {
    /// Traces a raster of `columns` x `rows` cells over a film of `width` x `height` pixels. `first_hits`
    /// writes the first hits of the camera rays through points of the film, in pixels (see
    /// [`AnyWorld::first_hit`](crate::world::AnyWorld::first_hit)).
    pub fn new(
        [width, height]: [usize; 2],
        [columns, rows]: [usize; 2],
        first_hits: impl Fn(&[[f64; 2]], &mut [FirstHit]) + Sync,
        pool: &rayon::ThreadPool,
    ) -> Self {
        let mut texels = vec![FirstHit::MISS; columns * rows];
        let center = |cell: usize, cells: usize, pixels: usize| {
            (cell as f64 + 0.5) * pixels as f64 / cells as f64
        };
        pool.install(|| {
            texels.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, texels)| {
                let cells = chunk * CHUNK..chunk * CHUNK + texels.len();
                let point = |i: usize| {
                    [center(i % columns, columns, width), center(i / columns, rows, height)]
                };
                first_hits(&cells.map(point).collect::<Vec<_>>(), texels);
            });
        });
        Self { columns, rows, texels }
    }

    /// First hit of a cell; `None` outside of the raster.
    pub fn at(&self, column: usize, row: usize) -> Option<&FirstHit> {
        if column >= self.columns {
            return None;
        }
        self.texels.get(row * self.columns + column)
    }

    /// First hits of all cells, `[row][column]`.
    pub fn texels(&self) -> &[FirstHit] {
        &self.texels
    }
}
