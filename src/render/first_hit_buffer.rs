//! First-hit buffer: the first hit of a camera ray in each cell of a display raster.

use crate::world::FirstHit;
use rayon::prelude::*;

/// Number of rays that a thread traces at a time.
const CHUNK: usize = 512;

/// First hits of the camera rays through the centres of a raster's cells. The raster covers the
/// whole picture. The dashboard shows objects, normals and distances from this buffer.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstHitBuffer {
    /// Number of cells in a row.
    pub columns: usize,
    /// Number of rows.
    pub rows: usize,
    /// First hit of each cell, `[row][column]`.
    texels: Vec<FirstHit>,
}

impl FirstHitBuffer {
    /// Traces one ray through the centre of each cell of a raster of `columns` x `rows` cells over
    /// a film of `width` x `height` pixels. `first_hits` receives points of the film in pixels, and
    /// writes the first hits of their camera rays (see
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

    /// Returns the first hit of a cell. Returns `None` if the cell is outside of the raster.
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
