//! Signals: those that end the program, which the dashboard is told and has a while to do by itself,
//! and the one that tells of a new size.

use crate::dashboard::terminal::Tty;
use crossbeam_channel::{Receiver, bounded};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGWINCH};
use signal_hook::iterator::Signals;
use std::io;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

/// How long the dashboard may take to end after a signal.
const PATIENCE: Duration = Duration::from_secs(5);

/// What shells add to a signal's number to make an exit status.
const SIGNALLED: i32 = 128;

/// What signals say.
pub(super) struct Told {
    /// The exit status that a signal asks for: 129, 130 or 143.
    pub end: Receiver<u8>,
    /// The terminal may have another size.
    pub resized: Receiver<()>,
}

/// Listens to signals. If the program is still there a while after it should have ended, the terminal
/// is restored and the program ended from here.
pub(super) fn watch(tty: Arc<Tty>) -> io::Result<Told> {
    let mut signals = Signals::new([SIGHUP, SIGINT, SIGTERM, SIGWINCH])?;
    let (ender, end) = bounded(1);
    let (resizer, resized) = bounded(1);
    thread::Builder::new().name("signals".into()).spawn(move || {
        for signal in signals.forever() {
            if signal == SIGWINCH {
                // One that has not been heard yet says all.
                let _ = resizer.try_send(());
                continue;
            }
            let status = SIGNALLED + signal;
            let _ = ender.send(status as u8);
            thread::sleep(PATIENCE);
            tty.leave();
            std::process::exit(status);
        }
    })?;
    Ok(Told { end, resized })
}
