//! Restoration of the terminal after an end that runs no code of the program: an allocation that
//! fails in a library, SIGKILL, a fault of the processor.
//!
//! A shell waits at the other end of a pipe, which closes with the process. Signal handlers cannot
//! replace it: after the handler of SIGABRT returns, the process ends at once.

use crate::terminal::LEAVE;
use std::io::{self, Read, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, Command, Stdio};

/// Program of the shell; its `$0` is [`LEAVE`]. It reads a line when the program has entered
/// full-screen use, and another one at its regular end. The modes are restored only if they are
/// still those of full-screen use, since the shell of the user may have restored its own.
const PROGRAM: &str = "\
trap '' INT QUIT TERM HUP TSTP TTIN TTOU
before=$(stty -g </dev/tty) || exit
echo
read -r _ || exit
raw=$(stty -g </dev/tty)
read -r _ && exit
[ \"$(stty -g </dev/tty)\" = \"$raw\" ] && stty \"$before\" </dev/tty
printf %s \"$0\" >/dev/tty";

/// Shell that restores the terminal if this process ends without dropping the value.
pub struct Restorer {
    shell: Child,
    messages: ChildStdin,
}

impl Restorer {
    /// Starts the shell and waits until it knows the present modes of the terminal.
    ///
    /// # Errors
    /// If there is no shell, or it has no terminal.
    pub fn start() -> io::Result<Self> {
        let mut shell = Command::new("/bin/sh")
            .args(["-c", PROGRAM, LEAVE.as_str()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            // A process group of its own: keys such as Ctrl-C and Ctrl-Z do not reach it.
            .process_group(0)
            .spawn()?;
        let ready = shell.stdout.take().map_or(Ok(0), |mut out| out.read(&mut [0]));
        match (ready, shell.stdin.take()) {
            (Ok(1), Some(messages)) => Ok(Self { shell, messages }),
            _ => {
                let _ = shell.wait();
                Err(io::ErrorKind::NotFound.into())
            }
        }
    }

    /// Reports that full-screen use has begun.
    pub fn entered(&mut self) {
        let _ = self.messages.write_all(b"\n");
    }
}

impl Drop for Restorer {
    /// Ends the shell: the terminal is restored already.
    fn drop(&mut self) {
        let _ = self.messages.write_all(b"\n\n");
        let _ = self.shell.wait();
    }
}
