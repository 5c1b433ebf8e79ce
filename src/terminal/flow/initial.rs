//! What is known about the line before anything was sent.

use crate::terminal::Capabilities;
use crate::terminal::flow::{DEFAULT_RATE, PacingMode};
use std::time::Duration;

/// An answer that comes sooner over SSH was not given by the terminal.
const TOO_SOON: Duration = Duration::from_millis(3);

/// What is known about the line at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InitialLink {
    /// How it is known what has arrived.
    pub mode: PacingMode,
    /// How long the terminal's answer takes, if it is known.
    pub round_trip: Option<Duration>,
    /// Whether the kernel can be asked.
    pub queue: bool,
    /// What goes out in a second when nothing can be known, in bytes.
    pub fixed_rate: f64,
}

impl InitialLink {
    /// By what the terminal has answered. `queue`: whether the kernel can be asked; `rate`: what the
    /// user wants to be sent in a second, whatever the line may carry.
    pub fn of(terminal: &Capabilities, queue: bool, rate: Option<f64>) -> Self {
        let otherwise = if queue { PacingMode::SendQueue } else { PacingMode::FixedRate };
        let multiplexer = terminal.environment.multiplexer;
        let (mode, round_trip) = match (rate, &terminal.environment.ssh) {
            (Some(_), _) => (PacingMode::FixedRate, None),
            (None, None) => (PacingMode::Unlimited, None),
            (None, Some(_)) => match (multiplexer, terminal.passthrough, terminal.round_trip) {
                (Some(_), Some(took), _) => (PacingMode::AckClocked(multiplexer), Some(took)),
                (Some(_), None, _) | (None, _, None) => (otherwise, None),
                (None, _, Some(took)) if took < TOO_SOON => (otherwise, None),
                (None, _, took) => (PacingMode::AckClocked(None), took),
            },
        };
        Self { mode, round_trip, queue, fixed_rate: rate.unwrap_or(DEFAULT_RATE) }
    }
}
