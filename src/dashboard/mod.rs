//! The dashboard: edit the scene, watch it converge.
//!
//! Three parts that only meet in data. `update` decides: it turns a [`Message`](message::Message)
//! into a changed [`Model`](model::Model) and a list of [`Effect`](message::Effect)s, without clock,
//! file or terminal. `view` shows: it draws a model into a buffer of cells. `run` acts: terminal,
//! renderer, files, time.

pub mod action;
pub mod convergence;
pub mod editor;
pub mod hints;
pub mod input;
pub mod keymap;
pub mod layout;
pub mod message;
pub mod model;
pub mod overlay;
pub mod pacing;
pub mod panels;
pub mod places;
pub mod quality;
pub mod raster;
pub mod run;
#[cfg(test)]
mod testing;
pub mod update;
pub mod view;
