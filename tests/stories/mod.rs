//! Stories of the dashboard: a scene, user input, and the expected state, without terminal,
//! renderer or disk.

mod actions;
mod editing;
mod files;
mod mouse;
mod random;
mod recovery;
mod roughness;
mod simulated_dashboard;
mod table;
mod watch;
