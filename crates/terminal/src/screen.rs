//! Full-screen use of the terminal and its restoration.

use crate::restorer::Restorer;
use crossbeam_channel::{Receiver, Sender, bounded};
use crossterm::terminal;
use rustix::io::retry_on_intr;
use rustix::termios::{OptionalActions, QueueSelector, Termios, tcflush, tcgetattr, tcsetattr};
use std::io::{self, Write};
use std::panic;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread;
use std::time::{Duration, Instant};

/// Bytes that start full-screen use: alternate screen, hidden cursor, bracketed paste, mouse
/// reports with drags (mode 1002) and decimal coordinates (mode 1006), an empty screen.
pub const ENTER: &str = "\x1b[?1049h\x1b[?25l\x1b[?2004h\x1b[?1002h\x1b[?1006h\x1b[2J";

/// Bytes that restore the terminal. They end an incomplete synchronised update, reset colours and
/// attributes, and undo [`ENTER`].
pub const LEAVE: &str = "\x1b[?2026l\x1b[0m\x1b[?1006l\x1b[?1002l\x1b[?2004l\x1b[?25h\x1b[?1049l";

/// Longest wait for a terminal that is still reading a frame.
const PATIENCE: Duration = Duration::from_secs(3);

/// Full-screen use of the terminal, which is restored when this value is dropped or any thread
/// panics, and by a helper process if the process ends in another way.
pub struct Screen {
    pub tty: Arc<Tty>,
    /// Notification that [`Tty::leave`] has restored the terminal, for example after a panic.
    pub left: Receiver<()>,
    restorer: Option<Restorer>,
}

/// Writer to the terminal, shared between threads.
pub struct Tty {
    out: Mutex<Box<dyn Write + Send>>,
    entered: AtomicBool,
    /// Modes of stdin before [`Screen::enter`]; `None` in tests, which write to memory.
    modes_before: Option<Termios>,
    leaving: Sender<()>,
    /// Bytes that are sent before [`LEAVE`], such as the removal of an image.
    exit_sequence: Mutex<Vec<u8>>,
}

/// Returns the columns and rows of the terminal, or 80 and 24 if it does not report them.
///
/// # Errors
/// Fails if there is no terminal.
pub fn size() -> io::Result<[u16; 2]> {
    let size = terminal::window_size()?;
    let is_known = size.columns > 0 && size.rows > 0;
    Ok(if is_known { [size.columns, size.rows] } else { [80, 24] })
}

/// Returns the width and height of a cell in pixels, if the terminal reports them.
pub fn cell_px() -> Option<[u16; 2]> {
    let size = terminal::window_size().ok()?;
    let cell = |px: u16, cells: u16| px.checked_div(cells).filter(|px| *px > 0);
    Some([cell(size.width, size.columns)?, cell(size.height, size.rows)?])
}

pub(super) fn set_modes(modes: &Termios) -> io::Result<()> {
    let set = retry_on_intr(|| tcsetattr(io::stdin(), OptionalActions::Now, modes));
    set.map_err(io::Error::from)
}

fn set_raw_mode(modes_before: &Termios) -> io::Result<()> {
    let mut modes = modes_before.clone();
    modes.make_raw();
    set_modes(&modes)
}

impl Screen {
    /// Starts full-screen use of the terminal at stdin and stdout.
    ///
    /// # Errors
    /// Fails if stdin is no terminal or stdout cannot be written.
    pub fn enter() -> io::Result<Self> {
        let modes_before = tcgetattr(io::stdin())?;
        let restorer = Restorer::start().ok();
        set_raw_mode(&modes_before)?;
        // From here on `Drop` restores the terminal, even if `over` fails.
        let mut screen = Self::over(Box::new(io::stdout()), Some(modes_before))?;
        screen.restorer = restorer;
        Ok(screen)
    }

    /// Starts full-screen use through `out`, and restores the terminal before a panic is reported.
    fn over(out: Box<dyn Write + Send>, modes_before: Option<Termios>) -> io::Result<Self> {
        let (leaving, left) = bounded(1);
        let tty = Arc::new(Tty {
            out: Mutex::new(out),
            entered: AtomicBool::new(true),
            modes_before,
            leaving,
            exit_sequence: Mutex::default(),
        });
        let screen = Self { tty, left, restorer: None };
        let tty = Arc::clone(&screen.tty);
        let report = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            // The message would disappear with the alternate screen.
            tty.leave();
            report(panic);
        }));
        screen.tty.write(ENTER.as_bytes())?;
        Ok(screen)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        self.tty.leave();
    }
}

