//! First-hit buffer: the first hits of camera rays for the dashboard's views of objects, normals
//! and distances.

use crate::film::Window;
use rayon::prelude::*;
use zerkalo_world::FirstHit;

/// Number of camera rays that a thread traces at a time.
const CHUNK: usize = 512;

/// First hits of the camera rays through the centres of the cells of a grid over a window of the
/// picture.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstHitBuffer {
    pub window: Window,
    pub columns: usize,
    pub rows: usize,
    /// First hits, `[row][column]`.
    pub texels: Vec<FirstHit>,
}

impl FirstHitBuffer {
    /// Traces the buffer of a grid of `columns` x `rows` cells over `window`. `first_hits` gets points of the film in pixels, and writes the first hits of the
    /// camera rays through them, as [`AnyWorld::first_hit`](zerkalo_world::AnyWorld::first_hit)
    /// does.
    pub fn new(
        window: Window,
        [columns, rows]: [usize; 2],
        first_hits: impl Fn(&[[f64; 2]], &mut [FirstHit]) + Sync,
        pool: &rayon::ThreadPool,
    ) -> Self {
        let mut texels = vec![FirstHit::MISS; columns * rows];
        let center = |axis: usize, cell: usize, cells: usize| {
            window.origin[axis] as f64
                + (cell as f64 + 0.5) * window.size[axis] as f64 / cells as f64
        };
        pool.install(|| {
            texels.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, texels)| {
                let cells = chunk * CHUNK..chunk * CHUNK + texels.len();
                let point =
                    |i: usize| [center(0, i % columns, columns), center(1, i / columns, rows)];
                first_hits(&cells.map(point).collect::<Vec<_>>(), texels);
            });
        });
        Self { window, columns, rows, texels }
    }

    /// Returns the first hit in the cell that shows a film pixel (column, row). Returns `None`
    /// outside the window.
    pub fn at_pixel(&self, pixel: [usize; 2]) -> Option<&FirstHit> {
        let Window { origin, size } = self.window;
        let [column, row] = [self.columns, self.rows];
        let cell = |i: usize, cells: usize| (pixel[i] - origin[i]) * cells / size[i];
        self.window.contains(pixel).then(|| self.at(cell(0, column), cell(1, row)))?
    }

    /// Returns the first hit in a cell. Returns `None` outside the grid.
    pub fn at(&self, column: usize, row: usize) -> Option<&FirstHit> {
        if column >= self.columns {
            return None;
        }
        self.texels.get(row * self.columns + column)
    }
}
