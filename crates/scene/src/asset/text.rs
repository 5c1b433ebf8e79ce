//! Text in asset files. The formats are older than UTF-8: their lines and names are bytes.

/// Lines of a text, each with its number, counted from 1. A line ends with LF, CRLF or CR. A byte
/// order mark at the beginning is skipped.
#[derive(Clone)]
pub struct Lines<'a> {
    /// Text after the lines so far.
    pub rest: &'a [u8],
    number: usize,
}

impl<'a> Lines<'a> {
    pub fn new(text: &'a [u8]) -> Self {
        Self { rest: text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text), number: 0 }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let is_end = |byte: &u8| matches!(byte, b'\n' | b'\r');
        let end = self.rest.iter().position(is_end).unwrap_or(self.rest.len());
        let (line, rest) = self.rest.split_at(end);
        let rest = rest.strip_prefix(b"\r\n").or(rest.get(1..));
        self.rest = rest.unwrap_or_default();
        self.number += 1;
        Some((self.number, line))
    }
}

fn is_blank(byte: &u8) -> bool {
    byte.is_ascii_whitespace() || *byte == 0x0B
}

/// Removes the first word of `text`, between blanks and ends of lines, and returns it.
pub fn take_word<'a>(text: &mut &'a [u8]) -> Option<&'a [u8]> {
    let begin = text.iter().position(|byte| !is_blank(byte))?;
    let length = text[begin..].iter().position(is_blank).unwrap_or(text.len() - begin);
    let (word, rest) = text[begin..].split_at(length);
    *text = rest;
    Some(word)
}

/// Returns the words of `text`.
pub fn words(mut text: &[u8]) -> impl Iterator<Item = &[u8]> {
    std::iter::from_fn(move || take_word(&mut text))
}

/// Returns the number that `word` is in the syntax of C. NaN and infinity have the names that C
/// libraries write: `-nan(ind)`, `1.#INF`.
pub fn number(word: &[u8]) -> Option<f64> {
    let word = std::str::from_utf8(word).ok()?;
    word.parse().ok().or_else(|| {
        let lower = word.to_ascii_lowercase();
        match lower.trim_start_matches(['+', '-']) {
            name if name.starts_with("1.#inf") => Some(f64::INFINITY),
            name if name.starts_with("nan") || name.starts_with("1.#") => Some(f64::NAN),
            _ => None,
        }
    })
}

/// Returns the first `N` words as numbers; `None` if there are fewer words or one is not a number.
pub fn numbers<'a, const N: usize>(words: impl Iterator<Item = &'a [u8]>) -> Option<[f64; N]> {
    words.take(N).map(number).collect::<Option<Vec<_>>>()?.try_into().ok()
}

/// Returns the beginning of a text, for messages.
pub fn shown(text: &[u8]) -> String {
    let beginning = String::from_utf8_lossy(&text[..text.len().min(1000)]);
    crate::value::truncated(&beginning)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_with_lf_crlf_or_cr() {
        let lines: Vec<_> = Lines::new(b"\xEF\xBB\xBFa\nb\r\n\rc\n\nd").collect();
        let expected: [(usize, &[u8]); 6] =
            [(1, b"a"), (2, b"b"), (3, b""), (4, b"c"), (5, b""), (6, b"d")];
        assert_eq!(lines, expected);
        assert!(Lines::new(b"").next().is_none());
    }

    #[test]
    fn numbers_have_the_syntax_of_c() {
        for (word, value) in [
            ("1", 1.0),
            ("+1.", 1.0),
            ("-.5", -0.5),
            ("1E+2", 100.0),
            ("1e-2", 0.01),
            ("inf", f64::INFINITY),
            ("-Infinity", f64::NEG_INFINITY),
            ("1.#INF00", f64::INFINITY),
            ("1e999", f64::INFINITY),
        ] {
            assert_eq!(number(word.as_bytes()), Some(value), "{word}");
        }
        for word in ["nan", "NaN", "-nan", "-nan(ind)", "nan(0x1)", "-1.#IND", "1.#QNAN0"] {
            assert!(number(word.as_bytes()).is_some_and(f64::is_nan), "{word}");
        }
        for word in ["", "x", "1x", "1,5", "--1", "\u{e9}"] {
            assert_eq!(number(word.as_bytes()), None, "{word}");
        }
        assert_eq!(numbers(words(b" 1\t2  x")), Some([1.0, 2.0]));
        assert_eq!(numbers::<3>(words(b"1 2")), None);
        assert_eq!(words(b"\x0Ba \tb\r\n c").collect::<Vec<_>>(), [b"a", b"b", b"c"]);
    }
}
