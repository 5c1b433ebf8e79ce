//! Owners of files: comparison with the user of this process, names of users.

use crate::disk::TEMPORARY;
use rustix::process::geteuid;
use std::fs::{self, Metadata};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Returns `true` if a file in `folder` with this metadata belongs to the user of this process. A
/// file also counts as theirs if it has the owner that a new file in `folder` gets: some file
/// systems, such as network mounts, give all files one owner.
pub fn is_own(metadata: &Metadata, folder: &Path) -> bool {
    let owner = metadata.uid();
    let owner_of_new_file = || {
        let [prefix, suffix] = TEMPORARY;
        let new =
            tempfile::Builder::new().prefix(prefix).suffix(suffix).tempfile_in(folder).ok()?;
        Some(new.as_file().metadata().ok()?.uid())
    };
    owner == geteuid().as_raw() || owner_of_new_file() == Some(owner)
}

/// Returns the name of the user with number `id` in `/etc/passwd`, or the number as text if it is
/// not found there.
pub fn user_name(id: u32) -> String {
    let users = fs::read_to_string("/etc/passwd").unwrap_or_default();
    name_in(&users, id).map_or_else(|| id.to_string(), String::from)
}

/// Finds the name of the user with number `id` in lines of the form `name:password:id:…`.
fn name_in(users: &str, id: u32) -> Option<&str> {
    users.lines().find_map(|line| {
        let mut fields = line.split(':');
        let name = fields.next()?;
        (fields.nth(1)?.parse() == Ok(id)).then_some(name)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn users_have_names_or_numbers() {
        let users = "root:x:0:0:root:/root:/bin/sh\nbad\nada:x:1001:1001::/home/ada:/bin/sh\n";
        assert_eq!(name_in(users, 1001), Some("ada"));
        assert_eq!(name_in(users, 1002), None);
        assert_eq!(user_name(u32::MAX - 7), (u32::MAX - 7).to_string());
    }
}
