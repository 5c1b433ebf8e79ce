//! Order of convergence: the slope of log error against log samples.

/// Slope of a least-squares line in log-log coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slope {
    /// d log(error) / d log(samples): -0.5 for independent random samples.
    pub value: f64,
    /// Standard error of `value`, from the residuals of the line.
    pub standard_error: f64,
}

impl Slope {
    /// Fits a line to the pairs (samples, error) in which both numbers are positive. Returns `None`
    /// for fewer than three such pairs, or if all have the same number of samples.
    pub fn fit(points: &[(f64, f64)]) -> Option<Self> {
        let logs: Vec<(f64, f64)> = points
            .iter()
            .filter(|(n, e)| *n > 0.0 && *e > 0.0)
            .map(|(n, e)| (n.ln(), e.ln()))
            .collect();
        if logs.len() < 3 {
            return None;
        }
        let n = logs.len() as f64;
        let mean_x = logs.iter().map(|p| p.0).sum::<f64>() / n;
        let mean_y = logs.iter().map(|p| p.1).sum::<f64>() / n;
        let xx = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum::<f64>();
        if xx == 0.0 {
            return None;
        }
        let xy = logs.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum::<f64>();
        let value = xy / xx;
        let residual =
            logs.iter().map(|p| (p.1 - mean_y - value * (p.0 - mean_x)).powi(2)).sum::<f64>();
        Some(Self { value, standard_error: (residual / (n - 2.0) / xx).sqrt() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_of_a_power_law_is_exact() {
        let points: Vec<_> =
            (0..6).map(|k| (2f64.powi(k), 3.0 * 2f64.powi(k).powf(-0.62))).collect();
        let slope = Slope::fit(&points).unwrap();
        assert!((slope.value + 0.62).abs() < 1e-12 && slope.standard_error < 1e-12, "{slope:?}");
        assert_eq!(Slope::fit(&points[..2]), None);
    }

    /// Checks the standard error of the slope of a horizontal line through three points. The
    /// residuals are (1, -2, 1) / 10, with the sum of squares 0.06. With one degree of freedom, and
    /// 2 as the sum of squares of the abscissas, the standard error is sqrt(0.06 / 1 / 2).
    #[test]
    fn scatter_determines_the_standard_error() {
        let e = std::f64::consts::E;
        let points = [(1.0, 0.1f64.exp()), (e, (-0.2f64).exp()), (e * e, 0.1f64.exp())];
        let slope = Slope::fit(&points).unwrap();
        assert!(slope.value.abs() < 1e-12);
        assert!((slope.standard_error - 0.03f64.sqrt()).abs() < 1e-12, "{slope:?}");
    }
}
