//! Textures and bumps: pictures against the reference tracer, the files of the shipped scenes,
//! rejected files.

mod cases;
mod files;
mod limits;
mod pictures;
