//! Screen-space culling of camera rays: bounds of the projected primitives, and a grid of candidate
//! lists.

use glam::DVec3;
use zerkalo_kernel::primitive::{F32_RAY_ERROR, Form};
use zerkalo_scene::camera::CompiledCamera;

/// Bounding rectangle of a projected primitive \[pixels\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScreenBounds {
    low: [f64; 2],
    high: [f64; 2],
}

/// Margin \[pixels\] of projected bounds. It covers the rounding of raster positions to single
/// precision.
const MARGIN_PX: f64 = 0.25;

/// Largest relative error of the point at which a ray crosses the plane at unit distance from the
/// eye: its displacement, divided by its distance from the eye. Eight rounding errors in single
/// precision.
const MAX_SLANT_ERROR: f64 = 5e-7;

impl ScreenBounds {
    /// Returns the bounds of the projected corners of an object's bounding box, wider by the
    /// largest blur of the lens. The bounds are infinite if the object has no bounding box, if a
    /// corner of it is not in front of the eye, and in a panorama.
    pub fn project(form: &Form, camera: &CompiledCamera) -> Self {
        let infinite = Self { low: [f64::NEG_INFINITY; 2], high: [f64::INFINITY; 2] };
        let bounds = form.bounds().filter(|_| !camera.is_panorama());
        let Some((low, high)) = bounds else { return infinite };
        let [_, _, forward] = camera.frame;
        let lens_radius = camera.lens_radius();
        let eye = camera.eye.abs() + DVec3::splat(lens_radius);
        let max_coordinate = low.abs().max(high.abs()).max(eye).max_element();
        let (mut nearest, mut farthest) = (f64::INFINITY, 0.0f64);
        let mut out = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };
        for corner in 0..8 {
            let coordinate =
                |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
            let point = DVec3::new(coordinate(0), coordinate(1), coordinate(2));
            let from_eye = point - camera.eye;
            let depth = from_eye.dot(forward);
            let ray_error = F32_RAY_ERROR * max_coordinate;
            if depth <= 2.0 * ray_error {
                return infinite;
            }
            (nearest, farthest) = (nearest.min(depth - ray_error), farthest.max(depth + ray_error));
            // The projection of the corner onto the plane at unit distance has the distance l
            // (`length`) from the eye. If the corner is displaced by `ray_error`, its projection
            // moves by at most (1 + l) ray_error / (depth - ray_error).
            let length = from_eye.length() / depth;
            let plane_error =
                (1.0 + length) * ray_error / (depth - ray_error) + MAX_SLANT_ERROR * length;
            let (position, margin) =
                (camera.project(point), MARGIN_PX + plane_error / camera.pixel());
            out.low = std::array::from_fn(|axis| out.low[axis].min(position[axis] - margin));
            out.high = std::array::from_fn(|axis| out.high[axis].max(position[axis] + margin));
        }
        if let Some(lens) = &camera.lens {
            // On the plane at unit distance from the eye, the blur of a point at depth z has the
            // radius `r |1/z - 1/f|`. Here r is the lens radius and f the focus distance. The blur
            // is largest at one end of the interval of depths.
            let blur = [nearest, farthest].map(|depth| lens.blur(depth) / depth);
            let margin = blur[0].max(blur[1]) * (1.0 + F32_RAY_ERROR) / camera.pixel();
            out.low = out.low.map(|x| x - margin);
            out.high = out.high.map(|x| x + margin);
        }
        out
    }

    /// Returns `true` if the bounds overlap a rectangle \[pixels\] with the upper left corner
    /// `origin` and the size `extent`.
    pub fn overlaps(&self, origin: [usize; 2], extent: [usize; 2]) -> bool {
        (0..2).all(|axis| {
            let begin = origin[axis] as f64;
            self.low[axis] <= begin + extent[axis] as f64 && self.high[axis] >= begin
        })
    }
}

/// Side of a cell of the screen grid \[pixels\].
const CELL_PX: usize = 16;

/// Largest number of candidate primitives in a cell. Camera rays through cells with more candidates
/// traverse the BVH.
const MAX_PER_CELL: usize = 16;

