//! Dashboard: the user interface in the terminal, for editing a scene while it is rendered.
//!
//! `update` is a pure function: it turns a [`Message`](message::Message) into a changed
//! [`Model`](model::Model) and a list of [`Effect`](message::Effect)s, without access to clock,
//! files or terminal. `view` draws a model into a buffer of cells. `run` is the event loop: it
//! executes effects with the renderer, the files and the terminal.

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
