//! Comparison of pictures with several seeds, by the means of blocks of pixels. Pictures with
//! different seeds are independent. For every sampler, the spread of a block's means over the seeds
//! therefore estimates the error of the mean over all seeds.

use crate::harness::*;

/// Probability of a false alarm in the comparison of one scene.
const LEVEL: f64 = 1e-6;

/// Side of a block in pixels; a divisor of the tile size.
pub const BLOCK: usize = 8;

/// Returns the pixel indices of each block, followed by those of the whole picture.
pub fn blocks([width, height]: [u32; 2]) -> Vec<Vec<usize>> {
    let [width, height] = [width as usize, height as usize];
    let block = |x0: usize, y0: usize| {
        let ys = y0..(y0 + BLOCK).min(height);
        ys.flat_map(|y| (x0..(x0 + BLOCK).min(width)).map(move |x| y * width + x)).collect()
    };
    let corners = (0..height).step_by(BLOCK);
    let mut all: Vec<Vec<usize>> =
        corners.flat_map(|y| (0..width).step_by(BLOCK).map(move |x| block(x, y))).collect();
    all.push((0..width * height).collect());
    all
}

/// Returns the mean colour over the pixels with the indices `pixels`.
pub fn mean_of(picture: &[[f64; 3]], pixels: &[usize]) -> [f64; 3] {
    let n = pixels.len() as f64;
    [0, 1, 2].map(|c| pixels.iter().map(|p| picture[*p][c]).sum::<f64>() / n)
}

pub fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (squares / (n - 1.0) / n).sqrt())
}

/// Largest of many deviations, each relative to its standard error.
pub struct Worst {
    count: f64,
    freedom: f64,
    z: f64,
    what: String,
}

impl Worst {
    /// Starts a comparison of `count` pairs of numbers. The standard error of each difference has
    /// `freedom` degrees of freedom.
    pub fn new(count: usize, freedom: usize) -> Self {
        Self { count: count as f64, freedom: freedom as f64, z: 0.0, what: String::new() }
    }

    /// Records a difference with its standard error. `floor` is the allowed part of the difference,
    /// such as that by rounding. `what` returns a description of the difference.
    pub fn note(&mut self, difference: f64, floor: f64, error: f64, what: impl FnOnce() -> String) {
        let excess = (difference.abs() - floor).max(0.0);
        let t = if excess == 0.0 { 0.0 } else { excess / error };
        let z = z_of_t(t.min(1e12), self.freedom);
        if z > self.z || z.is_nan() {
            (self.z, self.what) = (z, format!("{} (t {t:.1})", what()));
        }
    }

    /// Returns a text about the largest deviation if it is significant among all comparisons
    /// (Bonferroni).
    pub fn beyond_chance(self) -> Option<String> {
        let allowed = two_sided_z(LEVEL / self.count);
        let wrong = self.z.is_nan() || self.z > allowed;
        wrong.then(|| format!("{}; z {:.1} of {allowed:.1}", self.what, self.z))
    }
}
