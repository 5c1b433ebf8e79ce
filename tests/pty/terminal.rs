//! Test terminal: a pseudo-terminal, and an emulator of its screen.
#![allow(dead_code, reason = "the benches use it, too")]

use portable_pty::{Child, CommandBuilder, MasterPty, PtySize, SlavePty, native_pty_system};
use std::io::{Read, Write};
use std::num::NonZeroU16;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Longest time that a test waits. Only a failing test reaches it.
pub const PATIENCE: Duration = Duration::from_secs(120);

/// Output of the program to its terminal.
struct Output {
    parser: vt100::Parser,
    /// All bytes that the program has sent, in order.
    bytes: Vec<u8>,
    /// `true` if the program has closed the terminal.
    ended: bool,
}

/// Locks that let two programs run at a time: each uses all processors, but waits half of the time.
static TURNS: [Mutex<()>; 2] = [Mutex::new(()), Mutex::new(())];
/// Number of programs that have asked for a turn.
static ASKED: AtomicUsize = AtomicUsize::new(0);

/// Writer of keys and replies to the program.
type Keyboard = Arc<Mutex<Box<dyn Write + Send>>>;

pub type RequestReply = (&'static [u8], &'static str);

/// Requests, each with the reply of a terminal that supports synchronised updates.
pub const REPLIES: [RequestReply; 3] =
    [(b"\x1b[c", "\x1b[?62;22c"), (b"\x1b[?2026$p", "\x1b[?2026;2$y"), (b"\x1b[5n", "\x1b[0n")];

/// Program that runs in a test terminal.
pub struct Terminal {
    /// Master end, until the terminal hangs up.
    master: Option<Box<dyn MasterPty + Send>>,
    /// Slave end of the pseudo-terminal, kept open so that its modes can be read after the
    /// program's end.
    slave: Option<Box<dyn SlavePty + Send>>,
    keyboard: Option<Keyboard>,
    /// `true` if the terminal replies to requests.
    is_replying: Arc<AtomicBool>,
    /// `true` if the terminal is being closed.
    closing: Arc<AtomicBool>,
    reader: Option<JoinHandle<()>>,
    child: Box<dyn Child + Send + Sync>,
    output: Arc<(Mutex<Output>, Condvar)>,
    before: String,
    _turn: Option<MutexGuard<'static, ()>>,
}

/// Parameters with which a program is started in a test terminal.
pub struct Start<'a> {
    /// Program and its arguments.
    pub command: &'a [&'a str],
    /// Working directory of the program.
    pub folder: &'a Path,
    /// Columns and rows of the terminal.
    pub size: [u16; 2],
    /// Additional environment variables: name and value of each.
    pub env: &'a [(&'a str, &'a str)],
    /// `true` if the terminal replies to requests.
    pub replies: bool,
}

impl Terminal {
    /// Starts a program in a terminal with 24-bit colours.
    pub fn start(start: &Start) -> Self {
        Self::start_with(start, &[])
    }

    /// Starts a program in a terminal with `additional` replies, which override the default ones.
    pub fn start_with(start: &Start, additional: &[RequestReply]) -> Self {
        let defaults = REPLIES
            .iter()
            .filter(|(request, _)| additional.iter().all(|other| other.0 != *request));
        let table: Vec<RequestReply> = defaults.chain(additional).copied().collect();
        let turn = &TURNS[ASKED.fetch_add(1, Ordering::Relaxed) % TURNS.len()];
        let turn = turn.lock().unwrap_or_else(PoisonError::into_inner);
        Self::open(start, table, Some(turn))
    }

