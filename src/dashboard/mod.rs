//! The dashboard: edit the scene, watch it converge.
//!
//! Parts that only meet in data. `update` decides: it turns a [`Message`](message::Message) into a
//! changed [`Model`](model::Model) and a list of [`Effect`](message::Effect)s, without clock, file or
//! terminal. `view` shows: it draws a model into a buffer of cells. `pacing` chooses which of them go
//! out now, within what `link` says that the line carries; `still` makes written pictures ready to
//! be looked at. `run` acts: renderer, files, time; and
//! `terminal` is what lies at the other end of the line.

pub mod convergence;
pub mod editor;
pub mod hints;
pub mod key_context;
pub mod layout;
pub mod message;
pub mod model;
pub mod noise_targets;
pub mod overlay;
pub mod overlay_layout;
pub mod panel_lines;
pub mod run;
#[cfg(test)]
mod testing;
pub mod update;
pub mod view;
