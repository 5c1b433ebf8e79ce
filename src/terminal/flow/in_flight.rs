//! Frames whose arrival has not been told yet.

use std::collections::VecDeque;
use std::time::Duration;

/// A frame on its way.
#[derive(Clone, Copy, Debug)]
pub struct InFlight {
    pub sent: Duration,
    pub bytes: usize,
    /// It has parts of the picture.
    pub picture: bool,
}

/// A frame that has arrived.
#[derive(Clone, Copy, Debug)]
pub struct Acked {
    pub sent: Duration,
    pub bytes: usize,
    /// No other frame was on its way when it was sent.
    pub alone: bool,
}

/// Frames on their way, in order.
#[derive(Debug, Default)]
pub struct FramesInFlight {
    queue: VecDeque<(InFlight, bool)>,
    /// When the last one arrived.
    arrived: Option<Duration>,
}

impl FramesInFlight {
    pub fn add(&mut self, flight: InFlight) {
        let alone = self.queue.is_empty();
        self.queue.push_back((flight, alone));
    }

    /// The oldest has arrived; with when the one before it had.
    pub fn on_ack(&mut self, at: Duration) -> Option<(Acked, Option<Duration>)> {
        let (InFlight { sent, bytes, .. }, alone) = self.queue.pop_front()?;
        Some((Acked { sent, bytes, alone }, self.arrived.replace(at)))
    }

    pub fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }

    /// When the oldest was sent.
    pub fn oldest(&self) -> Option<Duration> {
        self.queue.front().map(|(flight, _)| flight.sent)
    }

    /// When the newest was sent.
    pub fn newest(&self) -> Option<Duration> {
        self.queue.back().map(|(flight, _)| flight.sent)
    }

    /// How many have parts of the picture.
    pub fn pictures(&self) -> usize {
        self.queue.iter().filter(|(flight, _)| flight.picture).count()
    }

    /// Bytes of those that are only text.
    pub fn text_bytes(&self) -> usize {
        let texts = self.queue.iter().filter(|(flight, _)| !flight.picture);
        texts.map(|(flight, _)| flight.bytes).sum()
    }
}
