//! Suggestions for mistyped words ("Did you mean"): the nearest known word.

use crate::value::truncated;

/// Returns the word most similar to `given`, if typing errors may explain the difference.
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

/// Returns ` Did you mean "word"?` with the [`nearest`] word, or an empty string.
pub fn did_you_mean<'a>(given: &str, words: impl IntoIterator<Item = &'a str>) -> String {
    let word = nearest(given, words).map(truncated);
    word.map_or(String::new(), |word| format!(" Did you mean \"{word}\"?"))
}

/// Returns the optimal string alignment distance, ignoring case: insertions, deletions,
/// replacements and transpositions of adjacent characters.
fn distance(a: &str, b: &str) -> usize {
    strsim::osa_distance(&a.to_lowercase(), &b.to_lowercase())
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
