//! Pseudo-terminal that replies to only one request, that for the terminal's device attributes. It
//! can be closed like a lost connection, and several can run concurrently.

use crate::harness::*;
use portable_pty::{Child, CommandBuilder, MasterPty, PtySize, SlavePty, native_pty_system};
use std::io::{Read, Write};
use std::num::NonZeroU16;
use std::process::Command;
use std::sync::Condvar;
use std::thread::JoinHandle;

/// Longest time that a test waits. Only a failing test reaches it.
const PATIENCE: Duration = Duration::from_secs(60);

const SIZE: [u16; 2] = [60, 18];

/// Request to which every terminal replies, and a reply to it.
const REQUEST: (&[u8], &[u8]) = (b"\x1b[c", b"\x1b[?62;22c");

type Keyboard = Arc<Mutex<Option<Box<dyn Write + Send>>>>;

/// Program in its own pseudo-terminal.
pub struct Pty {
    master: Option<Box<dyn MasterPty + Send>>,
    /// Slave end of the pseudo-terminal, kept open so that its modes can be read after the
    /// program's end.
    slave: Option<Box<dyn SlavePty + Send>>,
    keyboard: Keyboard,
    child: Box<dyn Child + Send + Sync>,
    output: Arc<(Mutex<Vec<u8>>, Condvar)>,
    closing: Arc<AtomicBool>,
    reader: Option<JoinHandle<()>>,
    modes: String,
}

impl Pty {
    /// Starts the dashboard with `scene.toml` in `folder`.
    pub fn open(folder: &Path) -> Self {
        let [cols, rows] = SIZE;
        let size = PtySize { rows, cols, pixel_width: 0, pixel_height: 0 };
        let pair = native_pty_system().openpty(size).expect("a pseudo-terminal");
        let mut command = CommandBuilder::new(env!("CARGO_BIN_EXE_zerkalo"));
        command.args(["scene.toml", "--threads", "1"]);
        command.cwd(folder);
        for name in ["NO_COLOR", "SSH_CONNECTION", "TMUX", "STY", "COLORTERM"] {
            command.env_remove(name);
        }
        command.env("TERM", "xterm-256color");
        command.env("XDG_STATE_HOME", folder.join("state"));
        let modes = modes(&*pair.master);
        let child = pair.slave.spawn_command(command).expect("the program starts");
        let keyboard: Keyboard = Arc::new(Mutex::new(pair.master.take_writer().ok()));
        let mut from = pair.master.try_clone_reader().expect("a reader");
        let output = Arc::new((Mutex::new(Vec::new()), Condvar::new()));
        let closing = Arc::new(AtomicBool::new(false));
        let (shared, keys, ends) = (output.clone(), keyboard.clone(), closing.clone());
        let reader = std::thread::spawn(move || {
            let mut buffer = vec![0; 1 << 14];
            // Start of the output that may still contain a request.
            let mut unsearched = 0;
            loop {
                let read = from.read(&mut buffer).unwrap_or(0);
                if read == 0 || ends.load(Ordering::Acquire) {
                    break;
                }
                let mut bytes = shared.0.lock().unwrap();
                bytes.extend_from_slice(&buffer[..read]);
                shared.1.notify_all();
                while let Some(offset) = find(&bytes[unsearched..], REQUEST.0) {
                    unsearched += offset + REQUEST.0.len();
                    if let Some(keyboard) = &mut *keys.lock().unwrap() {
                        let _ = keyboard.write_all(REQUEST.1);
                    }
                }
                // The last bytes may be the beginning of a request.
                unsearched = unsearched.max((bytes.len() + 1).saturating_sub(REQUEST.0.len()));
            }
            shared.1.notify_all();
        });
        Self {
            master: Some(pair.master),
            slave: Some(pair.slave),
            keyboard,
            child,
            output,
            closing,
            reader: Some(reader),
            modes,
        }
    }

