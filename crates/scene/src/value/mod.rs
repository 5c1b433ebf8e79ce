//! Values of scene files, and the tables of keys that describe them. Every description uses this
//! module, which depends on none of them.

mod angle;
mod color;
mod description;
mod direction;
mod field;
mod hash;
mod key_node;
mod number_range;
mod one_of;
mod order;
mod round;
mod suggest;
mod text;
mod toml_value;
mod validation;

pub use angle::sin_cos_degrees;
pub use color::{Color, linear_from_srgb, srgb_from_linear};
pub use description::{Description, FieldValue, FromWritten};
pub(crate) use description::{children, choices, description, doc_text, single_value};
pub use direction::unit;
pub use field::{Choice, DefaultValue, Field, Step, ValueType};
pub(crate) use field::{inserted, names};
pub use hash::{Fnv1a64, fnv1a64};
pub(crate) use key_node::PRESET;
pub use key_node::{KeyNode, KeyValue, node_at, node_at_mut};
pub use number_range::{NumberRange, number};
pub(crate) use one_of::{kinds, one_of};
pub use order::{ascending, from_total_order, sort_by_number, total_order};
pub use round::{floor_log10, rotated_y, round_fine, round_nice, round_significant, rounded_to};
pub use suggest::{did_you_mean, nearest};
pub(crate) use suggest::{nearest_file, translated};
pub use text::{sanitized, truncated};
pub(crate) use toml_value::{integer, read_value, written};
pub use validation::{ValidationError, Validator};
