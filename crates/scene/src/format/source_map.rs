//! Source map of a scene file: lines and columns of keys and values.

use crate::diagnostic::{Diagnostic, FirstDiagnostics};
use crate::format::parts::Part;
use crate::validate::{Problem, subject};
use std::collections::BTreeMap;
use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// Returns the line and the column \[characters\] of the byte offset `at`, both counted from 1.
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

/// Returns the byte range of the value at `path`, or of its nearest ancestor that is in `root`;
/// `0..0` if there is none.
fn span(root: &DeTable, path: &[String]) -> Range<usize> {
    let mut keys = path.iter();
    let Some(mut value) = keys.next().and_then(|key| root.get(key.as_str())) else { return 0..0 };
    for key in keys {
        let inner = match value.get_ref() {
            DeValue::Table(table) => table.get(key.as_str()),
            DeValue::Array(list) => key.parse().ok().and_then(|i: usize| list.get(i)),
            _ => None,
        };
        let Some(inner) = inner else { break };
        value = inner;
    }
    value.span()
}

/// Adds diagnostics for `problems` to `found`. The parts of the file with problems are parsed again
/// to locate them.
pub(crate) fn locate(
    text: &str,
    parts: &[Part],
    problems: Vec<Problem>,
    found: &mut FirstDiagnostics,
) {
    let part_of = |problem: &Problem| match problem.path.as_slice() {
        [list, index, ..] if list == "object" && parts.len() > 1 => {
            let index: usize = index.parse().unwrap_or(0);
            parts[1..].partition_point(|part| part.first_object <= index)
        }
        _ => 0,
    };
    let mut by_part: BTreeMap<usize, Vec<Problem>> = BTreeMap::new();
    for problem in problems {
        by_part.entry(part_of(&problem)).or_default().push(problem);
    }
    for (number, problems) in by_part {
        let part = &parts[number];
        let part_text = part.text(text);
        let (root, _) = DeTable::parse_recoverable(&part_text);
        for Problem { mut path, subject, found: finding, help } in problems {
            if let [list, index, ..] = path.as_mut_slice()
                && list == "object"
                && let Ok(number) = index.parse::<usize>()
            {
                *index = number.saturating_sub(part.first_object).to_string();
            }
            let at = part.in_file(span(root.get_ref(), &path).start);
            found.add(at, || Diagnostic { subject, found: finding, help, ..Diagnostic::default() });
        }
    }
}

/// Returns the name that diagnostics use for the table at `path`. `root` is a parsed part of the
/// file; the index of its first object is `first_object`.
pub(crate) fn subject_in(root: &DeTable, path: &[String], first_object: usize) -> String {
    subject(path, |list, index| {
        let index = if list == "object" { index.checked_sub(first_object)? } else { index };
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
