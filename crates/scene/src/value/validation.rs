//! Validation errors of a table in a scene file, without their position in the file.

use crate::value::{Field, FieldValue, KeyNode, KeyValue, NumberRange, ValueType, number};

/// Validation error of a table, without file, line and object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ValidationError {
    /// Dotted key inside the table (`center`, `shape.sphere.radius`); empty for the whole table.
    pub key: String,
    /// Phrase that states the error: `radius is -1`.
    pub found: String,
    /// Phrase that states the valid values: `a number greater than 0`.
    pub expected: String,
}

impl ValidationError {
    /// Creates a validation error from key, error phrase and phrase of the valid values.
    pub fn new(key: &str, found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self { key: key.to_string(), found: found.into(), expected: expected.into() }
    }

    /// Returns the error with `outer.` before its key, unless one of the two is empty.
    pub fn prefixed(mut self, outer: &str) -> Self {
        let parts = [outer, &self.key].into_iter().filter(|part| !part.is_empty());
        self.key = parts.collect::<Vec<_>>().join(".");
        self
    }

    /// Returns the error with `outer.` before its key. Unless this key is in an inner table,
    /// `outer.` is also put before the phrase, as in `focus.distance is -1`.
    pub fn inside(mut self, outer: &str) -> Self {
        if !self.key.contains('.') {
            self.found = format!("{outer}.{}", self.found);
        }
        self.prefixed(outer)
    }
}

/// Collector of validation errors. It checks the values of one table of a scene file against the
/// ranges of the table's keys.
#[derive(Debug)]
pub struct Validator {
    fields: &'static [Field],
    errors: Vec<ValidationError>,
}

impl Validator {
    /// Creates a validator for a table with the keys `fields`. It holds no errors yet.
    pub fn new(fields: &'static [Field]) -> Self {
        Self { fields, errors: Vec::new() }
    }

    /// Checks `value`, the value of the key `name`, and collects its validation errors.
    ///
    /// # Panics
    /// Panics if the table has no such key.
    pub fn field(mut self, name: &str, value: &impl FieldValue) -> Self {
        let errors = value.errors(self.find(name));
        self.errors.extend(errors);
        self
    }

    fn find(&self, name: &str) -> &'static Field {
        let field = self.fields.iter().find(|field| field.name == name);
        field.unwrap_or_else(|| panic!("no field `{name}` in its table"))
    }

    /// Applies the check of [`Validator::ratio`] to the numbers of `table` with the range
    /// [`NumberRange::SIZE`] or [`NumberRange::COORDINATE`].
    pub fn lengths(self, table: &(impl KeyNode + ?Sized)) -> Self {
        let (mut sizes, mut coordinates) = (Vec::new(), Vec::new());
        for field in self.fields {
            let value = table.child(field.name).and_then(KeyNode::value);
            let (ValueType::Number(range) | ValueType::Numbers(_, range)) = field.takes else {
                continue;
            };
            let Some(KeyValue::Numbers(numbers)) = value else { continue };
            if range == NumberRange::SIZE {
                sizes.extend(numbers.into_iter().map(|size| (field.name, size)));
            } else if range == NumberRange::COORDINATE {
                coordinates.extend(numbers);
            }
        }
        self.ratio(&sizes, &coordinates)
    }

    /// Checks that no size or coordinate is more than 1e12 times as large as the smallest size.
    /// Beyond that ratio, double precision leaves less than four decimal digits for the smallest
    /// size. `sizes` holds the key and the value of each size. The check is skipped if earlier
    /// checks found errors.
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

    /// Adds the validation errors of `value`: a table whose keys stand directly in this table.
    pub fn flattened(mut self, value: &impl FieldValue) -> Self {
        self.errors.extend(value.errors(&Field::required("", ValueType::Text, "", "")));
        self
    }

    /// Adds the validation error `error` if there is one.
    pub fn and(mut self, error: Option<ValidationError>) -> Self {
        self.errors.extend(error);
        self
    }

    /// Adds `errors`, the validation errors of the nested table that is the value of the key
    /// `outer`.
    pub fn nested(mut self, outer: &str, errors: Vec<ValidationError>) -> Self {
        self.errors.extend(errors.into_iter().map(|f| f.prefixed(outer)));
        self
    }

    /// Returns `true` if no validation errors were found so far.
    pub fn is_clean(&self) -> bool {
        self.errors.is_empty()
    }

    /// Returns the validation errors that were found.
    pub fn errors(self) -> Vec<ValidationError> {
        self.errors
    }
}
