//! Text measured in columns of the terminal: truncation, wrapping, and formats of numbers and
//! durations.

use std::borrow::Cow;
use unicode_width::{UnicodeWidthChar, UnicodeWidthStr};
use zerkalo_render::schedule::Interval;

pub fn columns(text: &str) -> usize {
    text.width()
}

/// Truncates `text` to `width` columns. The last column of truncated text is an ellipsis.
pub fn cut(text: &str, width: usize) -> Cow<'_, str> {
    if columns(text) <= width {
        return Cow::Borrowed(text);
    }
    let mut out = String::new();
    let mut used = 1;
    for c in text.chars() {
        used += c.width().unwrap_or(0);
        if used > width {
            break;
        }
        out.push(c);
    }
    if width > 0 {
        out.push('…');
    }
    Cow::Owned(out)
}

/// Returns `text` without its first `skipped` columns.
pub fn skip(text: &str, skipped: usize) -> &str {
    let mut used = 0;
    let start = text.char_indices().find(|(_, c)| {
        let reached = used >= skipped;
        used += c.width().unwrap_or(0);
        reached
    });
    start.map_or("", |(at, _)| &text[at..])
}

/// Returns the number of lines that `text` wraps to in `width` columns.
pub fn wrapped_rows(text: &str, width: u16) -> u16 {
    wrapped(text, width).len() as u16
}

/// Wraps `text` between words to lines of `width` columns. Words longer than a line are broken.
pub fn wrapped(text: &str, width: u16) -> Vec<String> {
    let width = usize::from(width.max(1));
    let mut lines = Vec::new();
    let mut line = String::new();
    let mut columns = 0;
    for word in text.split_whitespace() {
        if columns > 0 && columns + 1 + word.width() > width {
            lines.push(std::mem::take(&mut line));
            columns = 0;
        }
        if columns > 0 {
            line.push(' ');
            columns += 1;
        }
        for c in word.chars() {
            let added = c.width().unwrap_or(0);
            if columns > 0 && columns + added > width {
                lines.push(std::mem::take(&mut line));
                columns = 0;
            }
            line.push(c);
            columns += added;
        }
    }
    if !line.is_empty() || lines.is_empty() {
        lines.push(line);
    }
    lines
}

/// Formats `value` with about three significant digits, such as `1.50`, `21.3` or `1.20e6`.
pub fn number(value: f64) -> String {
    match value.abs() {
        v if v >= 9.995e5 || v < 5e-4 && v > 0.0 => format!("{value:.2e}"),
        v if v >= 99.95 => format!("{value:.0}"),
        v if v >= 9.995 => format!("{value:.1}"),
        v if v >= 0.0995 || v == 0.0 => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    }
}

/// Formats a duration, such as `0.4 s`, `35 s`, `12 min` or `3.5 h`.
pub fn duration(seconds: f64) -> String {
    let (value, unit) = in_unit(seconds, seconds);
    format!("{value} {unit}")
}

/// Formats a range of durations, such as `3–5 s`.
pub fn durations(Interval { low, high }: Interval) -> String {
    let ((from, _), (to, unit)) = (in_unit(low, high), in_unit(high, high));
    if from == to { format!("{to} {unit}") } else { format!("{from}–{to} {unit}") }
}

/// Converts `seconds` to a unit that suits a duration of `reference` seconds. Returns number and
/// unit.
fn in_unit(seconds: f64, reference: f64) -> (String, &'static str) {
    let (value, unit) = match reference {
        r if r < 99.5 => (seconds, "s"),
        r if r < 99.5 * 60.0 => (seconds / 60.0, "min"),
        r if r < 72.0 * 3600.0 => (seconds / 3600.0, "h"),
        _ => (seconds / 86_400.0, "days"),
    };
    let text = if value >= 9.95 || value == 0.0 {
        format!("{value:.0}")
    } else {
        format!("{value:.1}").trim_end_matches(".0").to_string()
    };
    (text, unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapping_keeps_words_whole() {
        assert_eq!(wrapped("one two three", 7), ["one two", "three"]);
        assert_eq!(wrapped("abcdefgh ij", 3), ["abc", "def", "gh", "ij"]);
        assert_eq!(wrapped("abcdef", 3), ["abc", "def", ""].map(String::from)[..2]);
        assert_eq!(wrapped("", 5), [""]);
        assert_eq!(wrapped("日本 日本語 ü", 5), ["日本", "日本", "語 ü"], "two columns each");
        assert!(wrapped("a\nb\tc", 1).iter().all(|line| line.chars().count() == 1));
    }

    #[test]
    fn truncation_counts_columns() {
        assert_eq!(cut("mirror", 6), "mirror");
        assert_eq!(cut("mirror", 5), "mirr…");
        assert_eq!(cut("鏡鏡鏡", 6), "鏡鏡鏡");
        // Wide characters are not split.
        assert_eq!(cut("鏡鏡鏡", 4), "鏡…");
        assert_eq!(cut("鏡鏡鏡", 5), "鏡鏡…");
        assert_eq!([cut("abc", 1), cut("abc", 0)], ["…", ""]);
        assert_eq!([skip("abc", 1), skip("鏡ab", 2), skip("ab", 9)], ["bc", "ab", ""]);
    }

    #[test]
    fn numbers_and_durations_are_formatted() {
        let numbers = [0.0, 0.012_34, 0.5, 1.0 / 3.0, 9.999, 12.34, 99.96, 1234.0, 3e6, 1e-5];
        let expected =
            ["0.00", "0.012", "0.50", "0.33", "10.0", "12.3", "100", "1234", "3.00e6", "1.00e-5"];
        assert_eq!(numbers.map(number), expected);
        let times = [0.0, 0.42, 3.04, 35.2, 99.6, 600.0, 5999.0, 9000.0, 1e6];
        let expected =
            ["0 s", "0.4 s", "3 s", "35 s", "1.7 min", "10 min", "1.7 h", "2.5 h", "12 days"];
        assert_eq!(times.map(duration), expected);
        let durations = |low, high| durations(Interval { low, high });
        assert_eq!([durations(3.0, 5.0), durations(20.0, 150.0)], ["3–5 s", "0.3–2.5 min"]);
        assert_eq!(durations(3.01, 3.02), "3 s");
    }
}
