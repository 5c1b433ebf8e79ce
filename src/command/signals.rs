//! Ctrl-C and SIGTERM: the first asks for the picture so far, the second ends the program at once.

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// What shells add to a signal's number to make an exit status.
const SIGNALLED: i32 = 128;

/// Watches for signals.
pub struct Signals(Arc<AtomicUsize>);

impl Signals {
    /// Starts watching.
    pub fn watch() -> io::Result<Self> {
        let caught = Arc::new(AtomicUsize::new(0));
        let armed = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // In this order, so that a signal meets the state that the ones before it left.
            flag::register_conditional_shutdown(signal, SIGNALLED + signal, Arc::clone(&armed))?;
            flag::register(signal, Arc::clone(&armed))?;
            flag::register_usize(signal, Arc::clone(&caught), signal as usize)?;
        }
        Ok(Self(caught))
    }

    /// The exit status that a caught signal asks for: 130 or 143.
    pub fn caught(&self) -> Option<u8> {
        let signal = self.0.load(Ordering::Relaxed);
        (signal != 0).then(|| (SIGNALLED as usize + signal) as u8)
    }
}