/// Locks `mutex`, even if a thread panicked with the lock: the terminal must be restored.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Tty {
    /// Writes `bytes` in one call. Does nothing outside full-screen use.
    ///
    /// # Errors
    /// Fails if the terminal is closed.
    pub fn write(&self, bytes: &[u8]) -> io::Result<()> {
        let mut out = locked(&self.out);
        if self.entered.load(Ordering::Acquire) {
            out.write_all(bytes)?;
            out.flush()?;
        }
        Ok(())
    }

    /// Sets the bytes that are sent before [`LEAVE`].
    pub fn set_exit_sequence(&self, bytes: &[u8]) {
        *locked(&self.exit_sequence) = bytes.to_vec();
    }

    /// Ends full-screen use.
    pub fn leave(&self) {
        if self.suspend() {
            let _ = self.leaving.try_send(());
        }
    }

    /// Suspends full-screen use until [`Tty::resume`]. Returns `false` if the terminal is restored
    /// already.
    pub fn suspend(&self) -> bool {
        self.suspend_after("", || false)
    }

    /// Suspends full-screen use as [`Tty::suspend`] does, and sends `request`. The modes are restored
    /// after `wait`, which returns `true` if the terminal has replied to all requests.
    pub fn suspend_after(&self, request: &str, wait: impl FnOnce() -> bool) -> bool {
        if !self.entered.swap(false, Ordering::AcqRel) {
            return false;
        }
        // If the terminal has stopped reading, another thread may hold the lock without limit.
        if let Some(mut out) = self.lock_within(PATIENCE) {
            let mut bytes = std::mem::take(&mut *locked(&self.exit_sequence));
            bytes.extend([request, LEAVE].concat().as_bytes());
            // A terminal that is gone needs no restoration.
            let _ = out.write_all(&bytes).and_then(|()| out.flush());
        }
        let has_replied = wait();
        if let Some(modes_before) = &self.modes_before {
            let _ = set_modes(modes_before);
            if !has_replied {
                // The shell would otherwise read late replies.
                let _ = tcflush(io::stdin(), QueueSelector::IFlush);
            }
        }
        true
    }

    /// Resumes full-screen use, even if other programs have changed the modes of the terminal.
    ///
    /// # Errors
    /// Fails if the terminal is closed.
    pub fn resume(&self) -> io::Result<()> {
        if let Some(modes_before) = &self.modes_before {
            set_raw_mode(modes_before)?;
        }
        let mut out = locked(&self.out);
        self.entered.store(true, Ordering::Release);
        out.write_all(ENTER.as_bytes())?;
        out.flush()
    }

    fn lock_within(&self, limit: Duration) -> Option<MutexGuard<'_, Box<dyn Write + Send>>> {
        let end = Instant::now() + limit;
        loop {
            match self.out.try_lock() {
                Ok(out) => return Some(out),
                Err(TryLockError::Poisoned(out)) => return Some(out.into_inner()),
                Err(TryLockError::WouldBlock) if Instant::now() >= end => return None,
                Err(TryLockError::WouldBlock) => thread::sleep(Duration::from_millis(5)),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writer whose clones share one buffer, so that a test can read the output of a screen.
    #[derive(Clone, Default)]
    struct SharedWriter(Arc<Mutex<Vec<u8>>>);

    impl SharedWriter {
        fn text(&self) -> String {
            String::from_utf8(self.0.lock().unwrap().clone()).unwrap()
        }
    }

    impl Write for SharedWriter {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// Returns a screen, its output, and a lock. The lock lets only one test at a time have a
    /// screen, because a panic in one test restores the screens of all tests.
    fn screen() -> (Screen, SharedWriter, MutexGuard<'static, ()>) {
        static TURN: Mutex<()> = Mutex::new(());
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let out = SharedWriter::default();
        (Screen::over(Box::new(out.clone()), None).unwrap(), out, turn)
    }

    /// Returns the expected output of a screen. Each character of `parts` stands for a part of the
    /// output: `[` for [`ENTER`], `]` for [`LEAVE`], any other character for itself.
    fn expected(parts: &str) -> String {
        parts.replace(']', "LEAVE").replace('[', ENTER).replace("LEAVE", LEAVE)
    }

    /// Checks `ENTER` and `LEAVE` against the commands of crossterm, which has no commands for the
    /// modes of paste and mouse without its event reader.
    #[test]
    fn enter_and_leave_consist_of_commands_of_crossterm() {
        use crossterm::cursor::{Hide, Show};
        use crossterm::queue;
        use crossterm::style::{Attribute, Print, SetAttribute};
        use crossterm::terminal::{
            Clear, ClearType, EndSynchronizedUpdate, EnterAlternateScreen, LeaveAlternateScreen,
        };
        let (mut enter, mut leave) = (Vec::new(), Vec::new());
        let input = Print("\x1b[?2004h\x1b[?1002h\x1b[?1006h");
        queue!(enter, EnterAlternateScreen, Hide, input, Clear(ClearType::All)).unwrap();
        assert_eq!(ENTER.as_bytes(), enter);
        queue!(leave, EndSynchronizedUpdate, SetAttribute(Attribute::Reset)).unwrap();
        let input = Print("\x1b[?1006l\x1b[?1002l\x1b[?2004l");
        queue!(leave, input, Show, LeaveAlternateScreen).unwrap();
        assert_eq!(LEAVE.as_bytes(), leave);
    }

    #[test]
    fn screen_is_left_once() {
        let (screen, out, _turn) = screen();
        let tty = screen.tty.clone();
        tty.write(b"frame").unwrap();
        drop(screen);
        tty.leave();
        tty.write(b"a frame that comes too late").unwrap();
        assert_eq!(out.text(), expected("[frame]"));
    }

    #[test]
    fn exit_sequence_is_sent_once_before_leaving() {
        let (screen, out, _turn) = screen();
        let tty = screen.tty.clone();
        tty.set_exit_sequence(b"old");
        tty.set_exit_sequence(b"the picture goes");
        tty.suspend();
        tty.resume().unwrap();
        drop(screen);
        assert_eq!(out.text(), expected("[the picture goes][]"));
    }

    #[test]
    fn suspended_screen_is_resumed() {
        let (screen, out, _turn) = screen();
        let tty = screen.tty.clone();
        assert!(tty.suspend() && !tty.suspend());
        tty.write(b"a frame while suspended").unwrap();
        tty.resume().unwrap();
        tty.write(b"frame").unwrap();
        assert!(screen.left.try_recv().is_err());
        drop(screen);
        assert_eq!(out.text(), expected("[][frame]"));
    }

    #[test]
    fn leave_resets_every_mode_of_enter() {
        let modes = |text: &str, end: char| -> Vec<String> {
            let modes = text.split("\x1b[?").skip(1).filter_map(|mode| mode.split_once(end));
            modes.map(|(mode, _)| mode.to_string()).collect()
        };
        // Visibility of the cursor is the only mode that `ENTER` resets and `LEAVE` sets. It is
        // left out here and checked below.
        let mut set = modes(ENTER, 'h');
        set.retain(|mode| !mode.contains('l'));
        let mut reset = modes(LEAVE, 'l');
        // Each frame sets and resets mode 2026 (synchronised update). `LEAVE` resets it too,
        // because the last frame may have been cut off.
        reset.retain(|mode| !mode.contains('h') && mode != "2026");
        reset.reverse();
        assert_eq!(set, ["1049", "2004", "1002", "1006"]);
        assert_eq!(set, reset);
        assert!(ENTER.contains("\x1b[?25l") && LEAVE.contains("\x1b[?25h"));
    }

    #[test]
    fn panic_in_any_thread_restores_the_terminal_and_is_reported() {
        let (screen, out, _turn) = screen();
        assert!(screen.left.try_recv().is_err());
        thread::spawn(|| panic!("as the test wants it")).join().unwrap_err();
        screen.left.recv_timeout(Duration::from_secs(10)).expect("a message about the panic");
        assert_eq!(out.text(), expected("[]"));
        drop(screen);
        assert_eq!(out.text(), expected("[]"));
    }

    #[test]
    fn terminal_that_does_not_read_does_not_delay_the_end() {
        let (screen, _, _turn) = screen();
        let tty = screen.tty.clone();
        let _busy = tty.out.lock().unwrap();
        let start = Instant::now();
        assert!(tty.lock_within(Duration::from_millis(20)).is_none());
        assert!(start.elapsed() < PATIENCE);
    }
}
