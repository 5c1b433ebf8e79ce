//! Tests of the program other than those of pictures: scene files, editing, sessions, the command
//! line, the dashboard, measurements, and the rules for the source.

mod command_line;
mod fuzz;
mod harness;
mod kills;
mod link;
mod live_session;
mod picture_files;
mod prose;
mod pty;
mod scene_editing;
mod scene_files;
mod slopes;
mod stories;
