//! What a converging picture costs on its way to the terminal, and how near to it the terminal is
//! meanwhile. The line is simulated: its time passes by counting.

mod figures;
mod line;
mod picture;
#[path = "../support/mod.rs"]
mod support;
