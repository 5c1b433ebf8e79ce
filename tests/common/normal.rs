//! Tails of the normal distribution and of Student's t-distribution.
#![allow(dead_code, reason = "each of the two test programs uses a part")]

/// Two-sided probability that the magnitude of a standard normal number exceeds `z`, by its continued
/// fraction.
pub fn tail(z: f64) -> f64 {
    let fraction = (1..200).rev().fold(z, |f, k| z + f64::from(k) / f);
    2.0 * (-0.5 * z * z).exp() / (std::f64::consts::TAU.sqrt() * fraction)
}

/// Inverse of [`tail`] by bisection: the `z` above 1.5 whose two-sided probability is `p`.
pub fn two_sided_z(p: f64) -> f64 {
    let (mut low, mut high) = (1.5, 20.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if tail(middle) > p { low = middle } else { high = middle }
    }
    high
}

/// Standard normal number with the same tail probability as `t` in Student's t-distribution.
/// `freedom` is the number of degrees of freedom (Wallace 1959).
pub fn z_of_t(t: f64, freedom: f64) -> f64 {
    (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0) * (freedom * (t * t / freedom).ln_1p()).sqrt()
}
