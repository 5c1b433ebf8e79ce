//! The command `zerkalo`.
fn main() {}
