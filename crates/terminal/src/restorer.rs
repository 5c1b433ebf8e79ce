//! Restoration of the terminal if the program ends without restoring it. Examples are SIGKILL, an
//! abort after a failed allocation in a library, and a processor exception such as SIGILL.
//!
//! The terminal is restored by a helper process, a shell that runs a script and reads from a pipe.
//! When the program ends, the pipe closes, and the script continues. Signal handlers of the program
//! cannot replace the helper process: SIGKILL has no handler, and after the handler of SIGABRT
//! returns, the process ends at once.

use crate::LEAVE;
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
    let (input, local) = (modes.input_modes, modes.local_modes);
    let is_set = [
        ("ignbrk", input.contains(InputModes::IGNBRK)),
        ("brkint", input.contains(InputModes::BRKINT)),
        ("parmrk", input.contains(InputModes::PARMRK)),
        ("istrip", input.contains(InputModes::ISTRIP)),
        ("inlcr", input.contains(InputModes::INLCR)),
        ("igncr", input.contains(InputModes::IGNCR)),
        ("icrnl", input.contains(InputModes::ICRNL)),
        ("ixon", input.contains(InputModes::IXON)),
        ("echo", local.contains(LocalModes::ECHO)),
        ("echonl", local.contains(LocalModes::ECHONL)),
        ("icanon", local.contains(LocalModes::ICANON)),
        ("isig", local.contains(LocalModes::ISIG)),
        ("iexten", local.contains(LocalModes::IEXTEN)),
        ("opost", modes.output_modes.contains(OutputModes::OPOST)),
    ];
    is_set.map(|(name, is_set)| format!("{}{name}", if is_set { "" } else { "-" })).to_vec()
}

impl Drop for Restorer {
    /// Ends the helper process, the shell that would restore the terminal if the program were
    /// killed. The terminal is restored already at this point.
    fn drop(&mut self) {
        let _ = self.messages.write_all(b"\n");
        let _ = self.shell.try_wait();
    }
}
