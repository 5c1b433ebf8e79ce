//! Thread that writes frames to the terminal, so that a slow terminal does not block the dashboard.

use crossbeam_channel::{Receiver, Sender, bounded};
use std::sync::Arc;
use std::time::Instant;
use std::{io, thread};
use zerkalo_terminal::Tty;

pub struct Writer {
    pub frames: Sender<Vec<u8>>,
    /// Time at which each frame was completely written. The receiver is disconnected as soon as a
    /// write fails.
    pub written: Receiver<Instant>,
}

pub fn start(tty: Arc<Tty>) -> io::Result<Writer> {
    let (frames, inbox) = bounded::<Vec<u8>>(1);
    let (results, written) = bounded(1);
    thread::Builder::new().name("writer".into()).spawn(move || {
        for frame in inbox {
            if tty.write(&frame).is_err() || results.send(Instant::now()).is_err() {
                break;
            }
        }
    })?;
    Ok(Writer { frames, written })
}
