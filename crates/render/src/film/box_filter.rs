//! Box filter: means of an image's pixels over the cells of a coarser grid, weighted by covered
//! area.

/// Pixels of an image that one cell overlaps along one axis, fully or in part.
pub(super) struct Coverage {
    pub first: usize,
    /// Fraction of each pixel that the cell covers, 0..=1, for consecutive pixels from `first` on.
    pub parts: Vec<f64>,
}

/// Divides a row of `pixels` pixels into `cells` equal cells. Returns the coverage of each cell.
pub(super) fn coverage(pixels: usize, cells: usize) -> Vec<Coverage> {
    let edge = |cell: usize| cell as f64 * pixels as f64 / cells as f64;
    let cover = |cell: usize| {
        let (from, to) = (edge(cell), edge(cell + 1));
        let first = (from as usize).min(pixels - 1);
        let last = (to.ceil() as usize).clamp(first + 1, pixels);
        let part = |p: usize| (to.min((p + 1) as f64) - from.max(p as f64)).max(0.0);
        Coverage { first, parts: (first..last).map(part).collect() }
    };
    (0..cells).map(cover).collect()
}

/// Divides an image of `size` (columns, rows) into `cells` (columns, rows) of equal size. Returns
/// the mean of each cell, `[row][column]`. `pixel` returns the value of the pixel with a given
/// index, counted row by row.
pub fn box_means(
    size: [usize; 2],
    cells: [usize; 2],
    pixel: impl Fn(usize) -> [f64; 3],
) -> Vec<[f64; 3]> {
    let (columns, rows) = (coverage(size[0], cells[0]), coverage(size[1], cells[1]));
    let mut means = Vec::with_capacity(cells[0] * cells[1]);
    let mut sums = vec![[0.0f64; 3]; cells[0]];
    for row in &rows {
        sums.fill([0.0; 3]);
        for (y, height) in (row.first..).zip(&row.parts) {
            for (sum, column) in sums.iter_mut().zip(&columns) {
                let mut row_sum = [0.0; 3];
                for (x, width) in (column.first..).zip(&column.parts) {
                    let value = pixel(y * size[0] + x);
                    (0..3).for_each(|c| row_sum[c] += width * value[c]);
                }
                (0..3).for_each(|c| sum[c] += height * row_sum[c]);
            }
        }
        let length = |cover: &Coverage| cover.parts.iter().sum::<f64>();
        let mean = |(sum, column): (&[f64; 3], &Coverage)| {
            let area = length(column) * length(row);
            sum.map(|s| s / area)
        };
        means.extend(sums.iter().zip(&columns).map(mean));
    }
    means
}

/// Fills the cells without samples, where `known` is `false`, in an image of `cols` x `rows` cells
/// of `stride` values each. Such a cell gets the values of the nearest cell with samples in its
/// row. A row without samples gets the values of the nearest row with samples.
pub(super) fn fill_gaps(
    means: &mut [f32],
    known: &[bool],
    cols: usize,
    rows: usize,
    stride: usize,
) {
    let mut row_known = vec![false; rows];
    for row in 0..rows {
        let known = &known[row * cols..][..cols];
        row_known[row] = known.iter().any(|k| *k);
        let means = &mut means[row * cols * stride..][..cols * stride];
        for (to, from) in nearest(known).into_iter().enumerate() {
            means.copy_within(from * stride..(from + 1) * stride, to * stride);
        }
    }
    let width = cols * stride;
    for (to, from) in nearest(&row_known).into_iter().enumerate() {
        means.copy_within(from * width..(from + 1) * width, to * width);
    }
}

/// Returns, for each element, the index of the nearest element that is `known`; of two equally near
/// elements, the lower index. If no element is known, each gets its own index.
fn nearest(known: &[bool]) -> Vec<usize> {
    let mut below: Vec<Option<usize>> = Vec::with_capacity(known.len());
    for (i, k) in known.iter().enumerate() {
        below.push(if *k { Some(i) } else { below.last().copied().flatten() });
    }
    let mut above = None;
    let mut indices: Vec<usize> = (0..known.len()).collect();
    for i in (0..known.len()).rev() {
        if known[i] {
            above = Some(i);
        }
        indices[i] = match (below[i], above) {
            (Some(below), Some(above)) if i - below > above - i => above,
            (below, above) => below.or(above).unwrap_or(i),
        };
    }
    indices
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constant_images_stay_constant_and_parts_add_up() {
        for (pixels, cells) in [(7, 3), (640, 417), (1000, 999), (5, 1), (9, 9), (3, 8)] {
            let mut covered = vec![0.0; pixels];
            for cover in coverage(pixels, cells) {
                let length: f64 = cover.parts.iter().sum();
                assert!((length - pixels as f64 / cells as f64).abs() < 1e-9);
                (cover.first..).zip(cover.parts).for_each(|(pixel, part)| covered[pixel] += part);
            }
            assert!(covered.iter().all(|part| (part - 1.0).abs() < 1e-9), "{pixels} {cells}");
            let means = box_means([pixels, 2], [cells, 1], |_| [0.1, 0.5, 7.0]);
            assert_eq!(means.len(), cells);
            let near =
                |mean: &[f64; 3]| (mean[2] - 7.0).abs() < 1e-9 && (mean[0] - 0.1).abs() < 1e-9;
            assert!(means.iter().all(near), "{pixels} {cells}");
        }
    }

    #[test]
    fn holes_take_the_nearest_known_element() {
        assert_eq!(nearest(&[false, true, false, false, false, true]), [1, 1, 1, 1, 5, 5]);
        assert_eq!(nearest(&[false, false]), [0, 1]);
    }
}
