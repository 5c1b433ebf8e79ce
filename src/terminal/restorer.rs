//! Restoration of the terminal if the program ends without running its own restoration: an
//! allocation that fails in a library, SIGKILL, a fault of the processor.
//!
//! A helper process, a shell that runs a script, waits at the other end of a pipe, which closes
//! when the program ends. Signal handlers cannot replace it: after the handler of SIGABRT returns,
//! the process ends at once.

use crate::terminal::LEAVE;
use rustix::termios::{InputModes, LocalModes, OutputModes, Termios};
use std::io::{self, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, Command, Stdio};

/// Script of the helper process, a shell that restores the terminal if the program is killed. `$0`
/// is [`LEAVE`]; the other arguments are those of `stty`. When the program ends regularly, it sends
/// a line to the script, which then exits. Otherwise the script restores the terminal modes, but
/// only if output is still unprocessed (`-opost`), as in full-screen use. If it is processed, the
/// user's shell has set modes of its own.
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

/// Returns the arguments of POSIX `stty` that set the modes which raw mode changes to their values
/// in `modes`: `echo` for a mode that is set, `-echo` for one that is not.
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
