//! Tests on a simulated connection with simulated time: the bytes that a converging picture takes,
//! and the error of the screen.

mod blocks;
mod connection;
mod figures;
mod picture;
