//! Bytes that a converging picture takes on a simulated connection, and the error of the screen.
//! Time is simulated.

mod connection;
mod figures;
mod picture;
