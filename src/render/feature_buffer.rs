//! What can be seen in each cell of the guest's raster, besides colours.

use crate::world::FirstHit;
use rayon::prelude::*;

/// Rays traced by one thread at a time.
const CHUNK: usize = 512;

/// One camera ray through the centre of each cell of a raster that covers the picture.
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
    /// For a film of `size` pixels; `look` tells what is seen through points of the film, in pixels
    /// (see [`AnyWorld::look`](crate::world::AnyWorld::look)).
    pub fn new(
        [width, height]: [usize; 2],
        [columns, rows]: [usize; 2],
        look: impl Fn(&[[f64; 2]], &mut [FirstHit]) + Sync,
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
                look(&cells.map(point).collect::<Vec<_>>(), texels);
            });
        });
        Self { columns, rows, texels }
    }

    /// What is seen in a cell; `None`: there is no such cell.
    pub fn at(&self, column: usize, row: usize) -> Option<&FirstHit> {
        if column >= self.columns {
            return None;
        }
        self.texels.get(row * self.columns + column)
    }

    /// All cells, `[row][column]`.
    pub fn texels(&self) -> &[FirstHit] {
        &self.texels
    }
}
