//! Dashboard: the user interface in the terminal, for editing a scene while it is rendered.
//!
//! `update` handles a [`Message`](message::Message): it changes the [`Model`](model::Model) and
//! returns a list of [`Effect`](message::Effect)s. It has no access to clock, files or terminal, so
//! its result depends on its arguments only. `view` draws a model into a buffer of cells. `run` is
//! the event loop, which executes the effects.

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
pub mod text;
pub mod update;
pub mod view;
