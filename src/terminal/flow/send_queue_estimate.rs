//! Bytes still in the kernel's TCP send queue.

use std::time::Duration;

/// Estimate of the send queue and its drain rate.
#[derive(Debug, Default)]
pub struct SendQueueEstimate {
    /// Bytes in the queue.
    pub bytes: f64,
    /// Time of the last measurement.
    pub asked: Option<Duration>,
    /// Bytes that had left the queue by then.
    pub drained: f64,
    /// Start of the period in which the queue was never empty, and the bytes drained before.
    pub busy_since: Option<(Duration, f64)>,
    /// Bytes sent in total.
    pub sent: f64,
}
