//! Cells of the table of extremes in docs/accuracy.md, which `benches/accuracy.sh extremes` collects
//! from the output of the tests. A test prints its result once it has passed.
#![allow(dead_code, reason = "each of the two test programs uses a part")]

use zerkalo::lanes::SimdFloat;

/// Prints `text` for row `number` of the table. `column` is `single`, `double`, `both`, `auto`, `about` or
/// `criterion`.
pub fn report(number: usize, column: &str, text: &str) {
    println!("extreme {number:02} | {column} | {text}");
}

/// Column of the precision of `L`: `single` or `double`.
pub fn precision<L: SimdFloat>() -> &'static str {
    if L::EPSILON < 1e-10 { "double" } else { "single" }
}

/// Cell of an extreme that single precision cannot hold. `precision.rs` checks that `auto` chooses double
/// for it.
pub const LEFT_TO_DOUBLE: &str = "left to double";
