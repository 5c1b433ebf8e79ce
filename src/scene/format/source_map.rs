//! Source map: lines and columns of keys and values.

use crate::scene::diagnostic::Diagnostic;
use crate::scene::validate::{Problem, subject};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Returns line and column of the byte offset `at` in `text`, both from 1; columns count
/// characters.
pub(crate) fn line_column(text: &str, at: usize) -> (usize, usize) {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    let before = &text[..at];
    let line = before.rfind('\n').map_or(0, |newline| newline + 1);
    let visible = before[line..].trim_start_matches('\u{feff}');
    (before.matches('\n').count() + 1, visible.chars().count() + 1)
}

/// Returns the span of the value at `path`. If the file does not have this value, the span is that
/// of the nearest ancestor in the path.
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

/// Returns diagnostics for `problems` of the scene in `text`, which was parsed to `root`.
pub(crate) fn with_locations(
    file: &str,
    text: &str,
    root: &DeTable,
    problems: Vec<Problem>,
) -> Vec<Diagnostic> {
    let diagnostic = |problem: Problem| Diagnostic {
        file: file.to_string(),
        line_column: Some(line_column(text, span(root, &problem.path).start)),
        subject: problem.subject,
        found: problem.found,
        help: problem.help,
    };
    problems.into_iter().map(diagnostic).collect()
}

/// Returns the name that diagnostics use for the table at `path`: `object "queen"`.
pub(crate) fn subject_in(root: &DeTable, path: &[String]) -> String {
    subject(path, |list, index| {
        let entry = root.get(list)?.get_ref().as_array()?.get(index)?;
        entry.get_ref().as_table()?.get("name")?.get_ref().as_str().map(str::to_string)
    })
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
