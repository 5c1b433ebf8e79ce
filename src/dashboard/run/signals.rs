//! Signals: those that end the program, which the dashboard is told and has a while to do by itself,
//! and those that tell of a new size, or to stop and to go on.

use crate::terminal::Tty;
use crossbeam_channel::{Receiver, unbounded};
use rustix::process::{Signal, getpid, kill_current_process_group, kill_process};
use signal_hook::consts::{SIGCONT, SIGHUP, SIGINT, SIGTERM, SIGTSTP, SIGWINCH};
use signal_hook::iterator;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

/// How long the dashboard may take to end after a signal.
pub(super) const PATIENCE: Duration = Duration::from_secs(5);

/// What shells add to a signal's number to make an exit status.
const SIGNALLED: i32 = 128;

/// The exit status of a program whose terminal has gone: as if it had been told (SIGHUP).
pub(super) const HUNG_UP: u8 = (SIGNALLED + SIGHUP) as u8;

/// What a signal says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SignalEvent {
    /// End, with this exit status: 129, 130 or 143.
    End(u8),
    /// The terminal may have another size.
    Resized,
    /// Stop until told to go on.
    Stop,
    /// Go on.
    Continue,
}

/// What signals say.
pub(super) struct Signals {
    /// One after the other.
    pub told: Receiver<SignalEvent>,
    /// One of them says to end.
    ending: Arc<AtomicBool>,
}

impl Signals {
    /// Whether one of them says to end.
    pub fn is_ending(&self) -> bool {
        self.ending.load(Ordering::Acquire)
    }
}

/// Whom a stop concerns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StopTarget {
    /// This process.
    Itself,
    /// Everybody whom the shell has started together, as when its user presses Ctrl-Z.
    Group,
}

/// Signals that come from here on wait to be heeded: to be called before the terminal is taken, which a
/// signal that nobody waits for would not give back.
pub(super) fn block() -> io::Result<iterator::Signals> {
    iterator::Signals::new([SIGHUP, SIGINT, SIGTERM, SIGTSTP, SIGCONT, SIGWINCH])
}

/// Heeds signals. If the program is still there `patience` after it should have ended, the terminal is
/// restored and the program ended from here.
pub(super) fn watch(
    mut signals: iterator::Signals,
    tty: Arc<Tty>,
    patience: Duration,
) -> io::Result<Signals> {
    let (teller, told) = unbounded();
    let ending = Arc::new(AtomicBool::new(false));
    let mark = Arc::clone(&ending);
    thread::Builder::new().name("signals".into()).spawn(move || {
        for signal in signals.forever() {
            let what = match signal {
                SIGWINCH => SignalEvent::Resized,
                SIGTSTP => SignalEvent::Stop,
                SIGCONT => SignalEvent::Continue,
                _ => SignalEvent::End((SIGNALLED + signal) as u8),
            };
            // Nobody listens any more when the program ends.
            let _ = teller.send(what);
            mark.fetch_or(matches!(what, SignalEvent::End(_)), Ordering::Release);
            if let SignalEvent::End(status) = what {
                thread::sleep(patience);
                tty.leave();
                std::process::exit(status.into());
            }
        }
    })?;
    Ok(Signals { told, ending })
}

/// Stops until somebody says to go on; a moment may pass before it happens. It does not happen if there
/// is no shell that could say so: the kernel sees to that for every signal that stops but SIGSTOP. Of
/// those SIGTSTP is listened to here, so it is another one.
pub(super) fn stop(whom: StopTarget) -> io::Result<()> {
    match whom {
        StopTarget::Itself => kill_process(getpid(), Signal::TTIN)?,
        StopTarget::Group => kill_current_process_group(Signal::TTIN)?,
    }
    Ok(())
}
