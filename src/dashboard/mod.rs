//! The dashboard: edit the scene, watch it converge.
//!
//! Three parts that only meet in data. [`update`] decides: it turns a [`Message`] into a changed
//! [`Model`] and a list of [`Effect`]s, without clock, file or terminal. [`view`] shows: it draws a
//! model into a buffer of cells. [`run`] acts: terminal, renderer, files, time.

pub mod action;
pub mod input;
pub mod keymap;
pub mod message;
pub mod model;
