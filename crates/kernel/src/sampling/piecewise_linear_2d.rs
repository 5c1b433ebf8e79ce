//! Piecewise-linear 2D distribution: its density is the bilinear interpolation of a grid of weights.
//!
//! The density is a sum of tents, one around the centre of each cell of the grid. A sample selects a
//! row of cells, then a cell of the row, then a point of the cell's tent. Columns are cyclic. Towards
//! the outer edges of the first and the last row, the density falls to zero.

use crate::lanes::{Float, MAX_WIDTH, SimdFloat};

/// Steps from 0 to 1 in which cumulative distributions are stored. Single-precision lanes have
/// random numbers of this resolution.
const STEPS: f64 = 16_777_216.0;

/// Cumulative distributions with the same number of bins, and *cutpoints*: the bins in which the
/// search for a number starts (Chen and Asau 1974, *On Generating Random Variates from an Empirical
/// Distribution*). A search takes two steps on average, whatever the distribution.
#[derive(Clone, Debug, PartialEq)]
struct Cumulative {
    bins: usize,
    /// For each distribution, `bins` + 1 numbers from 0 to 1.
    bounds: Vec<f32>,
    /// For each distribution, the bins that contain the numbers 0 / `bins`, 1 / `bins` and so on.
    cutpoints: Vec<u16>,
}

impl Cumulative {
    fn new(bins: usize, distributions: usize) -> Self {
        Self {
            bins,
            bounds: Vec::with_capacity((bins + 1) * distributions),
            cutpoints: Vec::with_capacity(bins * distributions),
        }
    }

    /// Adds a distribution with probabilities in proportion to `weights`; if their `total` is zero,
    /// all is in the last bin.
    fn push(&mut self, weights: &[f64], total: f64) {
        let (mut sum, mut bound, mut next) = (0.0, 0.0, 0);
        self.bounds.push(0.0);
        for (bin, weight) in weights.iter().enumerate() {
            sum += weight;
            if bin + 1 == self.bins {
                bound = 1.0;
            } else if total > 0.0 {
                bound = (sum / total * STEPS).round().min(STEPS) / STEPS;
            }
            self.bounds.push(bound as f32);
            while next < self.bins && (next as f64) < bound * self.bins as f64 {
                self.cutpoints.push(bin as u16);
                next += 1;
            }
        }
    }

    fn probability(&self, distribution: usize, bin: usize) -> f64 {
        let first = distribution * (self.bins + 1) + bin;
        f64::from(self.bounds[first + 1]) - f64::from(self.bounds[first])
    }

    /// Returns the bin of the distribution `of[i]` that contains `numbers`, and the position of
    /// `numbers` in this bin, 0 to 1, in each lane i.
    #[inline(always)]
    fn invert<L: SimdFloat>(&self, of: &[u16; MAX_WIDTH], numbers: L) -> ([u16; MAX_WIDTH], L) {
        let mut bins = [0; MAX_WIDTH];
        let [mut low, mut high] = [[L::Scalar::default(); MAX_WIDTH]; 2];
        for lane in 0..L::WIDTH {
            let (number, of) = (numbers.lane(lane).to_f64(), usize::from(of[lane]));
            let cutpoint = of * self.bins + (number * self.bins as f64) as usize;
            let bounds = &self.bounds[of * (self.bins + 1)..][..=self.bins];
            let mut bin = usize::from(self.cutpoints[cutpoint]);
            // In most cases one step without a branch suffices.
            bin += usize::from(f64::from(bounds[bin + 1]) <= number);
            while f64::from(bounds[bin + 1]) <= number {
                bin += 1;
            }
            let bound = |i: usize| L::Scalar::from_f64(f64::from(bounds[i]));
            (bins[lane], low[lane], high[lane]) = (bin as u16, bound(bin), bound(bin + 1));
        }
        let [low, high] = [low, high].map(|bounds| L::from_fn(|lane| bounds[lane]));
        (bins, (numbers - low) / (high - low))
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.bounds[..]) + size_of_val(&self.cutpoints[..])
    }
}

