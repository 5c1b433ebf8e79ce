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

impl fmt::Display for SceneErrors {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for (i, message) in self.messages.iter().take(MAX_SHOWN).enumerate() {
            if i > 0 {
                f.write_str("\n")?;
            }
            message.fmt(f)?;
        }
        match self.messages.len().saturating_sub(MAX_SHOWN) + self.more {
            0 => Ok(()),
            more => write!(f, "\n… and {more} more."),
        }
    }
}

impl std::error::Error for SceneErrors {}
