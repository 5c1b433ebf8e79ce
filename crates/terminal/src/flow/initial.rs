//! State of the connection to the terminal before the first frame.

use crate::Capabilities;
use crate::flow::{DEFAULT_RATE, PacingMode};
use std::time::Duration;

/// Shortest plausible round trip over SSH. A reply that comes sooner is from a program on this side
/// of the connection, such as a multiplexer, and not from the terminal.
const TOO_SOON: Duration = Duration::from_millis(3);

/// State of the connection to the terminal before the first frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InitialLink {
    /// Method that limits the rate of frames.
    pub mode: PacingMode,
    /// Round-trip time to the terminal: from a request to its reply. `None` if it was not measured.
    pub round_trip: Option<Duration>,
    /// `true` if the kernel reports the length of the connection's TCP send queue.
    pub queue: bool,
    /// Rate at which frames are sent in [`PacingMode::FixedRate`], in bytes per second.
    pub fixed_rate: f64,
}

impl InitialLink {
    /// Derives the state from `terminal`, the capabilities of the terminal. `queue` is `true` if
    /// the kernel reports the length of the connection's TCP send queue. If `rate` is given, frames
    /// are sent at this fixed rate, in bytes per second; if it is `None`, the rate is measured
    /// where possible.
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
