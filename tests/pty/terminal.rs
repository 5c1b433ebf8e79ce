//! A terminal for the program: a real pseudo-terminal, and an emulator that knows what it shows.
#![allow(dead_code, reason = "each guest uses its part")]

use portable_pty::{Child, CommandBuilder, MasterPty, PtySize, SlavePty, native_pty_system};
use std::io::{Read, Write};
use std::num::NonZeroU16;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Long enough for any machine; reached only on failure.
pub const PATIENCE: Duration = Duration::from_secs(120);

/// What has come from the program.
struct Output {
    parser: vt100::Parser,
    /// Every byte, in order.
    bytes: Vec<u8>,
    /// The program has closed the terminal.
    ended: bool,
}

/// One program at a time: each wants all processors.
static TURN: Mutex<()> = Mutex::new(());

/// What keys and answers are written to.
type Keyboard = Arc<Mutex<Box<dyn Write + Send>>>;

/// A question and its answer.
pub type Answer = (&'static [u8], &'static str);

/// Questions of programs, and the answers of a terminal with synchronised output.
const ANSWERS: [Answer; 3] =
    [(b"\x1b[c", "\x1b[?62;22c"), (b"\x1b[?2026$p", "\x1b[?2026;2$y"), (b"\x1b[6n", "")];

/// A program in its terminal.
pub struct Terminal {
    master: Box<dyn MasterPty + Send>,
    /// Kept open, so that the state of the terminal can be asked for after the program's end.
    slave: Option<Box<dyn SlavePty + Send>>,
    keyboard: Keyboard,
    /// Questions are answered.
    answering: Arc<AtomicBool>,
    child: Box<dyn Child + Send + Sync>,
    output: Arc<(Mutex<Output>, Condvar)>,
    before: String,
    _turn: MutexGuard<'static, ()>,
}

/// How a program is started.
pub struct Start<'a> {
    /// The program and its arguments.
    pub command: &'a [&'a str],
    /// Where.
    pub folder: &'a Path,
    /// Columns and rows.
    pub size: [u16; 2],
    /// Environment, beside that of the tests.
    pub env: &'a [(&'a str, &'a str)],
    /// The terminal answers questions.
    pub answers: bool,
}

impl Terminal {
    /// Starts a program in a terminal of true colour.
    pub fn start(start: &Start) -> Self {
        Self::start_with(start, &[])
    }

    /// The same for one that has other or more answers.
    pub fn start_with(start: &Start, also: &[Answer]) -> Self {
        let known = ANSWERS.iter().filter(|known| also.iter().all(|other| other.0 != known.0));
        let table: Vec<Answer> = known.chain(also).copied().collect();
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
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
        let answering = Arc::new(AtomicBool::new(start.answers));
        let (answers, willing) = (Arc::clone(&keyboard), Arc::clone(&answering));
        std::thread::spawn(move || {
            let mut buffer = vec![0; 1 << 16];
            let mut begun = Vec::new();
            loop {
                let read = reader.read(&mut buffer).unwrap_or(0);
                let asked = questions(&table, &mut begun, &buffer[..read]);
                let mut output = shared.0.lock().unwrap();
                output.ended = read == 0;
                output.parser.process(&buffer[..read]);
                output.bytes.extend_from_slice(&buffer[..read]);
                let (row, column) = output.parser.screen().cursor_position();
                shared.1.notify_all();
                drop(output);
                if willing.load(Ordering::Relaxed) {
                    let place = format!("\x1b[{};{}R", row + 1, column + 1);
                    let answer =
                        |text: &str| if text.is_empty() { place.clone() } else { text.into() };
                    let all: String = asked.into_iter().map(answer).collect();
                    // The program may have ended meanwhile.
                    let _ = answers.lock().unwrap().write_all(all.as_bytes());
                }
                if read == 0 {
                    break;
                }
            }
        });
        Self {
            keyboard,
            answering,
            master: pair.master,
            slave: Some(pair.slave),
            child,
            output,
            before,
            _turn: turn,
        }
    }

    /// Sends what the keyboard, the mouse or the clipboard would send.
    pub fn send(&mut self, keys: &str) {
        let mut keyboard = self.keyboard.lock().unwrap();
        keyboard.write_all(keys.as_bytes()).unwrap();
        keyboard.flush().unwrap();
    }

