//! The terminal as the dashboard needs it, and back: raw mode, alternate screen, mouse, paste.

use crossbeam_channel::{Receiver, Sender, bounded};
use rustix::termios::{OptionalActions, Termios, tcgetattr, tcgetwinsize, tcsetattr};
use std::io::{self, Write};
use std::panic;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread;
use std::time::{Duration, Instant};

/// Alternate screen, no cursor, pasted text in brackets, mouse buttons and drags (not every motion)
/// with coordinates that do not end at column 223; an empty screen.
pub const ENTER: &str = "\x1b[?1049h\x1b[?25l\x1b[?2004h\x1b[?1002h\x1b[?1006h\x1b[2J";

/// Shows what a frame may have held back, takes [`ENTER`] back, in the opposite order, and resets
/// colours and attributes.
pub const LEAVE: &str = "\x1b[?2026l\x1b[0m\x1b[?1006l\x1b[?1002l\x1b[?2004l\x1b[?25h\x1b[?1049l";

/// How long leaving waits for a frame that the terminal is slow to take.
const PATIENCE: Duration = Duration::from_secs(3);

/// The terminal while the dashboard has it. Dropped, it is as before; so it is after a panic, in
/// whichever thread.
pub struct Screen {
    tty: Arc<Tty>,
    left: Receiver<()>,
}

/// What the threads share that write to the terminal.
pub struct Tty {
    out: Mutex<Box<dyn Write + Send>>,
    entered: AtomicBool,
    /// The modes of stdin as they were.
    before: Option<Termios>,
    leaving: Sender<()>,
    /// What has to be sent before anything else when the terminal is given back.
    owed: Mutex<Vec<u8>>,
}

/// Columns and rows of the terminal that stdout leads to.
///
/// # Errors
/// If stdout is no terminal.
pub fn size() -> io::Result<[u16; 2]> {
    let size = tcgetwinsize(io::stdout())?;
    // Some lines do not tell a size: it is zero then.
    Ok(if size.ws_col == 0 || size.ws_row == 0 { [80, 24] } else { [size.ws_col, size.ws_row] })
}

/// Width and height of a cell in pixels, if the line tells.
pub fn cell_px() -> Option<[u16; 2]> {
    let size = tcgetwinsize(io::stdout()).ok()?;
    let cell = |px: u16, cells: u16| px.checked_div(cells).filter(|px| *px > 0);
    Some([cell(size.ws_xpixel, size.ws_col)?, cell(size.ws_ypixel, size.ws_row)?])
}

/// Sets the modes of stdin, also if signals come meanwhile.
fn set_modes(modes: &Termios, when: OptionalActions) -> io::Result<()> {
    loop {
        match tcsetattr(io::stdin(), when, modes) {
            Err(rustix::io::Errno::INTR) => {}
            done => return Ok(done?),
        }
    }
}

impl Screen {
    /// Takes the terminal that stdin comes from and stdout leads to.
    ///
    /// # Errors
    /// If stdin is no terminal or stdout cannot be written.
    pub fn enter() -> io::Result<Self> {
        let before = tcgetattr(io::stdin())?;
        let mut raw = before.clone();
        raw.make_raw();
        set_modes(&raw, OptionalActions::Now)?;
        // From here on `Drop` restores the terminal, even if entering fails half-way.
        Self::over(Box::new(io::stdout()), Some(before))
    }

    fn over(out: Box<dyn Write + Send>, before: Option<Termios>) -> io::Result<Self> {
        let (leaving, left) = bounded(1);
        let out = Mutex::new(out);
        let tty = Arc::new(Tty {
            out,
            entered: AtomicBool::new(true),
            before,
            leaving,
            owed: Mutex::default(),
        });
        let screen = Self { tty, left };
        let tty = Arc::clone(&screen.tty);
        let report = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            // First, so that the message is not lost with the alternate screen.
            tty.leave();
            report(panic);
        }));
        screen.tty.write(ENTER.as_bytes())?;
        Ok(screen)
    }

    /// Tells when the terminal was given back, because of a panic in some thread.
    pub fn left(&self) -> &Receiver<()> {
        &self.left
    }

    /// What writes to the terminal; for threads.
    pub fn tty(&self) -> Arc<Tty> {
        Arc::clone(&self.tty)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        self.tty.leave();
    }
}

impl Tty {
    /// Writes `bytes` in one go; not any more once the terminal was given back.
    pub fn write(&self, bytes: &[u8]) -> io::Result<()> {
        let mut out = self.out.lock().unwrap_or_else(PoisonError::into_inner);
        if self.entered.load(Ordering::Acquire) {
            out.write_all(bytes)?;
            out.flush()?;
        }
        Ok(())
    }

    /// From now on `bytes` are sent first when the terminal is given back.
    pub fn set_exit_sequence(&self, bytes: &[u8]) {
        let mut owed = self.owed.lock().unwrap_or_else(PoisonError::into_inner);
        owed.clear();
        owed.extend(bytes);
    }

    /// Gives the terminal back. The second time nothing happens.
    pub fn leave(&self) {
        if self.suspend() {
            let _ = self.leaving.try_send(());
        }
    }

