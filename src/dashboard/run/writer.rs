//! Thread that writes frames to the terminal, so that a slow terminal does not block the dashboard.

use crossbeam_channel::{Receiver, Sender, bounded};
use std::io;
use std::sync::Arc;
use std::thread;
use std::time::Instant;
use zerkalo_terminal::Tty;

pub struct Writer {
    pub frames: Sender<Vec<u8>>,
    /// Time at which each frame was completely written, or the error.
    pub written: Receiver<io::Result<Instant>>,
}

pub fn start(tty: Arc<Tty>) -> io::Result<Writer> {
    let (frames, inbox) = bounded::<Vec<u8>>(1);
    let (results, written) = bounded(1);
    thread::Builder::new().name("writer".into()).spawn(move || {
        for frame in inbox {
            let result = tty.write(&frame).map(|()| Instant::now());
            if results.send(result).is_err() {
                break;
            }
        }
    })?;
    Ok(Writer { frames, written })
}
