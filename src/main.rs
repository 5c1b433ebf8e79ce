//! The command `zerkalo`.

use std::process::ExitCode;
use zerkalo::command;

fn main() -> ExitCode {
    command::require_cpu();
    command::main()
}
