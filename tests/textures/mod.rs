//! Textures and bumps: pictures against a direct evaluation, the files of the shipped scenes,
//! rejected files.

mod cases;
mod direct;
mod files;
mod limits;
mod pictures;
