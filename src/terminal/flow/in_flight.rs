//! Frames in flight: frames that were sent and are not acknowledged yet.

use std::collections::VecDeque;
use std::time::Duration;

/// Frame that the terminal has not acknowledged yet.
#[derive(Clone, Copy, Debug)]
pub struct InFlight {
    pub sent: Duration,
    pub bytes: usize,
    /// `true` if the frame contains cells of the picture.
    pub picture: bool,
}

/// Frame that the terminal has acknowledged.
#[derive(Clone, Copy, Debug)]
pub struct Acked {
    pub sent: Duration,
    pub bytes: usize,
    /// `true` if no other frame was in flight when this one was sent.
    pub alone: bool,
    /// Times at which the previously acknowledged frame was sent and acknowledged.
    pub previous: Option<[Duration; 2]>,
}

/// Queue of frames in flight, oldest first.
#[derive(Debug, Default)]
pub struct FramesInFlight {
    queue: VecDeque<(InFlight, bool)>,
    /// Times at which the last acknowledged frame was sent and acknowledged.
    last_acked: Option<[Duration; 2]>,
}

impl FramesInFlight {
    pub fn add(&mut self, frame: InFlight) {
        let alone = self.queue.is_empty();
        self.queue.push_back((frame, alone));
    }

    /// Records an acknowledgement and removes the oldest frame, to which it belongs. Returns `None`
    /// if no frame is in flight.
    pub fn on_ack(&mut self, at: Duration) -> Option<Acked> {
        let (InFlight { sent, bytes, .. }, alone) = self.queue.pop_front()?;
        let previous = self.last_acked.replace([sent, at]);
        Some(Acked { sent, bytes, alone, previous })
    }

    pub fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }

    /// Returns the send time of the oldest frame.
    pub fn oldest(&self) -> Option<Duration> {
        self.queue.front().map(|(frame, _)| frame.sent)
    }

    /// Returns the send time of the newest frame.
    pub fn newest(&self) -> Option<Duration> {
        self.queue.back().map(|(frame, _)| frame.sent)
    }

    /// Returns the number of frames with cells of the picture.
    pub fn pictures(&self) -> usize {
        self.queue.iter().filter(|(frame, _)| frame.picture).count()
    }

    /// Returns the number of bytes of the frames that contain only text.
    pub fn text_bytes(&self) -> usize {
        let texts = self.queue.iter().filter(|(frame, _)| !frame.picture);
        texts.map(|(frame, _)| frame.bytes).sum()
    }
}