    /// Starts a program in a terminal that has only the replies in `table`. Without `turn`, other
    /// programs may run at the same time.
    pub fn open(
        start: &Start,
        table: Vec<RequestReply>,
        turn: Option<MutexGuard<'static, ()>>,
    ) -> Self {
        let pair = native_pty_system().openpty(pty_size(start.size)).expect("a pseudo-terminal");
        let mut command = CommandBuilder::new(start.command[0]);
        command.args(&start.command[1..]);
        command.cwd(start.folder);
        for name in ["NO_COLOR", "SSH_CONNECTION", "TMUX"] {
            command.env_remove(name);
        }
        command.env("TERM", "xterm-256color");
        command.env("COLORTERM", "truecolor");
        command.env("XDG_STATE_HOME", start.folder.join("state"));
        for (name, value) in start.env {
            command.env(name, value);
        }
        let before = state(&*pair.master);
        let child = pair.slave.spawn_command(command).expect("the program starts");
        let [columns, rows] = start.size.map(|n| NonZeroU16::new(n).unwrap());
        let parser = vt100::Parser::new(rows, columns, 0);
        let output = Output { parser, bytes: Vec::new(), ended: false };
        let output = Arc::new((Mutex::new(output), Condvar::new()));
        let mut reader = pair.master.try_clone_reader().unwrap();
        let shared = Arc::clone(&output);
        let keyboard: Keyboard = Arc::new(Mutex::new(pair.master.take_writer().unwrap()));
        let is_replying = Arc::new(AtomicBool::new(start.replies));
        let closing = Arc::new(AtomicBool::new(false));
        let (replies, enabled) = (Arc::clone(&keyboard), Arc::clone(&is_replying));
        let is_closing = Arc::clone(&closing);
        let reader = std::thread::spawn(move || {
            let mut buffer = vec![0; 1 << 16];
            let mut unread = Vec::new();
            loop {
                let read = reader.read(&mut buffer).unwrap_or(0);
                let requested = replies_to(&table, &mut unread, &buffer[..read]);
                let mut output = shared.0.lock().unwrap();
                output.ended = read == 0;
                output.parser.process(&buffer[..read]);
                output.bytes.extend_from_slice(&buffer[..read]);
                shared.1.notify_all();
                drop(output);
                if enabled.load(Ordering::Relaxed) {
                    let all = requested.concat();
                    // The program may have ended meanwhile.
                    let _ = replies.lock().unwrap().write_all(all.as_bytes());
                }
                if read == 0 || is_closing.load(Ordering::Acquire) {
                    break;
                }
            }
        });
        Self {
            keyboard: Some(keyboard),
            is_replying,
            closing,
            reader: Some(reader),
            master: Some(pair.master),
            slave: Some(pair.slave),
            child,
            output,
            before,
            _turn: turn,
        }
    }

    /// Sends input to the program, as the keyboard, the mouse or the clipboard do.
    pub fn send(&mut self, keys: &str) {
        let mut keyboard = self.keyboard.as_ref().expect("a keyboard").lock().unwrap();
        // The program may have ended.
        let _ = keyboard.write_all(keys.as_bytes()).and_then(|()| keyboard.flush());
    }

    /// Closes the master end, as a lost connection does.
    pub fn hang_up(&mut self) {
        self.closing.store(true, Ordering::Release);
        // The key `?` opens the help. Its output wakes the reader thread, which then ends.
        self.send("?");
        self.reader.take().expect("a reader").join().expect("the reader ends");
        (self.slave, self.keyboard, self.master) = (None, None, None);
    }

    /// Enables or disables the terminal's replies to requests.
    pub fn set_replying(&self, is_replying: bool) {
        self.is_replying.store(is_replying, Ordering::Relaxed);
    }

    /// Waits until `condition` returns a value for the screen. On failure, panics with `what` and
    /// the screen.
    pub fn wait_for<R>(&self, what: &str, condition: impl Fn(&vt100::Screen) -> Option<R>) -> R {
        self.wait(what, |output| condition(output.parser.screen()))
    }

    /// Waits until the program has sent more than `count` bytes.
    pub fn wait_for_bytes(&self, count: usize) {
        self.wait("output", |output| (output.bytes.len() > count).then_some(()));
    }

    fn wait<R>(&self, what: &str, condition: impl Fn(&Output) -> Option<R>) -> R {
        let end = Instant::now() + PATIENCE;
        let (output, changed) = &*self.output;
        let mut output = output.lock().unwrap();
        loop {
            if let Some(value) = condition(&output) {
                return value;
            }
            let time_left = end.saturating_duration_since(Instant::now());
            if time_left.is_zero() || output.ended {
                let screen = output.parser.screen().contents();
                drop(output);
                let why = if time_left.is_zero() { "in time" } else { "before the program ended" };
                panic!("{what}: not {why}. The screen:\n{screen}");
            }
            output = changed.wait_timeout(output, time_left).unwrap().0;
        }
    }

    /// Waits until the screen contains `text`.
    pub fn wait_for_text(&self, text: &str) {
        self.wait_for(&format!("{text:?}"), |screen| {
            screen.contents().contains(text).then_some(())
        });
    }

    /// Waits until the screen does not contain `text`.
    pub fn wait_until_gone(&self, text: &str) {
        self.wait_for(&format!("no {text:?}"), |screen| {
            (!screen.contents().contains(text)).then_some(())
        });
    }

