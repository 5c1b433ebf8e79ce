//! Restoration of the terminal if the program ends without restoring it. Examples are SIGKILL, an
//! abort after a failed allocation in a library, and a processor exception such as SIGILL.
//!
//! The terminal is restored by a helper process, a shell that runs a script and reads from a pipe.
//! When the program ends, the pipe closes, and the script continues. Signal handlers of the program
//! cannot replace the helper process: SIGKILL has no handler, and after the handler of SIGABRT
//! returns, the process ends at once.

use crate::terminal::LEAVE;
use rustix::termios::{InputModes, LocalModes, OutputModes, Termios};
use std::io::{self, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, Command, Stdio};

/// Script of the helper process, a shell that restores the terminal if the program is killed. `$0`
/// is [`LEAVE`]; the other arguments are those of `stty`. When the program ends normally, it sends
/// a line to the script, which then exits. Otherwise the script restores the terminal. It sets the
/// terminal modes only if output processing is still off (`-opost`), as in full-screen use. If
/// output processing is on, the user's shell has already set its own modes.
const PROGRAM: &str = "\
trap '' INT QUIT TERM HUP TSTP TTIN TTOU
read -r _ && exit
case $(stty -a </dev/tty) in *-opost*) stty \"$@\" </dev/tty ;; esac
printf %s \"$0\" >/dev/tty";

/// Helper process that restores the terminal if the program is killed. It is a shell that waits
/// until this value is dropped or the program ends.
pub struct Restorer {
    shell: Child,
    messages: ChildStdin,
}

impl Restorer {
    /// Starts the helper process, a shell that sets the terminal modes `modes_before` if the
    /// program is killed.
    ///
    /// # Errors
    /// Fails if there is no shell.
    pub fn start(modes_before: &Termios) -> io::Result<Self> {
        let mut shell = Command::new("/bin/sh")
            .args(["-c", PROGRAM, LEAVE])
            .args(stty_arguments(modes_before))
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            // The helper process has a process group of its own, so that keys such as Ctrl-C and
            // Ctrl-Z do not send it signals.
            .process_group(0)
            .spawn()?;
        let messages = shell.stdin.take().ok_or(io::ErrorKind::BrokenPipe)?;
        Ok(Self { shell, messages })
    }
}

/// Returns the arguments with which POSIX `stty` restores all modes that raw mode changes. Each
/// mode is set to its value in `modes`: the argument is `echo` if `echo` is set there, otherwise
/// `-echo`.
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
    /// Ends the helper process, the shell that would restore the terminal if the program were
    /// killed. The terminal is restored already at this point.
    fn drop(&mut self) {
        let _ = self.messages.write_all(b"\n");
        let _ = self.shell.try_wait();
    }
}
