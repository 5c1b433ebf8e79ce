//! Restoration of the terminal after an end that runs no code of the program: an allocation that
//! fails in a library, SIGKILL, a fault of the processor.
//!
//! A shell waits at the other end of a pipe, which closes with the process. Signal handlers cannot
//! replace it: after the handler of SIGABRT returns, the process ends at once.

use crate::terminal::LEAVE;
use rustix::termios::{InputModes, LocalModes, OutputModes, Termios};
use std::io::{self, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, Command, Stdio};

/// Shell script that restores the terminal; `$0` is [`LEAVE`], the other arguments are those of
/// `stty`. At its regular end, this process sends a line to the script, which then exits. The
/// script restores modes only if they are still those of full-screen use, because the user's shell
/// may have set its own. In that case output is processed (`opost`).
const PROGRAM: &str = "\
trap '' INT QUIT TERM HUP TSTP TTIN TTOU
read -r _ && exit
case $(stty -a </dev/tty) in *-opost*) stty \"$@\" </dev/tty ;; esac
printf %s \"$0\" >/dev/tty";

/// Shell process that restores the terminal if this process ends without dropping the value.
pub struct Restorer {
    shell: Child,
    messages: ChildStdin,
}

impl Restorer {
    /// Starts the shell. It will restore `modes_before`.
    ///
    /// # Errors
    /// Fails if there is no shell.
    pub fn start(modes_before: &Termios) -> io::Result<Self> {
        let mut shell = Command::new("/bin/sh")
            .args(["-c", PROGRAM, LEAVE.as_str()])
            .args(stty_arguments(modes_before))
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            // A process group of its own: keys such as Ctrl-C and Ctrl-Z do not reach it.
            .process_group(0)
            .spawn()?;
        let messages = shell.stdin.take().ok_or(io::ErrorKind::BrokenPipe)?;
        Ok(Self { shell, messages })
    }
}

/// Returns the modes that raw mode changes, in the notation of POSIX `stty`.
fn stty_arguments(modes: &Termios) -> Vec<String> {
    let inputs = [
        ("ignbrk", InputModes::IGNBRK),
        ("brkint", InputModes::BRKINT),
        ("parmrk", InputModes::PARMRK),
        ("istrip", InputModes::ISTRIP),
        ("inlcr", InputModes::INLCR),
        ("igncr", InputModes::IGNCR),
        ("icrnl", InputModes::ICRNL),
        ("ixon", InputModes::IXON),
    ];
    let locals = [
        ("echo", LocalModes::ECHO),
        ("echonl", LocalModes::ECHONL),
        ("icanon", LocalModes::ICANON),
        ("isig", LocalModes::ISIG),
        ("iexten", LocalModes::IEXTEN),
    ];
    let is_set = inputs.map(|(name, mode)| (name, modes.input_modes.contains(mode)));
    let is_set = is_set
        .into_iter()
        .chain(locals.map(|(name, mode)| (name, modes.local_modes.contains(mode))));
    let output = ("opost", modes.output_modes.contains(OutputModes::OPOST));
    let argument = |(name, is_set): (&str, bool)| match is_set {
        true => name.to_string(),
        false => format!("-{name}"),
    };
    is_set.chain([output]).map(argument).collect()
}

impl Drop for Restorer {
    /// Ends the shell, because the terminal is restored already.
    fn drop(&mut self) {
        let _ = self.messages.write_all(b"\n");
        let _ = self.shell.try_wait();
    }
}