    /// Sends bytes of keys to the program.
    pub fn send(&mut self, keys: &[u8]) {
        if let Some(keyboard) = &mut *self.keyboard.lock().unwrap() {
            // The program may have ended.
            let _ = keyboard.write_all(keys).and_then(|()| keyboard.flush());
        }
    }

    /// Waits until `condition` is `true` for the output of the program.
    ///
    /// # Errors
    /// Fails after [`PATIENCE`]; the message contains `what`.
    pub fn wait_for(&self, what: &str, condition: impl Fn(&[u8]) -> bool) -> Result<(), String> {
        let end = Instant::now() + PATIENCE;
        let mut bytes = self.output.0.lock().unwrap();
        while !condition(&bytes) {
            let time_left = end.saturating_duration_since(Instant::now());
            if time_left.is_zero() {
                return Err(format!("no {what}; the screen:\n{}", screen(&bytes).contents()));
            }
            bytes = self.output.1.wait_timeout(bytes, time_left.min(PATIENCE / 60)).unwrap().0;
        }
        Ok(())
    }

    /// Waits until the screen contains `text`.
    pub fn wait_for_text(&self, text: &str) -> Result<(), String> {
        self.wait_for(&format!("{text:?}"), |bytes| screen(bytes).contents().contains(text))
    }

    pub fn signal(&self, name: &str) {
        let id = self.child.process_id().expect("a process").to_string();
        let sent = Command::new("kill").args([&format!("-{name}"), &id]).status();
        assert!(sent.is_ok_and(|status| status.success()), "no signal {name}");
    }

    /// Closes the master end of the terminal, as a lost connection does.
    pub fn hang_up(&mut self) {
        self.closing.store(true, Ordering::Release);
        // The key `?` opens the help. Its output wakes the reader thread, which then sees
        // `closing`.
        self.send(b"?");
        if let Some(reader) = self.reader.take() {
            reader.join().expect("the reader ends");
        }
        self.slave = None;
        self.keyboard.lock().unwrap().take();
        self.master = None;
    }

    /// Waits for the end of the program. Returns its exit status.
    pub fn end(&mut self) -> Result<u32, String> {
        let end = Instant::now() + PATIENCE;
        loop {
            match self.child.try_wait().map_err(|error| error.to_string())? {
                Some(status) => return Ok(status.exit_code()),
                None if Instant::now() > end => {
                    let _ = self.child.kill();
                    return Err("the program does not end".to_string());
                }
                None => std::thread::sleep(Duration::from_millis(3)),
            }
        }
    }

    /// Returns all output of the program, and `true` if the modes of the terminal equal those
    /// before the program's start.
    pub fn afterwards(mut self) -> (Vec<u8>, bool) {
        let restored = self.master.as_deref().is_some_and(|master| modes(master) == self.modes);
        // Closing the last slave end closes the terminal and the output.
        self.slave = None;
        if let Some(reader) = self.reader.take() {
            reader.join().expect("the reader ends");
        }
        let bytes = self.output.0.lock().unwrap().clone();
        (bytes, restored)
    }
}

/// Dropping the terminal ends the program of a failed test.
impl Drop for Pty {
    fn drop(&mut self) {
        let _ = self.child.kill();
    }
}

/// Returns the offset of `part` in `bytes`.
pub fn find(bytes: &[u8], part: &[u8]) -> Option<usize> {
    bytes.windows(part.len()).position(|window| window == part)
}

/// Returns the screen of a terminal after the output `bytes`.
pub fn screen(bytes: &[u8]) -> vt100::Screen {
    let [columns, rows] = SIZE.map(|n| NonZeroU16::new(n).expect("a size"));
    let mut parser = vt100::Parser::new(rows, columns, 0);
    parser.process(bytes);
    parser.screen().clone()
}

fn modes(master: &dyn MasterPty) -> String {
    format!("{:?}", master.get_termios())
}
