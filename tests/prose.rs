//! Check of prose: first words of doc comments, and words that the project avoids in comments,
//! pages, scenes and scripts.
//!
//! A doc comment begins with a noun, or with a verb in the third person. In place of the avoided
//! words, texts use the plain word of the field: programs report or print, terminals reply, rays
//! intersect primitives.

use crate::harness::*;

/// Words that begin a clause without a noun; a doc comment must not begin with one of them.
const FIRST_WORDS: &str = "What Who Whose Whom Of How Whether Where When Which";

/// Words and phrases that no text may contain.
const AVOIDED: &str =
    "told|tell|tells|thing|things|somebody|nobody|anybody|matt|is no mesh|in the mean";

/// Returns every file under `folder` that contains prose.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.is_dir() {
            // Results of measurements stay as they were.
            if !name.starts_with('.') && !["target", "runs", "bad-scenes"].contains(&name) {
                found.extend(files(&path));
            }
        } else if ["rs", "md", "toml", "sh"].iter().any(|e| path.extension() == Some(e.as_ref())) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Returns the text of a line that is a comment: `true` for a doc comment, `false` for a plain one.
/// Returns `None` for other lines.
fn comment(line: &str) -> Option<(bool, &str)> {
    let line = line.trim_start();
    let doc = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"));
    let text = doc.or_else(|| line.strip_prefix("//"))?;
    Some((doc.is_some(), text.trim()))
}

/// Returns the words of `text` outside of code in backticks, in lower case, each between spaces.
fn words(text: &str) -> String {
    let prose: String = text.split('`').step_by(2).collect::<Vec<_>>().join(" ").to_lowercase();
    let words = prose.split(|c: char| !c.is_alphanumeric() && c != '\'');
    words.fold(" ".to_string(), |line, word| line + word + " ")
}

/// Returns the faults of one text, each with its line number. Only the comments of Rust are read.
fn faults(text: &str, is_rust: bool) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut in_doc = false;
    for (number, line) in text.lines().enumerate() {
        let prose = if is_rust { comment(line) } else { Some((false, line)) };
        let Some((is_doc, text)) = prose else {
            in_doc = false;
            continue;
        };
        let first = text.split(|c: char| !c.is_alphabetic()).next().unwrap_or_default();
        if is_doc && !in_doc && FIRST_WORDS.split(' ').any(|word| word == first) {
            found.push((number + 1, format!("begins with `{first}`")));
        }
        if is_doc && text.starts_with("# Errors ") {
            found.push((number + 1, "has a sentence in its heading".to_string()));
        }
        // An empty line of a doc comment ends a paragraph, not the comment.
        in_doc = is_doc;
        let words = words(text);
        for avoided in AVOIDED.split('|').filter(|avoided| words.contains(&format!(" {avoided} ")))
        {
            found.push((number + 1, format!("has `{avoided}`")));
        }
    }
    found
}

#[test]
fn doc_comments_begin_with_a_noun_and_no_text_has_avoided_words() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut list = Vec::new();
    for path in files(root).into_iter().chain([root.join(".ci/run")]) {
        let name = path.strip_prefix(root).unwrap().display().to_string();
        for (line, fault) in faults(&fs::read_to_string(&path).unwrap(), name.ends_with(".rs")) {
            list.push(format!("{name}:{line}: {fault}"));
        }
    }
    assert!(list.is_empty(), "{} faults:\n{}", list.len(), list.join("\n"));
}

#[test]
fn faults_are_found_in_comments_only() {
    let text = "/// What is seen.\n/// # Errors Fails.\nfn told() {}\n//! Noun.\n// A thing; `told` is code.\n";
    let expected = [
        (1, "begins with `What`".to_string()),
        (2, "has a sentence in its heading".to_string()),
        (5, "has `thing`".to_string()),
    ];
    assert_eq!(faults(text, true), expected);
    assert_eq!(faults("It is no mesh.", false), [(1, "has `is no mesh`".to_string())]);
}
