//! Validation errors of a description, without their position in a file.

use crate::value::{Field, FieldValue, number};

/// One error in a description. The module `scene` adds file, line, column and object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ValidationError {
    /// Dotted key inside the description (`center`, `shape.sphere.radius`); empty for the whole
    /// description.
    pub key: String,
    /// Phrase that states the error: `radius is -1`.
    pub found: String,
    /// Phrase that states the valid values: `a number greater than 0`.
    pub expected: String,
}

impl ValidationError {
    /// Creates an error from its three parts.
    pub fn new(key: &str, found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self { key: key.to_string(), found: found.into(), expected: expected.into() }
    }

    /// Returns the error with `outer` before its key. `outer` is the key that has the description
    /// as its value.
    pub fn prefixed(mut self, outer: &str) -> Self {
        self.key =
            if self.key.is_empty() { outer.to_string() } else { format!("{outer}.{}", self.key) };
        self
    }
}

/// Collector of the validation errors of one description, which is checked against its table of
/// fields.
#[derive(Debug)]
pub struct Validator {
    fields: &'static [Field],
    errors: Vec<ValidationError>,
}

impl Validator {
    /// Creates a validator without errors.
    pub fn new(fields: &'static [Field]) -> Self {
        Self { fields, errors: Vec::new() }
    }

    /// Checks the value of the key `name`.
    ///
    /// # Panics
    /// If the table has no such key.
    pub fn field(mut self, name: &str, value: &impl FieldValue) -> Self {
        let errors = value.errors(self.find(name));
        self.errors.extend(errors);
        self
    }

    fn find(&self, name: &str) -> &'static Field {
        let field = self.fields.iter().find(|field| field.name == name);
        field.unwrap_or_else(|| panic!("no field `{name}` in its table"))
    }

    /// Checks that no size or coordinate is more than 1e12 times as large as the smallest of
    /// `sizes`. Beyond that ratio, a coordinate has no digits left for the size. The check is
    /// skipped if there are errors already.
    pub fn ratio(mut self, sizes: &[(&str, f64)], coordinates: &[f64]) -> Self {
        let smallest = sizes.iter().copied().reduce(|a, b| if b.1 < a.1 { b } else { a });
        let largest = sizes
            .iter()
            .map(|s| s.1)
            .chain(coordinates.iter().map(|c| c.abs()))
            .fold(0.0, f64::max);
        if let Some((name, smallest)) = smallest
            && self.errors.is_empty()
            && largest > 1e12 * smallest
        {
            self.errors.push(ValidationError::new(
                name,
                format!(
                    "{name} is {}, too small beside {} in the same shape",
                    number(smallest),
                    number(largest)
                ),
                "sizes and coordinates within a factor of 1e12 of each other",
            ));
        }
        self
    }

    /// Adds `error` if there is one.
    pub fn and(mut self, error: Option<ValidationError>) -> Self {
        self.errors.extend(error);
        self
    }

    /// Adds the errors of the description that is the value of the key `outer`.
    pub fn nested(mut self, outer: &str, errors: Vec<ValidationError>) -> Self {
        self.errors.extend(errors.into_iter().map(|f| f.prefixed(outer)));
        self
    }

    /// Returns `true` if there are no errors so far.
    pub fn is_clean(&self) -> bool {
        self.errors.is_empty()
    }

    /// Returns the errors that were found.
    pub fn errors(self) -> Vec<ValidationError> {
        self.errors
    }
}
