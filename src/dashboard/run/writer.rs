//! Frames on their way to the terminal: a slow one holds up its thread, never the dashboard.

use crate::terminal::Tty;
use crossbeam_channel::{Receiver, Sender, bounded};
use std::io;
use std::sync::Arc;
use std::thread;
use std::time::Instant;

/// A frame that has been handed to the terminal, or not, and why.
pub struct Written {
    /// When.
    pub at: Instant,
    /// Whether the terminal took it.
    pub result: io::Result<()>,
    /// The bytes, to be used again.
    buffer: Vec<u8>,
}

/// A thread that writes one frame at a time.
pub struct Writer {
    frames: Sender<Vec<u8>>,
    written: Receiver<Written>,
    in_flight: bool,
    /// An empty buffer for the next frame.
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

    /// Whether a frame could be sent now: none is on its way.
    pub fn ready(&self) -> bool {
        !self.in_flight
    }

    /// An empty buffer.
    pub fn buffer(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.spare)
    }

    /// Takes back an empty buffer.
    pub fn keep(&mut self, buffer: Vec<u8>) {
        self.spare = buffer;
    }

    /// Sends a frame. Only when [`Writer::ready`].
    pub fn send(&mut self, frame: Vec<u8>) {
        debug_assert!(self.ready(), "one frame at a time");
        // The thread ends only with this sender.
        self.in_flight = self.frames.send(frame).is_ok();
    }

    /// Tells when the frame on its way has been written; pass what it tells to [`Writer::done`].
    pub fn written(&self) -> &Receiver<Written> {
        &self.written
    }

    /// Takes note that the frame has been written; says when.
    pub fn done(&mut self, written: Written) -> io::Result<Instant> {
        self.in_flight = false;
        self.spare = written.buffer;
        self.spare.clear();
        written.result.map(|()| written.at)
    }
}
