//! The clipboard of the terminal, which is where the user sits.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// What a terminal puts into its clipboard (OSC 52), if it allows that; `text` cannot get out of it.
pub(crate) fn copied(text: &str) -> String {
    format!("\x1b]52;c;{}\x07", STANDARD.encode(text))
}

#[cfg(test)]
mod tests {
    use super::copied;

    #[test]
    fn whatever_is_copied_stays_inside() {
        assert_eq!(copied("\u{7}/ä?"), "\x1b]52;c;By/DpD8=\x07");
    }
}
