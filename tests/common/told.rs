//! Lines for the table of extremes in docs/accuracy.md, which `benches/accuracy.sh extremes` collects.
//! A test tells what came out once it has passed.
#![allow(dead_code, reason = "each test file uses its part")]

use zerkalo::lanes::SimdFloat;

/// For the column `what` (`single`, `double`, `both`, `auto`, `about`, `criterion`) of an extreme's row.
pub fn told(number: usize, what: &str, words: &str) {
    println!("extreme {number:02} | {what} | {words}");
}

/// `single` or `double`.
pub fn precision<L: SimdFloat>() -> &'static str {
    if L::EPSILON < 1e-10 { "double" } else { "single" }
}

/// What extremes single precision is not asked to meet: `precision.rs` shows that `auto` leaves them to
/// double.
pub const LEFT: &str = "left to double";
