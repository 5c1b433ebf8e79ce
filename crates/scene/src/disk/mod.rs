//! Files on disk: opening of regular files without blocking, replacement of files in one step, and
//! the rule for symbolic links that belong to other users.

mod open;
mod owner;
mod replace;
mod stamp;

pub(crate) use open::{open_at_once, open_regular_with};
pub use open::{open_regular, require_regular};
pub use owner::{is_own, user_name};
pub use replace::{
    Existing, Replacement, TEMPORARY, WriteError, check_writable, lock, replace_file, write,
};
pub use stamp::FileStamp;