/// Screen grid: for each cell, a square of pixels, the list of the primitives that camera rays
/// through it can hit.
pub(crate) struct ScreenGrid {
    columns: usize,
    rows: usize,
    /// Ids of the candidates of each cell, in ascending order, row by row. `None` for cells with
    /// more than [`MAX_PER_CELL`] candidates.
    candidates: Vec<Option<Vec<u32>>>,
}

impl ScreenGrid {
    /// Creates the screen grid of a raster of `size` pixels. `primitives` holds the id and the
    /// bounds of each primitive, in ascending order of ids.
    pub fn new(
        size: [usize; 2],
        primitives: impl IntoIterator<Item = (u32, ScreenBounds)>,
    ) -> Self {
        let [columns, rows] = size.map(|n| n.div_ceil(CELL_PX));
        let mut candidates = vec![Some(Vec::new()); columns * rows];
        for (primitive, ScreenBounds { low, high }) in primitives {
            // The conversion to an integer saturates, so bounds outside the raster overlap no
            // cell.
            let cell = |x: f64| (x / CELL_PX as f64).floor().max(-1.0) + 1.0;
            let span = |axis: usize, count: usize| {
                let first = (cell(low[axis]) as usize).saturating_sub(1);
                first..(cell(high[axis]) as usize).min(count)
            };
            for row in span(1, rows) {
                for column in span(0, columns) {
                    let cell: &mut Option<Vec<u32>> = &mut candidates[row * columns + column];
                    match cell {
                        Some(list) if list.len() < MAX_PER_CELL => list.push(primitive),
                        _ => *cell = None,
                    }
                }
            }
        }
        Self { columns, rows, candidates }
    }

    /// Returns the ids of the primitives that camera rays through a rectangle \[pixels\] can hit,
    /// in ascending order. Returns `None` if the rectangle, or a cell that it overlaps, has more
    /// than [`MAX_PER_CELL`] candidates.
    pub fn candidates(&self, origin: [usize; 2], extent: [usize; 2]) -> Option<Vec<u32>> {
        let span = |axis: usize, count: usize| {
            let end = (origin[axis] + extent[axis]).div_ceil(CELL_PX);
            origin[axis] / CELL_PX..end.min(count)
        };
        let mut out = Vec::new();
        for row in span(1, self.rows) {
            for column in span(0, self.columns) {
                out.extend(self.candidates[row * self.columns + column].as_ref()?);
            }
        }
        out.sort_unstable();
        out.dedup();
        (out.len() <= MAX_PER_CELL).then_some(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn screen_grid_lists_primitives_that_overlap_a_cell() {
        let bounds = |low: [f64; 2], high: [f64; 2]| ScreenBounds { low, high };
        let unbounded = bounds([f64::NEG_INFINITY; 2], [f64::INFINITY; 2]);
        let primitives = [
            (0, unbounded),
            (2, bounds([15.9, 0.0], [16.1, 3.0])),
            (3, bounds([32.0, 32.0], [1e9, 1e9])),
            (5, bounds([-9.0, -9.0], [-1.0, 40.0])),
            (6, bounds([20.0, -1e300], [21.0, -3.0])),
        ];
        let grid = ScreenGrid::new([40, 33], primitives);
        let candidates = |x, y| grid.candidates([x, y], [16, 16]).unwrap();
        assert_eq!(candidates(0, 0), [0, 2]);
        assert_eq!(candidates(16, 0), [0, 2]);
        assert_eq!(candidates(32, 0), [0]);
        assert_eq!(candidates(0, 32), [0]);
        assert_eq!(candidates(32, 32), [0, 3]);
        // Rectangles over several cells and beyond the raster.
        assert_eq!(grid.candidates([8, 24], [100, 100]).unwrap(), [0, 3]);
        assert_eq!(grid.candidates([0, 0], [100, 100]).unwrap(), [0, 2, 3]);
        let too_many = (0..=MAX_PER_CELL as u32).map(|i| (i, bounds([0.0; 2], [1.0; 2])));
        let grid = ScreenGrid::new([40, 33], too_many);
        assert_eq!(grid.candidates([0, 0], [16, 16]), None);
        assert_eq!(grid.candidates([16, 0], [16, 16]), Some(vec![]));
    }
}
