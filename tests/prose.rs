//! Check of the prose of comments: first words, and words that the project avoids.
//!
//! A doc comment begins with a noun, or with a verb in the third person. In place of the avoided
//! words, comments use the plain word of the field: programs report or print, terminals reply, rays
//! intersect primitives.

use crate::harness::*;

/// Words that begin a clause without a noun; a doc comment must not begin with one of them.
const FIRST_WORDS: &[&str] =
    &["What", "Who", "Whose", "Whom", "Of", "How", "Whether", "Where", "When", "Which"];

/// Words that no comment may contain.
const AVOIDED: &[&str] =
    &["told", "tell", "tells", "thing", "things", "somebody", "nobody", "anybody"];

/// Exceptions: avoided words that the comments of a file may contain, each given by file and word.
const EXCEPTIONS: &[(&str, &str)] = &[];

/// Returns every Rust file under `folder`.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// Returns the text of a line that is a comment: `true` for a doc comment, `false` for a plain one.
/// Returns `None` for other lines.
fn comment(line: &str) -> Option<(bool, &str)> {
    let line = line.trim_start();
    let doc = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"));
    let text = doc.or_else(|| line.strip_prefix("//"))?;
    Some((doc.is_some(), text.trim()))
}

/// Returns the words of `text` outside of code in backticks.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split('`')
        .step_by(2)
        .flat_map(|prose| prose.split(|c: char| !c.is_alphanumeric() && c != '\''))
}

/// Returns the faults of one source text, each with its line number.
fn faults(text: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut in_doc = false;
    for (number, line) in text.lines().enumerate() {
        let Some((is_doc, text)) = comment(line) else {
            in_doc = false;
            continue;
        };
        let first = text.split(|c: char| !c.is_alphabetic()).next().unwrap_or_default();
        if is_doc && !in_doc && FIRST_WORDS.contains(&first) {
            found.push((number + 1, format!("begins with `{first}`")));
        }
        // An empty line of a doc comment ends a paragraph, not the comment.
        in_doc = is_doc;
        for word in words(text) {
            if AVOIDED.contains(&word.to_lowercase().as_str()) {
                found.push((number + 1, format!("has the word `{word}`")));
            }
        }
    }
    found
}

#[test]
fn doc_comments_begin_with_a_noun_and_avoid_vague_words() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut list = Vec::new();
    for folder in ["src", "crates", "tests", "benches"] {
        for path in rust_files(&root.join(folder)) {
            let name = path.strip_prefix(root).unwrap().display().to_string();
            for (line, fault) in faults(&fs::read_to_string(&path).unwrap()) {
                if !EXCEPTIONS.iter().any(|(file, word)| name == *file && fault.contains(word)) {
                    list.push(format!("{name}:{line}: {fault}"));
                }
            }
        }
    }
    assert!(list.is_empty(), "{} faults:\n{}", list.len(), list.join("\n"));
}

#[test]
fn faults_are_found_in_comments_only() {
    let text = "/// What is seen.\n/// Where it is.\nfn told() {}\n//! Noun.\n// A thing; `told` is code.\n";
    let expected = [(1, "begins with `What`".to_string()), (5, "has the word `thing`".to_string())];
    assert_eq!(faults(text), expected);
}
