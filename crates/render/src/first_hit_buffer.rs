//! First-hit buffer: the first hits of camera rays, one ray for each cell of the grid in which the
//! dashboard shows the picture.

use rayon::prelude::*;
use zerkalo_world::FirstHit;

/// Number of camera rays that a thread traces at a time for the first-hit buffer.
const CHUNK: usize = 512;

/// First hits of the camera rays through the centres of the cells of a grid over the whole picture.
/// The dashboard shows objects, normals and distances from this buffer.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstHitBuffer {
    /// Number of columns of the grid of cells, one camera ray per cell.
    pub columns: usize,
    /// Number of rows of the grid of cells, one camera ray per cell.
    pub rows: usize,
    /// First hit of each cell of the grid, `[row][column]`.
    texels: Vec<FirstHit>,
}

impl FirstHitBuffer {
    /// Traces the buffer of a grid of `columns` x `rows` cells over a film of `width` x `height`
    /// pixels: one camera ray through the centre of each cell. `first_hits` receives points of the
    /// film in pixels, and writes the first hits of the camera rays through them (see
    /// [`AnyWorld::first_hit`](zerkalo_world::AnyWorld::first_hit)).
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

    /// Returns the first hit in the cell at `column` and `row` of the grid. Returns `None` if the
    /// cell is outside of the grid.
    pub fn at(&self, column: usize, row: usize) -> Option<&FirstHit> {
        if column >= self.columns {
            return None;
        }
        self.texels.get(row * self.columns + column)
    }

    /// Returns the first hits of all cells, `[row][column]`.
    pub fn texels(&self) -> &[FirstHit] {
        &self.texels
    }
}
