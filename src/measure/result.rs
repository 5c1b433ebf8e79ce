//! What came out.

use super::curve::Point;
use super::plan::{Topic, Variation};
use super::slope::Slope;

/// When a way reached a given noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The true error, in codes.
    pub codes: f64,
    /// Seconds of tracing, median of the repetitions.
    pub seconds: f64,
    /// Half the distance of the quartiles, as a share of the median.
    pub spread: f64,
    /// Samples per pixel, mean.
    pub spp: f64,
    /// The first picture was better already: it took at most this.
    pub at_most: bool,
}

/// What a setting gets wrong, beside noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bias {
    /// Difference of the pictures' means in standard errors.
    pub z: f64,
    /// Root mean square of the pixels' differences that noise does not explain, in codes.
    pub codes: f64,
}

/// One variation, measured.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Which setting.
    pub topic: Topic,
    /// How it differs.
    pub name: String,
    /// Threads that traced.
    pub threads: usize,
    /// The way, first to last.
    pub points: Vec<Point>,
    /// Compared with the reference at the end, if its expectation may be another one.
    pub bias: Option<Bias>,
}

/// Everything about a scene.
pub struct Measurement {
    /// Film size in pixels.
    pub size: [u32; 2],
    /// The reference's samples per pixel; 0: it came from a file.
    pub reference_spp: f64,
    /// The reference's own error, in codes and in linear radiance.
    pub reference_codes: f64,
    /// The same in linear radiance.
    pub reference_linear: f64,
    /// Seconds that the reference took.
    pub reference_seconds: f64,
    /// The noise, in codes, at which settings are compared: a target that the default reached.
    pub compared_at: f64,
    /// The noise levels asked for, falling.
    pub targets: Vec<f64>,
    /// The default first.
    pub measured: Vec<Measured>,
}

/// The middle one; the mean of the two in the middle.
pub fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// Half the distance of the quartiles as a share of the median; 0 for fewer than two values.
pub fn spread(values: &[f64]) -> f64 {
    let middle = median(values);
    if values.len() < 2 || middle == 0.0 {
        return 0.0;
    }
    0.5 * (quantile(values, 0.75) - quantile(values, 0.25)) / middle
}

fn quantile(values: &[f64], q: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = q * last as f64;
    let (low, part) = (at as usize, at.fract());
    sorted[low] + part * (sorted[(low + 1).min(last)] - sorted[low])
}

impl Measured {
    /// An empty record of a variation whose way is `points`.
    pub fn new(variation: &Variation, points: Vec<Point>, bias: Option<Bias>) -> Self {
        Self {
            topic: variation.topic,
            name: variation.name.clone(),
            threads: variation.threads,
            points,
            bias,
        }
    }

    /// Where the true error came down to `codes`, between points on straight lines of the logarithms.
    pub fn crossing(&self, codes: f64) -> Option<Crossing> {
        self.crossing_of(codes, |p| p.errors.rmse_codes)
    }

    /// The same of the error that the program told, for what is never right.
    pub fn told_crossing(&self, codes: f64) -> Option<Crossing> {
        self.crossing_of(codes, |p| p.told_codes.unwrap_or(f64::INFINITY))
    }

    fn crossing_of(&self, codes: f64, of: impl Fn(&Point) -> f64) -> Option<Crossing> {
        let after = self.points.iter().position(|p| of(p) <= codes)?;
        let to = &self.points[after];
        let from = after.checked_sub(1).map(|i| &self.points[i]);
        let (weight, from) = match from {
            // A picture without any error left has no logarithm.
            Some(from) if of(to) > 0.0 && of(from).is_finite() => {
                ((of(from) / codes).ln() / (of(from) / of(to)).ln(), from)
            }
            _ => (1.0, to),
        };
        let between = |a: f64, b: f64| a * (b / a).powf(weight);
        let seconds: Vec<f64> =
            from.seconds.iter().zip(&to.seconds).map(|(a, b)| between(*a, *b)).collect();
        Some(Crossing {
            codes,
            seconds: median(&seconds),
            spread: spread(&seconds),
            spp: between(from.spp, to.spp),
            at_most: after == 0,
        })
    }

    /// Samples per second over the whole way: median and spread of the repetitions.
    pub fn samples_per_second(&self) -> Option<(f64, f64)> {
        let last = self.points.last()?;
        let speeds: Vec<f64> = last.seconds.iter().map(|s| last.samples as f64 / s).collect();
        Some((median(&speeds), spread(&speeds)))
    }

    /// The order of convergence in linear radiance, without the first quarter of the points, which
    /// have too few samples for a law.
    pub fn slope(&self) -> Option<Slope> {
        let from = self.points.len() / 4;
        let points: Vec<_> =
            self.points[from..].iter().map(|p| (p.samples as f64, p.errors.rmse_linear)).collect();
        Slope::fit(&points)
    }

    /// 1 / (MSE x seconds) at the end, linear: what a second is worth.
    pub fn efficiency(&self) -> Option<f64> {
        let last = self.points.last()?;
        let cost = last.errors.rmse_linear.powi(2) * median(&last.seconds);
        (cost > 0.0).then(|| 1.0 / cost)
    }
}

#[cfg(test)]
mod tests {
    use super::super::picture::Errors;
    use super::*;

    fn measured(points: &[(f64, f64)]) -> Measured {
        let point = |(step, (spp, codes)): (usize, &(f64, f64))| Point {
            step: step + 1,
            samples: *spp as u64,
            spp: *spp,
            seconds: vec![*spp * 1e-3, *spp * 3e-3, *spp * 2e-3],
            told_codes: Some(2.0 * codes),
            errors: Errors { rmse_linear: codes / 255.0, rmse_codes: *codes, rel_mse: 0.0 },
        };
        Measured {
            topic: Topic::Default,
            name: String::new(),
            threads: 1,
            points: points.iter().enumerate().map(point).collect(),
            bias: None,
        }
    }

    #[test]
    fn crossings_lie_on_the_power_law() {
        // error = 8 / sqrt(spp)
        let way = measured(&[(16.0, 2.0), (64.0, 1.0), (256.0, 0.5)]);
        let at = way.crossing(2f64.sqrt()).unwrap();
        assert!((at.spp - 32.0).abs() < 1e-9 && (at.seconds - 0.064).abs() < 1e-12, "{at:?}");
        assert!(!at.at_most && (at.spread - 0.25).abs() < 1e-12);
        assert!(way.crossing(3.0).unwrap().at_most);
        assert_eq!(way.crossing(0.4), None);
        assert!((way.told_crossing(2.0).unwrap().spp - 64.0).abs() < 1e-9);
        assert!((way.slope().unwrap().value + 0.5).abs() < 1e-12);
        assert!((way.samples_per_second().unwrap().0 - 500.0).abs() < 1e-9);
    }

    #[test]
    fn quartiles() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[1.0, 2.0]), 1.5);
        assert_eq!(spread(&[1.0, 2.0, 3.0]), 0.25);
        assert_eq!(spread(&[5.0]), 0.0);
        assert!(median(&[]).is_nan());
    }
}
