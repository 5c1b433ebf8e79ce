//! From keys to lines and columns.

use crate::scene::diagnostic::Diagnostic;
use crate::scene::validate::Problem;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Line and column of the byte `at` of `text`, both from 1; columns count characters.
pub(crate) fn line_column(text: &str, at: usize) -> (usize, usize) {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    let before = &text[..at];
    let line = before.rfind('\n').map_or(0, |newline| newline + 1);
    let shown = before[line..].trim_start_matches('\u{feff}');
    (before.matches('\n').count() + 1, shown.chars().count() + 1)
}

/// The span of the value behind `path`, or of the nearest part of the path that is in the file.
fn span(root: &DeTable, path: &[String]) -> Range<usize> {
    let Some((first, rest)) = path.split_first() else { return 0..0 };
    match root.get(first.as_str()) {
        Some(value) => deepest_span(value, rest),
        None => 0..0,
    }
}

fn deepest_span(value: &Spanned<DeValue>, path: &[String]) -> Range<usize> {
    let inner = path.split_first().and_then(|(first, rest)| {
        let next = match value.get_ref() {
            DeValue::Table(table) => table.get(first.as_str()),
            DeValue::Array(list) => first.parse().ok().and_then(|i: usize| list.get(i)),
            _ => None,
        };
        next.map(|next| (next, rest))
    });
    match inner {
        Some((next, rest)) => deepest_span(next, rest),
        None => value.span(),
    }
}

/// Messages for `findings` about the scene in `text`, in the order of the file.
pub(crate) fn located(file: &str, text: &str, findings: Vec<Problem>) -> Vec<Diagnostic> {
    let root = DeTable::parse(text).ok();
    let mut messages: Vec<_> = findings
        .into_iter()
        .map(|finding| Diagnostic {
            file: file.to_string(),
            line_column: root
                .as_ref()
                .map(|r| line_column(text, span(r.get_ref(), &finding.path).start)),
            subject: finding.subject,
            found: finding.found,
            help: finding.help,
        })
        .collect();
    messages.sort_by_key(|m| m.line_column);
    messages
}

#[cfg(test)]
mod tests {
    use super::line_column;

    #[test]
    fn columns_count_characters_and_skip_a_byte_order_mark() {
        let text = "\u{feff}a = 1\nöäü = 2\n";
        assert_eq!(line_column(text, 3), (1, 1));
        assert_eq!(line_column(text, text.find('=').unwrap()), (1, 3));
        assert_eq!(line_column(text, text.rfind('=').unwrap()), (2, 5));
        assert_eq!(line_column(text, 1), (1, 1), "inside a character");
        assert_eq!(line_column(text, 10_000), (3, 1));
    }
}
