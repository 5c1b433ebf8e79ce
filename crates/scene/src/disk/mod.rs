//! Files on disk: opening of regular files without blocking, replacement of files in one step,
//! claims of files that a process continues, and the rule for symbolic links of other users.

mod claim;
mod open;
mod owner;
mod replace;
mod stamp;

pub use claim::Claim;
pub(crate) use open::{open_at_once, open_regular_with};
pub use open::{open_regular, require_regular};
pub use owner::{is_own, user_name};
pub use replace::{
    Existing, Replacement, TEMPORARY, WriteError, check_writable, lock, remove_stale, replace_file,
    write,
};
pub use stamp::FileStamp;
