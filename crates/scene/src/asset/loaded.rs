//! Lazily loaded content of an asset file that a scene description names.

use crate::asset::error::AssetError;
use crate::value::ValidationError;
use std::fmt;
use std::sync::Arc;

/// Content of an asset file, or the error of reading it. `None` before the first attempt to read
/// it.
pub struct Loaded<T>(Option<Result<Arc<T>, AssetError>>);

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

/// Two values are equal if neither is loaded, or if both have equal contents or equal errors.
/// Contents in the same allocation are equal without a comparison of their data.
impl<T: PartialEq> PartialEq for Loaded<T> {
    fn eq(&self, other: &Self) -> bool {
        match (&self.0, &other.0) {
            (Some(Ok(a)), Some(Ok(b))) => Arc::ptr_eq(a, b) || a == b,
            (Some(Err(a)), Some(Err(b))) => a == b,
            (None, None) => true,
            _ => false,
        }
    }
}

/// Formats the state of loading: `not loaded`, `loaded`, or the error. The content is omitted.
impl<T> fmt::Debug for Loaded<T> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match &self.0 {
            None => f.write_str("not loaded"),
            Some(Ok(_)) => f.write_str("loaded"),
            Some(Err(error)) => write!(f, "{error}"),
        }
    }
}

impl<T> Loaded<T> {
    /// Returns the content of the file. Returns `None` if the file has not been read yet, or if
    /// reading it failed.
    pub fn content(&self) -> Option<&Arc<T>> {
        self.0.as_ref()?.as_ref().ok()
    }

    /// Calls `load` and stores its result. Does nothing if content or an error is stored already.
    pub fn resolve(&mut self, load: impl FnOnce() -> Result<Arc<T>, AssetError>) {
        self.0.get_or_insert_with(load);
    }

    /// Returns the error of reading the file as a validation error of the key `file`, which names
    /// the file in the scene description. Returns `None` if the file was read without error, or has
    /// not been read yet.
    pub fn fault(&self) -> Option<ValidationError> {
        let error = self.0.as_ref()?.as_ref().err()?;
        Some(ValidationError::new("file", error.what(), error.expected.clone()))
    }
}
