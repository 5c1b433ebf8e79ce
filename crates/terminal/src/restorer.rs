//! Restoration of the terminal if the program ends without it, as after SIGKILL, an abort or
//! SIGILL.
//!
//! A helper process, a shell that reads from a pipe, continues when the program ends and the pipe
//! closes. Signal handlers cannot replace it: SIGKILL has none, and after that of SIGABRT returns,
//! the process ends at once.

use crate::LEAVE;
use rustix::termios::{InputModes, LocalModes, OutputModes, Termios};
use std::io::{self, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, Command, Stdio};

/// Script of the helper process. `$0` is [`LEAVE`]; the other arguments are those of `stty`. A line
/// from the program ends the script. The modes are set only if output processing is still off
/// (`-opost`); otherwise the user's shell has already set its own.
const PROGRAM: &str = "\
trap '' INT QUIT TERM HUP TSTP TTIN TTOU
read -r _ && exit
case $(stty -a </dev/tty) in *-opost*) stty \"$@\" </dev/tty ;; esac
printf %s \"$0\" >/dev/tty";

/// Helper process, which waits until this value is dropped or the program ends.
pub struct Restorer {
    shell: Child,
    messages: ChildStdin,
}

impl Restorer {
    /// Starts the helper process, which would restore `modes_before`.
    ///
    /// # Errors Fails if there is no shell.
    pub fn start(modes_before: &Termios) -> io::Result<Self> {
        let mut shell = Command::new("/bin/sh")
            .args(["-c", PROGRAM, LEAVE])
            .args(stty_arguments(modes_before))
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            // Keys such as Ctrl-C and Ctrl-Z send no signals to other process groups.
            .process_group(0)
            .spawn()?;
        let messages = shell.stdin.take().ok_or(io::ErrorKind::BrokenPipe)?;
        Ok(Self { shell, messages })
    }
}

/// Returns the arguments of POSIX `stty` for all modes that raw mode changes, such as `echo` or
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
    /// Ends the helper process; the terminal is restored already.
    fn drop(&mut self) {
        let _ = self.messages.write_all(b"\n");
        let _ = self.shell.try_wait();
    }
}
