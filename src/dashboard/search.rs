//! Search in lists: which entries match the typed words, and in which order.

use crate::dashboard::PickEntry;

/// First words of actions that take others back. They come last unless they are typed.
const OPPOSITES: [&str; 4] = ["cancel", "close", "leave", "reset"];

/// Returns the words of `text` in lower case.
pub fn words(text: &str) -> Vec<String> {
    let words = text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_lowercase).collect()
}

/// Returns `true` if each of the words `wanted` is the beginning of a word of `text`.
pub fn has_words(text: &str, wanted: &str) -> bool {
    let own = words(text);
    words(wanted).iter().all(|word| own.iter().any(|own| own.starts_with(word)))
}

/// Returns the rank of `entry` among the matches of the words `wanted`, the smallest first. Returns
/// `None` if the entry does not match: each word must begin or be in a word of the name, or begin
/// one of the other words.
pub fn rank(wanted: &[String], entry: &PickEntry) -> Option<usize> {
    let name = words(&entry.name);
    let rank_of = |word: &String| {
        let begins = |own: &String| own.starts_with(word);
        match word {
            _ if name.first().is_some_and(begins) => Some(1),
            _ if name.iter().any(begins) => Some(2),
            _ if [&entry.also, &entry.note].iter().any(|text| has_words(text, word)) => Some(3),
            _ if name.iter().any(|own| own.contains(word)) => Some(8),
            _ => None,
        }
    };
    let mut rank = wanted.iter().map(rank_of).sum::<Option<usize>>()?;
    if wanted == name {
        rank = 0;
    }
    rank += if entry.comes_late { 3 } else { 0 };
    let first = name.first().map_or("", String::as_str);
    if OPPOSITES.contains(&first) && !wanted.iter().any(|word| first.starts_with(word)) {
        rank += 4;
    }
    Some(rank)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(name: &str, also: &str) -> PickEntry {
        let (name, also) = (name.to_string(), also.to_string());
        PickEntry { also, ..PickEntry::new(name, "") }
    }

    #[test]
    fn word_starts_precede_and_opposites_follow() {
        let write = entry("write a PNG", "export image");
        let cancel = entry("cancel the running export", "");
        let rank = |text: &str, entry| rank(&words(text), entry);
        let place = |text: &str, entry| rank(text, entry).unwrap_or(usize::MAX);
        let before = |text: &str| place(text, &write) < place(text, &cancel);
        assert!(before("export") && before("exp") && !before("running"));
        assert_eq!(rank("cancel", &cancel), Some(1));
        let rough = entry("roughness of mirror", "blur");
        assert_eq!(rank("roughness of mirror", &rough), Some(0));
        assert_eq!([rank("rough mir", &rough), rank("blur", &rough)], [Some(3), Some(3)]);
        assert!(rank("ness", &rough) > rank("blur", &rough));
        assert_eq!([rank("rgm", &rough), rank("zebra", &rough)], [None, None]);
        let ball = entry("gold cube", "");
        let kind = PickEntry { comes_late: true, ..entry("cube", "") };
        assert!(rank("cube", &ball) < rank("cube", &kind));
        assert!(has_words("color.r", "col r") && !has_words("color.r", "olor"));
    }
}
