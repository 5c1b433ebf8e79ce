//! Statistical functions: p-values of chi-square, moments, slopes.

use crate::harness::*;

/// Returns the logarithm of Gamma(a) for a > 0 (Lanczos 1964 with g = 7 and nine terms), with a
/// relative error below 1e-13.
fn ln_gamma(a: f64) -> f64 {
    const C: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    let x = a - 1.0;
    let t = x + 7.5;
    let sum = C[1..].iter().zip(1..).fold(C[0], |s, (c, i)| s + c / (x + f64::from(i)));
    0.5 * (2.0 * PI).ln() + (x + 0.5) * t.ln() - t + sum.ln()
}

/// Returns the regularised upper incomplete gamma function Q(a, x). If x is less than a + 1, it is
/// computed from the power series of P = 1 - Q, otherwise by Lentz's continued fraction.
fn gamma_q(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let factor = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-16 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return 1.0 - factor * sum;
    }
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (1e300, 1.0 / b);
    let mut h = d;
    for i in 1..100_000 {
        let i = f64::from(i);
        let an = -i * (i - a);
        b += 2.0;
        d = 1.0 / (an * d + b);
        c = b + an / c;
        h *= d * c;
        if (d * c - 1.0).abs() < 1e-15 {
            break;
        }
    }
    factor * h
}

/// Returns the probability that a chi-square variable of `dof` degrees of freedom is at least
/// `chi2`.
pub fn chi_square_tail(chi2: f64, dof: usize) -> f64 {
    gamma_q(0.5 * dof as f64, 0.5 * chi2)
}

/// Returns the p-value of `counts` against the expected counts. Bins with fewer than five expected
/// samples are merged.
pub fn chi_square_p(counts: &[u64], expected: &[f64]) -> f64 {
    let mut order: Vec<usize> = (0..counts.len()).collect();
    order.sort_by(|a, b| expected[*a].total_cmp(&expected[*b]));
    let (mut chi2, mut bins) = (0.0, 0);
    let (mut n, mut e) = (0.0, 0.0);
    for (rank, i) in order.iter().enumerate() {
        n += counts[*i] as f64;
        e += expected[*i];
        if e >= 5.0 {
            chi2 += (n - e) * (n - e) / e;
            bins += 1;
            (n, e) = (0.0, 0.0);
        }
        assert!(rank + 1 < order.len() || e == 0.0, "fewer than five samples in all");
    }
    chi_square_tail(chi2, bins - 1)
}

/// Returns the slope of the least-squares line through `points`.
pub fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
    let (mx, my) = (mean(|p| p.0), mean(|p| p.1));
    let sxy: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    let sxx: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
    sxy / sxx
}

/// Compares the tail probability with tabulated 97.5 % points of chi-square distributions. Also
/// checks Q(1, x) = exp(-x).
#[test]
fn chi_square_tail_matches_tables() {
    for (chi2, dof) in [(5.024, 1), (20.483, 10), (129.561, 100), (1_089.531, 1000)] {
        assert!((chi_square_tail(chi2, dof) - 0.025).abs() < 2e-5, "{dof}");
    }
    for x in [1e-3, 0.5, 2.0, 30.0] {
        assert!((gamma_q(1.0, x) / (-x).exp() - 1.0).abs() < 1e-12, "{x}");
    }
}
