//! Clipboard on the user's machine.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// Returns the escape sequence OSC 52, which copies `text` to the clipboard if the terminal permits
/// it.
pub fn copied(text: &str) -> String {
    format!("\x1b]52;c;{}\x07", STANDARD.encode(text))
}

#[cfg(test)]
mod tests {
    use super::copied;

    #[test]
    fn copied_text_cannot_end_the_sequence() {
        assert_eq!(copied("\u{7}/ä?"), "\x1b]52;c;By/DpD8=\x07");
    }
}
