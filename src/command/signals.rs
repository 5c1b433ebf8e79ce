//! Handling of SIGINT and SIGTERM. After the first signal the program saves the picture so far and
//! ends. A second signal ends the program at once.

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Number that is added to the number of a signal to form the exit status, as in shells.
const SIGNALLED: i32 = 128;

/// Number of the last signal that was received (SIGINT or SIGTERM); 0 before the first one.
pub struct Signals(Arc<AtomicUsize>);

impl Signals {
    /// Installs the handlers of SIGINT and SIGTERM.
    pub fn watch() -> Result<Self, String> {
        Self::register().map_err(|error| format!("no signals: {error}"))
    }

    fn register() -> io::Result<Self> {
        let caught = Arc::new(AtomicUsize::new(0));
        let armed = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // Handlers run in the order of registration. The first handler sets `caught`; it is
            // registered first, so that no signal is lost during the registration. The second
            // handler ends the program if `armed` is set. The third handler sets `armed`. Because
            // it runs after the second one, the first signal does not end the program.
            flag::register_usize(signal, Arc::clone(&caught), signal as usize)?;
            flag::register_conditional_shutdown(signal, SIGNALLED + signal, Arc::clone(&armed))?;
            flag::register(signal, Arc::clone(&armed))?;
        }
        Ok(Self(caught))
    }

    /// Returns the exit status for the last signal: 130 (SIGINT) or 143 (SIGTERM). Returns `None`
    /// if no signal was received.
    pub fn caught(&self) -> Option<u8> {
        let signal = self.0.load(Ordering::Relaxed);
        (signal != 0).then(|| (SIGNALLED as usize + signal) as u8)
    }
}