    pub fn screen<R>(&self, look: impl FnOnce(&vt100::Screen) -> R) -> R {
        look(self.output.0.lock().unwrap().parser.screen())
    }

    /// Returns all bytes that the program has sent so far.
    pub fn bytes(&self) -> Vec<u8> {
        self.output.0.lock().unwrap().bytes.clone()
    }

    pub fn resize(&self, size: [u16; 2]) {
        let [columns, rows] = size.map(|n| NonZeroU16::new(n).unwrap());
        self.output.0.lock().unwrap().parser.screen_mut().set_size(rows, columns);
        self.master.as_ref().expect("a master end").resize(pty_size(size)).unwrap();
    }

    /// Returns the process number of the program. Its dashboard is a child process with the same
    /// executable if the program leads the session.
    pub fn process_id(&self) -> u32 {
        let leader = self.child.process_id().expect("a process");
        let children = std::fs::read_to_string(format!("/proc/{leader}/task/{leader}/children"));
        let children = children.unwrap_or_default();
        let executable = |id: u32| std::fs::read_link(format!("/proc/{id}/exe")).ok();
        let mut children = children.split_whitespace().filter_map(|id| id.parse().ok());
        children.find(|id| executable(*id) == executable(leader)).unwrap_or(leader)
    }

    /// Waits for the end of the program. Returns its exit status.
    pub fn status(&mut self) -> u32 {
        let child = &mut self.child;
        let end = Instant::now() + PATIENCE;
        loop {
            match child.try_wait().unwrap() {
                Some(status) => return status.exit_code(),
                None if Instant::now() > end => {
                    child.kill().unwrap();
                    let screen = self.screen(vt100::Screen::contents);
                    panic!("the program does not end. The screen:\n{screen}");
                }
                None => std::thread::sleep(Duration::from_millis(5)),
            }
        }
    }

    /// Waits for the end of the program and checks that the terminal is restored. Returns the exit
    /// status and all output.
    pub fn end(mut self) -> (u32, String) {
        let status = self.status();
        let master = self.master.as_deref().expect("a master end");
        assert_eq!(state(master), self.before, "the modes of the terminal");
        // Closing the last slave end closes the terminal and the output.
        let Self { slave, output, .. } = &mut self;
        drop(slave.take());
        let (output, changed) = &**output;
        let output = changed.wait_while(output.lock().unwrap(), |output| !output.ended).unwrap();
        let screen = output.parser.screen();
        let all = String::from_utf8_lossy(&output.bytes).into_owned();
        assert!(!screen.alternate_screen(), "the alternate screen is left");
        assert!(!screen.hide_cursor(), "the cursor is shown");
        assert!(!screen.bracketed_paste(), "pasted text is plain again");
        assert_eq!(screen.mouse_protocol_mode(), vt100::MouseProtocolMode::None);
        assert_eq!(screen.mouse_protocol_encoding(), vt100::MouseProtocolEncoding::Default);
        assert_eq!(
            (screen.fgcolor(), screen.bgcolor(), screen.bold(), screen.inverse()),
            (vt100::Color::Default, vt100::Color::Default, false, false)
        );
        (status, all)
    }
}

/// Returns the replies that `table` lists for the requests in `unread` and `bytes`. An incomplete
/// request at the end of `bytes` is kept in `unread`.
fn replies_to(table: &[RequestReply], unread: &mut Vec<u8>, bytes: &[u8]) -> Vec<&'static str> {
    unread.extend_from_slice(bytes);
    let mut replies = Vec::new();
    let mut read = 0;
    for start in 0..unread.len() {
        for (request, reply) in table {
            if unread[start..].starts_with(request) {
                replies.push(*reply);
                read = start + request.len();
            }
        }
    }
    let longest = table.iter().map(|(request, _)| request.len()).max().unwrap_or(0);
    unread.drain(..read.max(unread.len().saturating_sub(longest - 1)));
    replies
}

/// Dropping the terminal ends the program of a failed test.
impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
    }
}

fn pty_size([cols, rows]: [u16; 2]) -> PtySize {
    PtySize { rows, cols, pixel_width: 0, pixel_height: 0 }
}

/// Returns the modes of the pseudo-terminal as text, for comparison.
fn state(master: &dyn MasterPty) -> String {
    format!("{:?}", master.get_termios().expect("the modes of a terminal"))
}
