//! The world: a scene compiled for one lane type, holding only what this scene requires, and the
//! paths traced in it.

mod brightness;
mod clearance;
mod compile;
mod contact;
mod groups;
mod guide;
mod inventory;
mod light_buffer;
mod light_chart;
mod limits;
mod media;
mod on_surface;
mod outlook;
mod path;
mod precision;
mod screen;
mod serving;
mod skin;
mod through;

pub use compile::{AnyWorld, Options, Precision, World};
pub use groups::{Groups, MAX_GROUPS, Member};
pub use guide::Sight;
pub use inventory::Inventory;
pub use outlook::Outlook;
pub use path::{Counts, Radiance};
