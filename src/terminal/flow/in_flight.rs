//! Frames in flight: frames that were sent to the terminal and are not acknowledged yet.

use std::collections::VecDeque;
use std::time::Duration;

/// Frame that the terminal has not acknowledged yet.
#[derive(Clone, Copy, Debug)]
pub struct InFlight {
    pub sent: Duration,
    pub bytes: usize,
    /// `true` if the frame contains cells of the picture.
    pub picture: bool,
    /// `true` if no other frame was in flight when this one was sent.
    pub alone: bool,
}

/// Queue of frames in flight, oldest first.
#[derive(Debug, Default)]
pub struct FramesInFlight {
    queue: VecDeque<InFlight>,
    /// `[time of sending, time of acknowledgement]` of the last acknowledged frame. `None` before
    /// the first acknowledgement.
    last_acked: Option<[Duration; 2]>,
}

impl FramesInFlight {
    /// Adds a frame of `bytes` bytes that was sent at the time `sent`. `picture` is `true` if the
    /// frame contains cells of the picture.
    pub fn add(&mut self, sent: Duration, bytes: usize, picture: bool) {
        let alone = self.queue.is_empty();
        self.queue.push_back(InFlight { sent, bytes, picture, alone });
    }

    /// Records an acknowledgement by the terminal at the time `at`. It belongs to the oldest frame
    /// in flight, which is removed. Returns `(frame, times)`. `frame` is the removed frame. `times`
    /// is `[time of sending, time of acknowledgement]` of the frame that was acknowledged before;
    /// it is `None` for the first frame. Returns `None` if no frame is in flight.
    pub fn on_ack(&mut self, at: Duration) -> Option<(InFlight, Option<[Duration; 2]>)> {
        let frame = self.queue.pop_front()?;
        Some((frame, self.last_acked.replace([frame.sent, at])))
    }

    pub fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }

    /// Returns the time at which the oldest frame in flight was sent; `None` if no frame is in
    /// flight.
    pub fn oldest(&self) -> Option<Duration> {
        self.queue.front().map(|frame| frame.sent)
    }

    /// Returns the time at which the newest frame in flight was sent; `None` if no frame is in
    /// flight.
    pub fn newest(&self) -> Option<Duration> {
        self.queue.back().map(|frame| frame.sent)
    }

    /// Returns the number of frames in flight (sent, not acknowledged) that contain cells of the
    /// picture.
    pub fn pictures(&self) -> usize {
        self.queue.iter().filter(|frame| frame.picture).count()
    }

    /// Returns the number of bytes, summed over the frames in flight that contain only text.
    pub fn text_bytes(&self) -> usize {
        let texts = self.queue.iter().filter(|frame| !frame.picture);
        texts.map(|frame| frame.bytes).sum()
    }
}