/// Sampling distribution of points over a grid of cells with sides of length 1.
#[derive(Clone, Debug, PartialEq)]
pub struct PiecewiseLinear2D {
    rows: Cumulative,
    columns: Cumulative,
}

impl PiecewiseLinear2D {
    /// Creates the distribution from the numbers of columns and rows and the weight at the centre of
    /// each cell, given its column and row. At least one weight must be positive.
    pub fn new([columns, rows]: [usize; 2], weight: impl Fn(usize, usize) -> f64) -> Self {
        let mut of_columns = Cumulative::new(columns, rows);
        let mut of_rows = Cumulative::new(rows, 1);
        let mut totals = Vec::with_capacity(rows);
        for row in 0..rows {
            let weights: Vec<f64> = (0..columns).map(|column| weight(column, row)).collect();
            let total = weights.iter().sum();
            of_columns.push(&weights, total);
            totals.push(total * Self::height(rows, row));
        }
        of_rows.push(&totals, totals.iter().sum());
        Self { rows: of_rows, columns: of_columns }
    }

    /// Returns the integral of the tent of a row.
    fn height(rows: usize, row: usize) -> f64 {
        let half = |is_edge: bool| if is_edge { 0.25 } else { 0.5 };
        half(row == 0) + half(row + 1 == rows)
    }

    /// Returns the density at the centre of a cell.
    pub fn density(&self, column: usize, row: usize) -> f64 {
        let height = Self::height(self.rows.bins, row);
        self.rows.probability(0, row) * self.columns.probability(row, column) / height
    }

    /// Samples a point: its distance from the left edge, which may be up to 0.5 beyond either edge,
    /// and its distance from the upper edge. `u` and `v` are uniform in [0, 1); `u` selects the
    /// column and `v` the row.
    #[inline(always)]
    pub fn sample<L: SimdFloat>(&self, u: L, v: L) -> (L, L) {
        let (rows, t) = self.rows.invert(&[0; MAX_WIDTH], v);
        let (columns, s) = self.columns.invert(&rows, u);
        let bin =
            |bins: [u16; MAX_WIDTH]| L::from_fn(|lane| L::Scalar::from_f64(f64::from(bins[lane])));
        let (row, last) = (bin(rows), L::from_f64(self.rows.bins as f64 - 1.0));
        let (half, one) = (L::from_f64(0.5), L::one());
        let up = L::select(row.gt(L::zero()), one, half);
        let down = L::select(row.lt(last), one, half);
        (bin(columns) + half + tent(s, one, one), row + half + tent(t, up, down))
    }

    /// Returns the memory of the distribution in bytes.
    pub fn bytes(&self) -> usize {
        self.rows.bytes() + self.columns.bytes()
    }
}

