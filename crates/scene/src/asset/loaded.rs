//! Lazily loaded content of an asset file that a scene description names.

use crate::asset::error::AssetError;
use crate::value::ValidationError;
use std::fmt;
use std::sync::Arc;

/// Result of reading an asset file; `None` if it was not read.
pub type Reading<T> = Option<Result<Arc<T>, AssetError>>;

/// Name and content of an asset file, or the error of reading it. `None` before it is read.
pub struct Loaded<T>(Option<(String, Result<Arc<T>, AssetError>)>);

impl<T> Clone for Loaded<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<T> Default for Loaded<T> {
    fn default() -> Self {
        Self(None)
    }
}

/// Comparison of contents or errors, not of names. Contents in the same allocation are equal.
impl<T: PartialEq> PartialEq for Loaded<T> {
    fn eq(&self, other: &Self) -> bool {
        match (&self.0, &other.0) {
            (Some((_, Ok(a))), Some((_, Ok(b)))) => Arc::ptr_eq(a, b) || a == b,
            (Some((_, Err(a))), Some((_, Err(b)))) => a == b,
            (None, None) => true,
            _ => false,
        }
    }
}

/// Output of the state of loading, without the content.
impl<T> fmt::Debug for Loaded<T> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match &self.0 {
            None => f.write_str("not loaded"),
            Some((_, Ok(_))) => f.write_str("loaded"),
            Some((_, Err(error))) => write!(f, "{error}"),
        }
    }
}

impl<T> Loaded<T> {
    /// Returns the content; `None` if the file has not been read or reading it failed.
    pub fn content(&self) -> Option<&Arc<T>> {
        self.0.as_ref()?.1.as_ref().ok()
    }

    /// Loads the file `name`, unless it was the last one to be loaded, even if that failed. An
    /// empty name means no file. If `load` returns `None`, no file is loaded.
    pub fn resolve(&mut self, name: &str, load: impl FnOnce(&str) -> Reading<T>) {
        if self.0.as_ref().map_or("", |(known, _)| known) != name {
            self.0 = None;
            if !name.is_empty() {
                self.0 = load(name).map(|result| (name.to_string(), result));
            }
        }
    }

    /// Returns the error of reading the file, as a validation error of the key `file`.
    pub fn fault(&self) -> Option<ValidationError> {
        let error = self.0.as_ref()?.1.as_ref().err()?;
        Some(ValidationError::new("file", error.what(), error.expected.clone()))
    }
}
