//! Thread that writes frames, so that a slow terminal does not block the dashboard.

use crate::terminal::Tty;
use crossbeam_channel::{Receiver, Sender, bounded};
use std::io;
use std::sync::Arc;
use std::thread;
use std::time::Instant;

/// Result of writing a frame.
pub struct Written {
    /// Time of completion.
    pub at: Instant,
    /// Result of the write.
    pub result: io::Result<()>,
    /// Buffer for reuse.
    buffer: Vec<u8>,
}

/// A thread that writes one frame at a time.
pub struct Writer {
    frames: Sender<Vec<u8>>,
    written: Receiver<Written>,
    in_flight: bool,
    /// Empty buffer for the next frame.
    spare: Vec<u8>,
}

impl Writer {
    /// Starts the thread.
    pub fn new(tty: Arc<Tty>) -> io::Result<Self> {
        let (frames, inbox) = bounded::<Vec<u8>>(1);
        let (outbox, written) = bounded(1);
        thread::Builder::new().name("writer".into()).spawn(move || {
            for buffer in inbox {
                let result = tty.write(&buffer);
                if outbox.send(Written { at: Instant::now(), result, buffer }).is_err() {
                    break;
                }
            }
        })?;
        Ok(Self { frames, written, in_flight: false, spare: Vec::new() })
    }

    /// Returns `true` if no frame is in flight.
    pub fn ready(&self) -> bool {
        !self.in_flight
    }

    /// Returns an empty buffer.
    pub fn buffer(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.spare)
    }

    /// Takes back an unused buffer.
    pub fn keep(&mut self, buffer: Vec<u8>) {
        self.spare = buffer;
    }

    /// Sends a frame. Requires [`Writer::ready`].
    pub fn send(&mut self, frame: Vec<u8>) {
        debug_assert!(self.ready(), "one frame at a time");
        // The thread ends only with this sender.
        self.in_flight = self.frames.send(frame).is_ok();
    }

    /// Receives the result of each frame; pass it to [`Writer::done`].
    pub fn written(&self) -> &Receiver<Written> {
        &self.written
    }

    /// Records that the frame was written; returns when.
    pub fn done(&mut self, written: Written) -> io::Result<Instant> {
        self.in_flight = false;
        self.spare = written.buffer;
        self.spare.clear();
        written.result.map(|()| written.at)
    }
}
