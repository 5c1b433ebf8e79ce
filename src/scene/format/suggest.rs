//! Suggestions for mistyped words ("Did you mean"): the nearest known word.

/// Returns the word of `words` most similar to `given`. Returns `None` if `given` is unlikely to be
/// that word with typing errors.
pub(crate) fn nearest<'a>(
    given: &str,
    words: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    // A text of this length is far longer than any key, and is no typing error.
    if given.len() > 100 {
        return None;
    }
    let (distance, word) =
        words.into_iter().map(|w| (distance(given, w), w)).min_by_key(|(d, _)| *d)?;
    let length = word.chars().count().max(given.chars().count());
    (distance <= 1 + length / 4 && distance < length).then_some(word)
}

/// Returns the Damerau-Levenshtein distance (optimal string alignment) of `a` and `b`, ignoring
/// case: the smallest number of insertions, deletions, replacements and transpositions of adjacent
/// characters that turn `a` into `b`.
fn distance(a: &str, b: &str) -> usize {
    let [a, b]: [Vec<char>; 2] = [a, b].map(|s| s.to_lowercase().chars().collect());
    let mut rows = vec![vec![0; b.len() + 1]; a.len() + 1];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            rows[i][j] = if i == 0 || j == 0 {
                i + j
            } else {
                let replace = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
                let mut least = replace.min(rows[i - 1][j] + 1).min(rows[i][j - 1] + 1);
                if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                    least = least.min(rows[i - 2][j - 2] + 1);
                }
                least
            };
        }
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::{distance, nearest};

    #[test]
    fn edit_distances() {
        for (a, b, expected) in [
            ("", "", 0),
            ("", "abc", 3),
            ("raduis", "radius", 1),
            ("colour", "color", 1),
            ("Radius", "radius", 0),
            ("kitten", "sitting", 3),
        ] {
            assert_eq!(distance(a, b), expected, "{a} {b}");
            assert_eq!(distance(b, a), expected, "{b} {a}");
        }
    }

    #[test]
    fn suggestions_are_near_words() {
        let words = ["ebony", "ivory", "board"];
        assert_eq!(nearest("ivroy", words), Some("ivory"));
        assert_eq!(nearest("xylophone", words), None);
        assert_eq!(nearest("", words), None);
        assert_eq!(nearest(&"i".repeat(1 << 20), words), None);
        assert_eq!(nearest("x", [] as [&str; 0]), None);
    }
}
