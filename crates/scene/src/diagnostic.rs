//! Diagnostics: errors and warnings about a scene file, as users read them.

use crate::format::source_map::line_column;
use crate::value::{sanitized, sort_by_number};
use std::fmt;
use std::path::Path;

/// Error or warning about a scene file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostic {
    /// Name of the scene file as the user gave it.
    pub file: String,
    /// Line and column in characters, counted from 1; `None` for a diagnostic on the whole file.
    pub line_column: Option<(usize, usize)>,
    /// Table that the diagnostic is about, such as `object "queen"`; empty for the whole scene.
    pub subject: String,
    /// Phrase that states the error, such as `radius is -1`.
    pub found: String,
    /// Expected value and remedy, in sentences; may be empty.
    pub help: String,
    /// Line of the scene file above a line with a caret below the column; empty without a location.
    pub excerpt: String,
}

impl Diagnostic {
    /// Creates an error at a byte offset of `text`, the contents of the file `path`.
    pub fn at(path: &Path, text: &str, offset: usize, found: String, help: String) -> Self {
        let line_column = Some(line_column(text, offset));
        let file = path.display().to_string();
        Self { file, line_column, found, help, ..Self::default() }
    }
}

/// Largest indentation of the second line of a printed diagnostic [characters].
const MAX_INDENT: usize = 24;

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let mut head = sanitized(&self.file);
        if let Some((line, column)) = self.line_column {
            head += &format!(":{line}:{column}");
        }
        head += "  ";
        let indent = head.chars().count().min(MAX_INDENT);
        if !self.subject.is_empty() {
            head += &sanitized(&self.subject);
            head += ": ";
        }
        write!(f, "{head}{}.", sanitized(&self.found))?;
        if !self.help.is_empty() {
            write!(f, "\n{:indent$}{}", "", sanitized(&self.help))?;
        }
        Ok(())
    }
}

/// Largest number of errors of a scene file that are reported. Further ones are only counted.
pub(crate) const MAX_REPORTED: usize = 100;

/// Errors of one scene file: at least one, sorted by location.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneErrors {
    /// First diagnostics, at most 100, sorted by location.
    pub messages: Vec<Diagnostic>,
    /// Number of errors of the scene file that are not in `messages`.
    pub more: usize,
}

/// Collector of the first [`MAX_REPORTED`] diagnostics of a file; further ones are only counted.
#[derive(Default)]
pub(super) struct FirstDiagnostics {
    found: Vec<(usize, Diagnostic)>,
    /// Number of diagnostics that are not stored.
    pub more: usize,
    /// Byte offset above which diagnostics are only counted; `None` as long as all are stored.
    last: Option<usize>,
}

impl FirstDiagnostics {
    /// Adds a diagnostic at byte offset `at`. `make` returns it without file, line and column.
    pub fn add(&mut self, at: usize, make: impl FnOnce() -> Diagnostic) {
        if self.skips(at) {
            return;
        }
        self.found.push((at, make()));
        if self.found.len() >= 4 * MAX_REPORTED {
            self.keep_first();
        }
    }

    /// Returns `true` if a diagnostic at `at` is not to be stored; it is counted instead.
    pub fn skips(&mut self, at: usize) -> bool {
        let skips = self.last.is_some_and(|last| at > last);
        self.more += usize::from(skips);
        skips
    }

    fn keep_first(&mut self) {
        sort_by_number(&mut self.found, |(at, _)| *at as i64);
        self.more += self.found.len().saturating_sub(MAX_REPORTED);
        self.found.truncate(MAX_REPORTED);
        if self.found.len() == MAX_REPORTED {
            self.last = self.found.last().map(|(at, _)| *at);
        }
    }

    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// Returns the diagnostics, sorted, with file, line and column, without repetitions.
    pub fn located(mut self, file: &str, text: &str) -> SceneErrors {
        self.keep_first();
        let located = |(at, diagnostic): (usize, Diagnostic)| Diagnostic {
            file: file.to_string(),
            line_column: Some(line_column(text, at)),
            ..diagnostic
        };
        let mut messages: Vec<_> = self.found.into_iter().map(located).collect();
        messages.dedup();
        SceneErrors { messages, more: self.more }
    }
}

/// Largest number of characters of a line that an excerpt shows.
const EXCERPT: usize = 100;

/// Returns the text of line `number` and a caret below its `column`.
fn excerpt(line: &str, number: usize, column: usize) -> String {
    let skipped = column.saturating_sub(EXCERPT * 2 / 3);
    let visible = |c: char| if c.is_control() { ' ' } else { c };
    let shown: String = line.chars().skip(skipped).take(EXCERPT).map(visible).collect();
    let width = column - skipped;
    format!("{number:>5} | {}\n      | {:>width$}", sanitized(shown.trim_end()), "^")
}

/// Largest number of diagnostics that are printed at once.
const MAX_SHOWN: usize = 20;

impl SceneErrors {
    /// Creates the errors of a scene file that has one error, at the given location.
    pub(super) fn at(
        file: &str,
        line_column: Option<(usize, usize)>,
        found: String,
        help: &str,
    ) -> Self {
        let (file, help) = (file.to_string(), help.to_string());
        let message = Diagnostic { file, line_column, found, help, ..Diagnostic::default() };
        Self { messages: vec![message], more: 0 }
    }
}

impl SceneErrors {
    /// Adds the lines of `text`, the file, to the messages.
    pub(super) fn quoting(mut self, text: &str) -> Self {
        let text = text.trim_start_matches('\u{feff}');
        let mut lines = (1..).zip(text.lines()).peekable();
        for message in &mut self.messages {
            let Some((number, column)) = message.line_column else { continue };
            while lines.next_if(|(n, _)| *n < number).is_some() {}
            let line = lines.peek().filter(|(n, line)| *n == number && !line.trim().is_empty());
            message.excerpt = line.map_or(String::new(), |(n, line)| excerpt(line, *n, column));
        }
        self
    }

    /// Formats the errors, each followed by its line of the scene file with a caret.
    pub fn with_excerpts(&self) -> String {
        self.list(|message| match &*message.excerpt {
            "" => message.to_string(),
            excerpt => format!("{message}\n{excerpt}"),
        })
    }

    fn list(&self, shown: impl Fn(&Diagnostic) -> String) -> String {
        let first = self.messages.iter().take(MAX_SHOWN).map(shown).collect::<Vec<_>>().join("\n");
        match self.messages.len().saturating_sub(MAX_SHOWN) + self.more {
            0 => first,
            more => format!("{first}\n… and {more} more."),
        }
    }
}

impl fmt::Display for SceneErrors {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.list(ToString::to_string))
    }
}

impl std::error::Error for SceneErrors {}