    /// Gives the terminal back for a while; whether it had to be.
    pub fn suspend(&self) -> bool {
        if !self.entered.swap(false, Ordering::AcqRel) {
            return false;
        }
        // A terminal that has stopped reading shall not keep the program from ending.
        if let Some(mut out) = self.lock_within(PATIENCE) {
            let mut owed = self.owed.lock().unwrap_or_else(PoisonError::into_inner);
            let last = [&*owed, LEAVE.as_bytes()].concat();
            owed.clear();
            // If the terminal has gone there is nothing left to restore.
            let _ = out.write_all(&last).and_then(|()| out.flush());
        }
        if let Some(before) = &self.before {
            // What has come and was not read yet, such as late replies, is for nobody else.
            let _ = set_modes(before, OptionalActions::Flush);
        }
        true
    }

    /// Takes the terminal again, whatever others have done to it meanwhile.
    ///
    /// # Errors
    /// If it is gone.
    pub fn resume(&self) -> io::Result<()> {
        if let Some(before) = &self.before {
            let mut raw = before.clone();
            raw.make_raw();
            set_modes(&raw, OptionalActions::Now)?;
        }
        let mut out = self.out.lock().unwrap_or_else(PoisonError::into_inner);
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

    /// What was written, still readable when the writer has been given away.
    #[derive(Clone, Default)]
    struct Paper(Arc<Mutex<Vec<u8>>>);

    impl Paper {
        fn text(&self) -> String {
            String::from_utf8(self.0.lock().unwrap().clone()).unwrap()
        }
    }

    impl Write for Paper {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn what_is_entered_is_left_once() {
        let paper = Paper::default();
        let screen = Screen::over(Box::new(paper.clone()), None).unwrap();
        let tty = screen.tty();
        tty.write(b"frame").unwrap();
        drop(screen);
        tty.leave();
        tty.write(b"a frame that comes too late").unwrap();
        assert_eq!(paper.text(), format!("{ENTER}frame{LEAVE}"));
    }

    #[test]
    fn what_is_owed_comes_before_leaving_and_once() {
        let paper = Paper::default();
        let screen = Screen::over(Box::new(paper.clone()), None).unwrap();
        let tty = screen.tty();
        tty.set_exit_sequence(b"old");
        tty.set_exit_sequence(b"the picture goes");
        tty.suspend();
        tty.resume().unwrap();
        drop(screen);
        assert_eq!(paper.text(), format!("{ENTER}the picture goes{LEAVE}{ENTER}{LEAVE}"));
    }

    #[test]
    fn a_terminal_that_was_lent_is_taken_again() {
        let paper = Paper::default();
        let screen = Screen::over(Box::new(paper.clone()), None).unwrap();
        let tty = screen.tty();
        assert!(tty.suspend() && !tty.suspend());
        tty.write(b"a frame for nobody").unwrap();
        tty.resume().unwrap();
        tty.write(b"frame").unwrap();
        assert!(screen.left().try_recv().is_err());
        drop(screen);
        assert_eq!(paper.text(), format!("{ENTER}{LEAVE}{ENTER}frame{LEAVE}"));
    }

    #[test]
    fn every_mode_that_is_set_is_reset() {
        let modes = |text: &str, end: char| -> Vec<String> {
            let modes = text.split("\x1b[?").skip(1).filter_map(|mode| mode.split_once(end));
            modes.map(|(mode, _)| mode.to_string()).collect()
        };
        // The cursor is the one mode that is on outside.
        let mut set = modes(ENTER, 'h');
        set.retain(|mode| !mode.contains('l'));
        let mut reset = modes(LEAVE, 'l');
        // A frame sets and resets this one by itself, unless it is cut off.
        reset.retain(|mode| !mode.contains('h') && mode != "2026");
        reset.reverse();
        assert_eq!(set, ["1049", "2004", "1002", "1006"]);
        assert_eq!(set, reset);
        assert!(ENTER.contains("\x1b[?25l") && LEAVE.contains("\x1b[?25h"));
    }

    #[test]
    fn a_panic_in_any_thread_gives_the_terminal_back_and_says_so() {
        let paper = Paper::default();
        let screen = Screen::over(Box::new(paper.clone()), None).unwrap();
        assert!(screen.left().try_recv().is_err());
        thread::spawn(|| panic!("as the test wants it")).join().unwrap_err();
        screen.left().recv_timeout(Duration::from_secs(10)).expect("told that it was left");
        assert_eq!(paper.text(), format!("{ENTER}{LEAVE}"));
        drop(screen);
        assert_eq!(paper.text(), format!("{ENTER}{LEAVE}"));
    }

    #[test]
    fn a_terminal_that_does_not_read_does_not_hold_up_the_end() {
        let screen = Screen::over(Box::new(Paper::default()), None).unwrap();
        let tty = screen.tty();
        let _busy = tty.out.lock().unwrap();
        let begun = Instant::now();
        assert!(tty.lock_within(Duration::from_millis(20)).is_none());
        assert!(begun.elapsed() < PATIENCE);
    }
}
