//! First-hit buffer: the first hits of camera rays for the dashboard's views of objects, normals
//! and distances.

use rayon::prelude::*;
use zerkalo_world::FirstHit;

/// Number of camera rays that a thread traces at a time.
const CHUNK: usize = 512;

/// First hits of the camera rays through the centres of the cells of a grid over the whole picture.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstHitBuffer {
    pub columns: usize,
    pub rows: usize,
    /// First hits, `[row][column]`.
    pub texels: Vec<FirstHit>,
}

impl FirstHitBuffer {
    /// Traces the buffer of a grid of `columns` x `rows` cells over a film of `width` x `height`
    /// pixels. `first_hits` gets points of the film in pixels, and writes the first hits of the
    /// camera rays through them, as [`AnyWorld::first_hit`](zerkalo_world::AnyWorld::first_hit)
    /// does.
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

    /// Returns the first hit in a cell. Returns `None` outside the grid.
    pub fn at(&self, column: usize, row: usize) -> Option<&FirstHit> {
        if column >= self.columns {
            return None;
        }
        self.texels.get(row * self.columns + column)
    }
}
