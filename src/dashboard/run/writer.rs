//! Thread that writes frames to the terminal, so that a slow terminal does not block the dashboard.

use crate::terminal::Tty;
use crossbeam_channel::{Receiver, Sender, bounded};
use std::io;
use std::sync::Arc;
use std::thread;
use std::time::Instant;

/// Result of writing a frame to the terminal.
pub struct Written {
    /// Time at which writing to the terminal was completed.
    pub at: Instant,
    /// Success, or the error of writing to the terminal.
    pub result: io::Result<()>,
    /// Buffer that held the frame, to be reused.
    buffer: Vec<u8>,
}

/// Handle of the thread that writes frames to the terminal, one at a time.
pub struct Writer {
    frames: Sender<Vec<u8>>,
    /// Receiver of the results of writing frames, one for each frame. Each result must be passed to
    /// [`Writer::done`].
    pub written: Receiver<Written>,
    /// `true` if a frame is being written.
    in_flight: bool,
    /// Empty buffer, for reuse by the next frame.
    spare: Vec<u8>,
}

impl Writer {
    /// Starts the thread that writes frames to `tty`.
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

    /// Returns `true` if no frame is being written, so that another one can be sent.
    pub fn ready(&self) -> bool {
        !self.in_flight
    }

    /// Returns an empty buffer for the next frame.
    pub fn buffer(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.spare)
    }

    /// Takes back the buffer of a frame that was not sent, so that the next frame reuses its
    /// memory.
    pub fn keep(&mut self, buffer: Vec<u8>) {
        self.spare = buffer;
    }

    /// Passes a frame to the writing thread. Requires [`Writer::ready`].
    pub fn send(&mut self, frame: Vec<u8>) {
        debug_assert!(self.ready(), "one frame at a time");
        // Sending fails only after a panic of the thread.
        self.in_flight = self.frames.send(frame).is_ok();
    }

    /// Records that a frame was written to the terminal. Returns the time at which the write was
    /// completed.
    ///
    /// # Errors
    /// Fails if the write failed.
    pub fn done(&mut self, written: Written) -> io::Result<Instant> {
        self.in_flight = false;
        self.spare = written.buffer;
        self.spare.clear();
        written.result.map(|()| written.at)
    }
}
