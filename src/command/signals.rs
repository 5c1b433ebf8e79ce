//! SIGINT and SIGTERM: the first signal saves the picture so far, the second ends the program at once.

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Offset from a signal's number to the exit status, as in shells.
const SIGNALLED: i32 = 128;

/// Number of the latest caught signal; 0 before the first.
pub struct Signals(Arc<AtomicUsize>);

impl Signals {
    /// Installs the handlers.
    pub fn watch() -> io::Result<Self> {
        let caught = Arc::new(AtomicUsize::new(0));
        let armed = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // In this order a signal sees the state that earlier signals left.
            flag::register_conditional_shutdown(signal, SIGNALLED + signal, Arc::clone(&armed))?;
            flag::register(signal, Arc::clone(&armed))?;
            flag::register_usize(signal, Arc::clone(&caught), signal as usize)?;
        }
        Ok(Self(caught))
    }

    /// Exit status of a caught signal: 130 or 143.
    pub fn caught(&self) -> Option<u8> {
        let signal = self.0.load(Ordering::Relaxed);
        (signal != 0).then(|| (SIGNALLED as usize + signal) as u8)
    }
}
