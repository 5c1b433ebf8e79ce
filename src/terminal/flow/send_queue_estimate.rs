//! What the kernel of this machine has not got rid of yet.

use std::time::Duration;

/// What the kernel holds back.
#[derive(Debug, Default)]
pub struct SendQueueEstimate {
    /// Bytes.
    pub bytes: f64,
    /// When it was asked last.
    pub asked: Option<Duration>,
    /// Bytes that it had got rid of then.
    pub drained: f64,
    /// Since when it has always held something back, and what it had got rid of before.
    pub busy_since: Option<(Duration, f64)>,
    /// Bytes that were sent in all.
    pub sent: f64,
}
