//! Restoration of the terminal if the program ends without restoring it, as after SIGKILL, an abort
//! or SIGILL.
//!
//! A helper process, a shell that reads from a pipe, continues when the program ends and the pipe
//! closes. Signal handlers cannot replace it: SIGKILL has none, and the process ends as soon as the
//! handler of SIGABRT returns.

use crate::signals::{SIGNALLED, SignalQueue};
use crate::{LEAVE, screen};
use nix::unistd::{getpid, getsid};
use rustix::process::{Pid, Signal, kill_process};
use rustix::termios::tcgetattr;
use std::env;
use std::io::{self, Write};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, ChildStdin, Command, Stdio};

/// Script of the helper process. `$0` is [`LEAVE`], and `$1` the modes in the format of `stty -g`. A
/// line from the program ends the script. The modes are set only if output processing is still off
/// (`-opost`); otherwise the user's shell has already set its own modes. The script uses the
/// terminal of stdout: `/dev/tty` is gone if the program was the leader of its session.
const PROGRAM: &str = "\
trap '' INT QUIT TERM HUP TSTP TTIN TTOU
exec 3>&1
read -r _ && exit
case $(stty -a <&3) in *-opost*) stty \"$1\" <&3 ;; esac
printf %s \"$0\"";

/// Helper process, which waits until this value is dropped or the program ends.
pub struct Restorer {
    shell: Child,
    messages: ChildStdin,
}

impl Restorer {
    /// Starts the helper process, which would restore the present modes of the terminal at stdin.
    ///
    /// # Errors
    /// Fails if there is no shell or no `stty`.
    pub fn start() -> io::Result<Self> {
        let modes = Command::new("stty").arg("-g").stdin(Stdio::inherit()).output()?.stdout;
        let mut shell = Command::new("/bin/sh")
            .args(["-c", PROGRAM, LEAVE, String::from_utf8_lossy(&modes).trim_end()])
            .stdin(Stdio::piped())
            .stderr(Stdio::null())
            // Keys such as Ctrl-C and Ctrl-Z send no signals to other process groups.
            .process_group(0)
            .spawn()?;
        let messages = shell.stdin.take().ok_or(io::ErrorKind::BrokenPipe)?;
        Ok(Self { shell, messages })
    }
}

/// Runs the program again as a child process if this process leads its session, as in `ssh -t host
/// zerkalo`. sshd closes the terminal when the leader ends, before a `Restorer` can write. This
/// process passes signals on, restores the terminal if a signal ends the child, and returns the exit
/// status. Returns `None` if it does not lead a session on a terminal.
///
/// # Errors
/// Fails if the program cannot be run again.
pub fn supervised() -> io::Result<Option<u8>> {
    let modes = tcgetattr(io::stdin());
    let (Ok(modes), true) = (modes, getsid(None) == Ok(getpid())) else { return Ok(None) };
    let signals = SignalQueue::of_terminal()?;
    let mut child = Command::new(env::current_exe()?).args(env::args_os().skip(1)).spawn()?;
    let id = Pid::from_child(&child);
    signals.handle(move |status| {
        let signal = Signal::from_named_raw(i32::from(status) - SIGNALLED);
        let _ = signal.map(|signal| kill_process(id, signal));
    })?;
    let status = child.wait()?;
    let Some(signal) = status.signal() else { return Ok(status.code().map(|code| code as u8)) };
    let _ = screen::set_modes(&modes);
    let _ = io::stdout().write_all(LEAVE.as_bytes()).and_then(|()| io::stdout().flush());
    Ok(Some((SIGNALLED + signal) as u8))
}

impl Drop for Restorer {
    /// Ends the helper process; the terminal is restored already.
    fn drop(&mut self) {
        let _ = self.messages.write_all(b"\n");
        let _ = self.shell.try_wait();
    }
}
