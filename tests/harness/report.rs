//! Output for the table of extremes in docs/accuracy.md. A test prints its result once it has
//! passed, and `benches/accuracy.sh extremes` collects the output.

use super::*;

/// Prints `text` for a cell of the table of extremes: row `number`, and the column `single`,
/// `double`, `both`, `auto`, `about` or `criterion`.
pub fn report(number: usize, column: &str, text: &str) {
    println!("extreme {number:02} | {column} | {text}");
}

/// Returns the name of the column for the precision of `L` in the table of extremes: `single` or
/// `double`.
pub fn precision<L: SimdFloat>() -> &'static str {
    if L::EPSILON < 1e-10 { "double" } else { "single" }
}

/// Text of a cell in the table of extremes, for an extreme that single precision cannot represent.
/// A test in `precision.rs` checks that `auto` selects double precision for such a scene.
pub const LEFT_TO_DOUBLE: &str = "left to double";