/// Maps numbers in [0, 1) to the interval from `-down` to `up`, with a density that falls linearly
/// from 0 to both ends.
#[inline(always)]
fn tent<L: SimdFloat>(x: L, down: L, up: L) -> L {
    let split = down / (down + up);
    let below = x.lt(split);
    let position = L::select(below, x / split, (L::one() - x) / (L::one() - split));
    let distance = L::one() - position.max(L::zero()).sqrt();
    L::select(below, -(down * distance), up * distance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{Double, Single};

    const SIZE: [usize; 2] = [24, 12];

    fn distribution(bright: f64) -> PiecewiseLinear2D {
        let weight = |column: usize, row: usize| match (column, row) {
            (9, 5) => bright,
            _ => ((row * SIZE[0] + column) % 7) as f64,
        };
        PiecewiseLinear2D::new(SIZE, weight)
    }

    /// Bilinear interpolation of the densities of cells, zero at the upper and lower edge.
    fn density(distribution: &PiecewiseLinear2D, x: f64, y: f64) -> f64 {
        let tent = |distance: f64| (1.0 - distance.abs()).max(0.0);
        let mut sum = 0.0;
        for row in 0..SIZE[1] {
            let centre = row as f64 + 0.5;
            let is_outer = row == 0 && y < centre || row + 1 == SIZE[1] && y > centre;
            let of_row = tent((y - centre) * if is_outer { 2.0 } else { 1.0 });
            for column in 0..SIZE[0] {
                let centre = column as f64 + 0.5;
                let turn = SIZE[0] as f64;
                let of_column: f64 = [-turn, 0.0, turn].map(|t| tent(x - centre + t)).iter().sum();
                sum += of_row * of_column * distribution.density(column, row);
            }
        }
        sum
    }

    /// Checks by Pearson's chi-square test that pseudo-random samples follow the density, which is
    /// integrated over quarters of cells. The limit is the 99.9 % quantile, in the approximation by
    /// Wilson and Hilferty.
    #[test]
    fn samples_follow_the_interpolated_density() {
        for bright in [1.0, 1e3] {
            let distribution = distribution(bright);
            let [columns, rows] = SIZE.map(|n| 2 * n);
            let mut counts = vec![0.0; columns * rows];
            let mut state = 1u64;
            let mut unit = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (state >> 11) as f64 / (1u64 << 53) as f64
            };
            let n = 400_000;
            for _ in 0..n {
                let (x, y) = distribution.sample(unit(), unit());
                let column = (2.0 * x).floor().rem_euclid(columns as f64) as usize;
                counts[(2.0 * y) as usize * columns + column] += 1.0;
            }
            let (mut statistic, mut cells, mut total) = (0.0, 0.0, 0.0);
            for (i, count) in counts.iter().enumerate() {
                // The density is bilinear in a quarter, so that its mean is its value in the middle.
                let middle = |i: usize| (i as f64 + 0.5) / 2.0;
                let expected =
                    0.25 * density(&distribution, middle(i % columns), middle(i / columns));
                total += expected;
                let expected = f64::from(n) * expected;
                if expected >= 5.0 {
                    statistic += (count - expected).powi(2) / expected;
                    cells += 1.0;
                }
            }
            assert!((total - 1.0).abs() < 1e-9, "{total}");
            let k: f64 = cells - 1.0;
            let spread = 2.0 / (9.0 * k);
            let quantile = k * (1.0 - spread + 3.09 * spread.sqrt()).powi(3);
            assert!(cells > 100.0 && statistic < quantile, "{statistic} of {quantile}, {cells}");
        }
    }

    /// Checks that a regular grid of 256 x 256 points (u, v) is stratified: the number of samples in
    /// a row differs from its expectation by at most one row of the grid, and none is in a cell
    /// without weight. All lane types give the same samples.
    #[test]
    fn grid_of_numbers_gives_stratified_samples() {
        let n = 256;
        for bright in [1.0, 300.0, 1e6] {
            let distribution = distribution(bright);
            let mut counts = [0.0; SIZE[1]];
            for i in 0..n * n {
                let number = |k: usize| (k as f64 + 0.5) / n as f64;
                let (u, v) = (number(i % n), number(i / n));
                let (rows, t) = distribution.rows.invert(&[0; MAX_WIDTH], v);
                let (columns, s) = distribution.columns.invert(&rows, u);
                let [row, column] = [rows[0], columns[0]].map(usize::from);
                counts[row] += 1.0 / n as f64;
                assert!((0.0..1.0).contains(&s) && (0.0..1.0).contains(&t));
                assert!(distribution.density(column, row) > 0.0);
                if i % 97 == 0 {
                    let (x, y) = distribution.sample(u, v);
                    let wide = distribution.sample(Double::splat(u), Double::splat(v));
                    assert_eq!((wide.0.lane(1), wide.1.lane(1)), (x, y));
                    let wide = distribution.sample(Single::from_f64(u), Single::from_f64(v));
                    assert!((f64::from(wide.0.lane(1)) - x).abs() < 1e-2, "{x}");
                    assert!((f64::from(wide.1.lane(1)) - y).abs() < 1e-2, "{y}");
                }
            }
            for (row, count) in counts.iter().enumerate() {
                let expected = n as f64 * distribution.rows.probability(0, row);
                assert!((count - expected).abs() <= 1.0, "{row}: {count}, {expected}");
            }
        }
    }
}
