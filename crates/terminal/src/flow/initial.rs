//! State of the connection to the terminal before the first frame.

use crate::Capabilities;
use crate::flow::{DEFAULT_RATE, PacingMode};
use std::time::Duration;

/// Shortest plausible round trip over SSH. A reply that comes sooner is from a multiplexer on this
/// machine.
const TOO_SOON: Duration = Duration::from_millis(3);

/// State of the connection to the terminal before the first frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InitialLink {
    /// Method that limits the rate of frames.
    pub mode: PacingMode,
    /// Round-trip time to the terminal.
    pub round_trip: Option<Duration>,
    /// `true` if the kernel reports the length of the TCP send queue.
    pub queue: bool,
    /// Bytes per second in [`PacingMode::FixedRate`].
    pub fixed_rate: f64,
}

impl InitialLink {
    /// Derives the state. `queue` is `true` if the kernel reports the length of the TCP send queue.
    /// `rate` is the fixed rate in bytes per second, if one is wanted.
    pub fn of(terminal: &Capabilities, queue: bool, rate: Option<f64>) -> Self {
        let fallback = if queue { PacingMode::SendQueue } else { PacingMode::FixedRate };
        let multiplexer = terminal.environment.multiplexer;
        let replied = match multiplexer {
            Some(_) => terminal.passthrough,
            None => terminal.round_trip.filter(|time| *time >= TOO_SOON),
        };
        let (mode, round_trip) = match (rate, &terminal.environment.ssh, replied) {
            (Some(_), ..) => (PacingMode::FixedRate, None),
            (None, None, _) => (PacingMode::Unlimited, None),
            (None, Some(_), None) => (fallback, None),
            (None, Some(_), Some(_)) => (PacingMode::AckClocked(multiplexer), replied),
        };
        Self { mode, round_trip, queue, fixed_rate: rate.unwrap_or(DEFAULT_RATE) }
    }
}
