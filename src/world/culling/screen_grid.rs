//! Where on the raster things are seen.

use crate::camera::PinholeCamera;
use crate::primitive::{F32_RAY_ERROR, Form};
use glam::DVec3;

/// The part of the raster that a thing may be seen on \[pixels\]: smallest and largest coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScreenBounds {
    low: [f64; 2],
    high: [f64; 2],
}

/// Room for the rounding of places in single precision \[pixels\].
const MARGIN_PX: f64 = 0.25;

/// Rays on the picture plane at unit distance stray by this part of their length: eight roundings in single
/// precision.
const MAX_SLANT_ERROR: f64 = 5e-7;

impl ScreenBounds {
    /// Of a form: around the corners of its box, if all are in front of the eye.
    pub fn project(form: &Form, view: &PinholeCamera) -> Self {
        let everywhere = Self { low: [f64::NEG_INFINITY; 2], high: [f64::INFINITY; 2] };
        let Some((low, high)) = form.bounds() else { return everywhere };
        let [_, _, forward] = view.frame();
        let reach = low.abs().max(high.abs()).max(view.eye().abs()).max_element();
        let mut out = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
            let point = DVec3::new(pick(0), pick(1), pick(2));
            let to = point - view.eye();
            let depth = to.dot(forward);
            let stray = F32_RAY_ERROR * reach;
            if depth <= 2.0 * stray {
                return everywhere;
            }
            // A step by `stray`, in whatever direction, moves a point at the length l on the picture plane
            // by at most (1 + l) stray / (depth - stray).
            let length = to.length() / depth;
            let strays = (1.0 + length) * stray / (depth - stray) + MAX_SLANT_ERROR * length;
            let (at, margin) = (view.project(point), MARGIN_PX + strays / view.pixel());
            out.low = std::array::from_fn(|axis| out.low[axis].min(at[axis] - margin));
            out.high = std::array::from_fn(|axis| out.high[axis].max(at[axis] + margin));
        }
        out
    }

    pub fn overlaps(&self, origin: [usize; 2], extent: [usize; 2]) -> bool {
        (0..2).all(|axis| {
            let begin = origin[axis] as f64;
            self.low[axis] <= begin + extent[axis] as f64 && self.high[axis] >= begin
        })
    }
}

/// Side of a cell \[pixels\].
const CELL_PX: usize = 16;

/// A list of at most so many things is asked rather than the tree of all.
const MAX_PER_CELL: usize = 16;

/// For each cell of the raster the things that may be seen there, if they are few.
pub(crate) struct ScreenGrid {
    columns: usize,
    rows: usize,
    /// Row by row; the numbers ascend. `None`: too many.
    candidates: Vec<Option<Vec<u32>>>,
}

impl ScreenGrid {
    /// Of a raster of `size` pixels, from things' numbers, ascending, and where they are seen.
    pub fn new(size: [usize; 2], things: impl IntoIterator<Item = (u32, ScreenBounds)>) -> Self {
        let [columns, rows] = size.map(|n| n.div_ceil(CELL_PX));
        let mut candidates = vec![Some(Vec::new()); columns * rows];
        for (thing, ScreenBounds { low, high }) in things {
            // The conversion to integers saturates: what is seen nowhere spans no cell.
            let cell = |x: f64| (x / CELL_PX as f64).floor().max(-1.0) + 1.0;
            let span = |axis: usize, count: usize| {
                let first = (cell(low[axis]) as usize).saturating_sub(1);
                first..(cell(high[axis]) as usize).min(count)
            };
            for row in span(1, rows) {
                for column in span(0, columns) {
                    let here: &mut Option<Vec<u32>> = &mut candidates[row * columns + column];
                    match here {
                        Some(few) if few.len() < MAX_PER_CELL => few.push(thing),
                        _ => *here = None,
                    }
                }
            }
        }
        Self { columns, rows, candidates }
    }

    /// What may be seen in a rectangle of the raster, in ascending order; `None`: too much.
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
    fn cells_name_the_few_things_that_reach_into_them() {
        let at = |low: [f64; 2], high: [f64; 2]| ScreenBounds { low, high };
        let endless = at([f64::NEG_INFINITY; 2], [f64::INFINITY; 2]);
        let things = [
            (0, endless),
            (2, at([15.9, 0.0], [16.1, 3.0])),
            (3, at([32.0, 32.0], [1e9, 1e9])),
            (5, at([-9.0, -9.0], [-1.0, 40.0])),
            (6, at([20.0, -1e300], [21.0, -3.0])),
        ];
        let cells = ScreenGrid::new([40, 33], things);
        let candidates = |x, y| cells.candidates([x, y], [16, 16]).unwrap();
        assert_eq!(candidates(0, 0), [0, 2]);
        assert_eq!(candidates(16, 0), [0, 2]);
        assert_eq!(candidates(32, 0), [0]);
        assert_eq!(candidates(0, 32), [0]);
        assert_eq!(candidates(32, 32), [0, 3]);
        // A rectangle over several cells, beyond the raster too.
        assert_eq!(cells.candidates([8, 24], [100, 100]).unwrap(), [0, 3]);
        assert_eq!(cells.candidates([0, 0], [100, 100]).unwrap(), [0, 2, 3]);
        let crowd = (0..=MAX_PER_CELL as u32).map(|i| (i, at([0.0; 2], [1.0; 2])));
        let cells = ScreenGrid::new([40, 33], crowd);
        assert_eq!(cells.candidates([0, 0], [16, 16]), None);
        assert_eq!(cells.candidates([16, 0], [16, 16]), Some(vec![]));
    }
}
