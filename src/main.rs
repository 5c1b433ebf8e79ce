//! The command `zerkalo`.

use std::process::ExitCode;
use zerkalo::command;

fn main() -> ExitCode {
    let missing = command::missing_features();
    if missing.is_empty() {
        return command::main();
    }
    eprintln!(
        "zerkalo was built for a processor with {}, which this one lacks; build it here with \
         RUSTFLAGS=\"-C target-cpu=native\" cargo build --release",
        missing.join(", ")
    );
    ExitCode::FAILURE
}