    /// From now on questions are answered, or not.
    pub fn answer(&self, answering: bool) {
        self.answering.store(answering, Ordering::Relaxed);
    }

    /// Waits until the screen is as `wanted`; on failure prints it and `what` was waited for.
    pub fn wait_for<R>(&self, what: &str, wanted: impl Fn(&vt100::Screen) -> Option<R>) -> R {
        let end = Instant::now() + PATIENCE;
        let (output, changed) = &*self.output;
        let mut output = output.lock().unwrap();
        loop {
            if let Some(found) = wanted(output.parser.screen()) {
                return found;
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() || output.ended {
                let screen = output.parser.screen().contents();
                drop(output);
                let why = if left.is_zero() { "in time" } else { "before the program ended" };
                panic!("{what}: not {why}. The screen:\n{screen}");
            }
            output = changed.wait_timeout(output, left).unwrap().0;
        }
    }

    /// Waits until `text` stands somewhere on the screen.
    pub fn wait_for_text(&self, text: &str) {
        self.wait_for(&format!("{text:?}"), |screen| {
            screen.contents().contains(text).then_some(())
        });
    }

    /// Waits until `text` stands nowhere on the screen.
    pub fn wait_until_gone(&self, text: &str) {
        self.wait_for(&format!("no {text:?}"), |screen| {
            (!screen.contents().contains(text)).then_some(())
        });
    }

    /// What the screen shows now.
    pub fn screen<R>(&self, look: impl FnOnce(&vt100::Screen) -> R) -> R {
        look(self.output.0.lock().unwrap().parser.screen())
    }

    /// Every byte that the program has sent so far.
    pub fn bytes(&self) -> Vec<u8> {
        self.output.0.lock().unwrap().bytes.clone()
    }

    /// Gives the terminal another size.
    pub fn resize(&self, size: [u16; 2]) {
        let [columns, rows] = size.map(|n| NonZeroU16::new(n).unwrap());
        self.output.0.lock().unwrap().parser.screen_mut().set_size(rows, columns);
        self.master.resize(pty_size(size)).unwrap();
    }

    /// The program's process.
    pub fn process_id(&self) -> u32 {
        self.child.process_id().expect("a process")
    }

    /// Waits for the end of the program: its exit status, and everything that it has sent. Then the
    /// terminal has to be as it was before.
    pub fn end(mut self) -> (u32, String) {
        let child = &mut self.child;
        let end = Instant::now() + PATIENCE;
        let status = loop {
            match child.try_wait().unwrap() {
                Some(status) => break status.exit_code(),
                None if Instant::now() > end => {
                    child.kill().unwrap();
                    let screen = self.screen(vt100::Screen::contents);
                    panic!("the program does not end. The screen:\n{screen}");
                }
                None => std::thread::sleep(Duration::from_millis(5)),
            }
        };
        assert_eq!(state(&*self.master), self.before, "the modes of the terminal");
        // With the last of its ends the terminal itself ends, and with it the output.
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

/// The answers that `bytes`, after what has `begun` before, ask for; what may be the beginning of
/// another question is remembered.
fn questions(table: &[Answer], begun: &mut Vec<u8>, bytes: &[u8]) -> Vec<&'static str> {
    begun.extend_from_slice(bytes);
    let mut answers = Vec::new();
    let mut read = 0;
    for at in 0..begun.len() {
        for (question, answer) in table {
            if begun[at..].starts_with(question) {
                answers.push(*answer);
                read = at + question.len();
            }
        }
    }
    let longest = table.iter().map(|(question, _)| question.len()).max().unwrap_or(0);
    begun.drain(..read.max(begun.len().saturating_sub(longest - 1)));
    answers
}

/// A test that fails leaves no program behind.
impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
    }
}

fn pty_size([cols, rows]: [u16; 2]) -> PtySize {
    PtySize { rows, cols, pixel_width: 0, pixel_height: 0 }
}

/// The modes of the terminal as text, to be compared.
fn state(master: &dyn MasterPty) -> String {
    format!("{:?}", master.get_termios().expect("the modes of a terminal"))
}
