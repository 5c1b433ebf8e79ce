//! Signals that end the program: the dashboard is told, and has a while to end by itself.

use super::terminal::Tty;
use crossbeam_channel::{Receiver, bounded};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use std::io;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

/// How long the dashboard may take to end after a signal.
const PATIENCE: Duration = Duration::from_secs(5);

/// What shells add to a signal's number to make an exit status.
const SIGNALLED: i32 = 128;

/// Receives the exit status that a signal asks for: 129, 130 or 143. If the program is still there a
/// while later, the terminal is restored and the program ended from here.
pub(super) fn watch(tty: Arc<Tty>) -> io::Result<Receiver<u8>> {
    let mut signals = Signals::new([SIGHUP, SIGINT, SIGTERM])?;
    let (sender, receiver) = bounded(1);
    thread::Builder::new().name("signals".into()).spawn(move || {
        if let Some(signal) = signals.forever().next() {
            let status = SIGNALLED + signal;
            let _ = sender.send(status as u8);
            thread::sleep(PATIENCE);
            tty.leave();
            std::process::exit(status);
        }
    })?;
    Ok(receiver)
}
