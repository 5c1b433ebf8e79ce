//! Links in the terminal.

/// Returns the escape sequence OSC 8, which shows `text` as a link to `url`. Both must be free of
/// control characters.
pub fn hyperlink(url: &str, text: &str) -> String {
    format!("\x1b]8;;{url}\x1b\\{text}\x1b]8;;\x1b\\")
}
