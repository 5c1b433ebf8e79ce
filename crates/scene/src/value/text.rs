//! Sanitising of untrusted text for output on a terminal.

/// Escapes the characters that could control a terminal or hide other text as `\n` or `\u{..}`.
pub fn sanitized(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_control() || controls_terminal(c) {
            out.extend(c.escape_default());
        } else {
            out.push(c);
        }
    }
    out
}

/// Returns `true` for format characters (category Cf) and line separators, which reorder or hide
/// text.
fn controls_terminal(c: char) -> bool {
    matches!(c,
        '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
        | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}'
        | '\u{e0000}'..='\u{e007f}')
}

/// Returns the first 40 characters of `text`, sanitised. An ellipsis follows if there are more.
pub fn truncated(text: &str) -> String {
    let mut remaining = text.char_indices().skip(40);
    match remaining.next() {
        Some((end, _)) => sanitized(&text[..end]) + "…",
        None => sanitized(text),
    }
}

#[cfg(test)]
mod tests {
    use super::{sanitized, truncated};

    #[test]
    fn sanitized_escapes_control_characters() {
        assert_eq!(
            sanitized("a\x1b[31mé\u{9b}\u{202e}\n\u{7f}"),
            "a\\u{1b}[31mé\\u{9b}\\u{202e}\\n\\u{7f}"
        );
        assert_eq!(sanitized("Ölkanne \"x\" 鏡"), "Ölkanne \"x\" 鏡");
    }

    #[test]
    fn truncated_keeps_40_characters() {
        assert_eq!(truncated("short"), "short");
        assert_eq!(truncated(&"ä".repeat(100)).chars().count(), 41);
    }
}
