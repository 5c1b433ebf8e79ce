//! Estimate of the bytes still in the kernel's TCP send queue.

use std::time::Duration;

/// Estimate of the length of the send queue and of the rate at which bytes leave it.
#[derive(Debug, Default)]
pub struct SendQueueEstimate {
    /// Number of bytes in the queue: the last measurement plus the bytes sent since.
    pub bytes: f64,
    /// Time of the last measurement.
    pub asked: Option<Duration>,
    /// Number of bytes that had left the queue by the last measurement.
    pub drained: f64,
    /// Start of the current period in which the queue was never empty, and the number of bytes that
    /// had left the queue before this period.
    pub busy_since: Option<(Duration, f64)>,
    /// Number of bytes sent in total.
    pub sent: f64,
}
