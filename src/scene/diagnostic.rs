//! Diagnostics: errors and warnings about a scene file, as users read them.

use crate::value::sanitized;
use std::fmt;

/// One error or warning about a scene file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// The file, as the user named it.
    pub file: String,
    /// Line and column, both counted from 1; the column counts characters. `None` if the diagnostic
    /// is about the whole file.
    pub line_column: Option<(usize, usize)>,
    /// Table that the diagnostic is about: `object "queen"`. Empty for the scene as a whole.
    pub subject: String,
    /// Finding, as a phrase.
    pub found: String,
    /// Remedy, in sentences; may be empty.
    pub help: String,
}

/// Largest indentation of the second line of a printed diagnostic [characters]. A shorter file name
/// and location indent the second line by their own width.
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

/// All errors of one scene file: at least one, sorted by location.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneErrors {
    messages: Vec<Diagnostic>,
}

/// Largest number of diagnostics that are printed at once.
const MAX_SHOWN: usize = 20;

impl SceneErrors {
    /// Creates the errors from `messages`, which must not be empty, and sorts them by location.
    pub(super) fn new(mut messages: Vec<Diagnostic>) -> Self {
        debug_assert!(!messages.is_empty(), "errors without a message");
        messages.sort_by_key(|m| m.line_column);
        messages.dedup();
        Self { messages }
    }

    /// Creates an error about the file as a whole.
    pub(super) fn of_file(file: &str, found: String, help: &str) -> Self {
        Self::at(file, None, found, help)
    }

    /// Creates an error about one location in the file.
    pub(super) fn at(
        file: &str,
        line_column: Option<(usize, usize)>,
        found: String,
        help: &str,
    ) -> Self {
        let (file, help) = (file.to_string(), help.to_string());
        Self {
            messages: vec![Diagnostic { file, line_column, subject: String::new(), found, help }],
        }
    }

    /// Returns the diagnostics, sorted by location.
    pub fn messages(&self) -> &[Diagnostic] {
        &self.messages
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
        match self.messages.len().saturating_sub(MAX_SHOWN) {
            0 => Ok(()),
            more => write!(f, "\n… and {more} more."),
        }
    }
}

impl std::error::Error for SceneErrors {}
