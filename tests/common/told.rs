//! Lines of the table of extremes in docs/accuracy.md, collected by `benches/accuracy.sh extremes`. A test
//! prints its result when it has passed.
#![allow(dead_code, reason = "each test file uses its part")]

use zerkalo::lanes::SimdFloat;

/// Prints `words` for the column `what` (`single`, `double`, `both`, `auto`, `about`, `criterion`) of the row `number`.
pub fn told(number: usize, what: &str, words: &str) {
    println!("extreme {number:02} | {what} | {words}");
}

/// `single` or `double`.
pub fn precision<L: SimdFloat>() -> &'static str {
    if L::EPSILON < 1e-10 { "double" } else { "single" }
}

/// Result in single precision of extremes that `auto` leaves to double precision, as `precision.rs` shows.
pub const LEFT: &str = "left to double";
