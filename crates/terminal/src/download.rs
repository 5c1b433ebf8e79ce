//! Files that a terminal stores on the user's machine.

use crate::Capabilities;
use crate::image::Transfer;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// Terminals that store files, by the beginning of their names.
const TERMINALS: [&str; 2] = ["iTerm2", "WezTerm"];

/// Returns `true` if the terminal is known to store files.
pub fn stores_files(terminal: &Capabilities) -> bool {
    let version = terminal.version.as_deref().unwrap_or_default();
    let is_known = TERMINALS.iter().any(|name| version.starts_with(name));
    is_known && terminal.environment.multiplexer.is_none()
}

/// Returns the escape sequence of iTerm2 (OSC 1337) that stores a file.
pub fn file_transfer(name: &str, contents: &[u8]) -> Transfer {
    let (name, size) = (STANDARD.encode(name), contents.len());
    let contents = STANDARD.encode(contents);
    let mut transfer = Transfer { is_divisible: true, ..Transfer::default() };
    let sequence = format!("\x1b]1337;File=name={name};size={size};inline=0:{contents}\x07");
    transfer.add(sequence.as_bytes());
    transfer
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_is_one_sequence_that_can_be_cut() {
        let transfer = file_transfer("a;b.png", b"\x89PNG");
        let expected = "\x1b]1337;File=name=YTtiLnBuZw==;size=4;inline=0:iVBORw==\x07";
        assert_eq!(String::from_utf8(transfer.bytes.clone()).unwrap(), expected);
        assert_eq!(transfer.slice(0, 20), (0..20, true));
        let terminal = |version: &str| Capabilities {
            version: Some(version.to_string()),
            ..Capabilities::default()
        };
        assert!(stores_files(&terminal("iTerm2 3.5.4")) && !stores_files(&terminal("kitty(0.40)")));
    }
}
