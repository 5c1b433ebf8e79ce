//! Tail probabilities of the normal distribution and of Student's t-distribution.

/// Returns the probability that the magnitude of a standard normal number exceeds `z`, by a
/// continued fraction.
pub fn tail(z: f64) -> f64 {
    let fraction = (1..200).rev().fold(z, |f, k| z + f64::from(k) / f);
    2.0 * (-0.5 * z * z).exp() / (std::f64::consts::TAU.sqrt() * fraction)
}

/// Returns the inverse of [`tail`], found by bisection: the number above 1.5 that the magnitude of
/// a standard normal number exceeds with the probability `p`.
pub fn two_sided_z(p: f64) -> f64 {
    let (mut low, mut high) = (1.5, 20.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if tail(middle) > p { low = middle } else { high = middle }
    }
    high
}

/// Returns the standard normal number with the same tail probability as `t` in Student's
/// t-distribution with `freedom` degrees of freedom (Wallace 1959).
pub fn z_of_t(t: f64, freedom: f64) -> f64 {
    (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0) * (freedom * (t * t / freedom).ln_1p()).sqrt()
}
