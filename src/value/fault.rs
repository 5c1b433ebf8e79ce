//! What is wrong with a value, before anybody knows where in the file it stands.

/// One thing wrong in a description. The scene room adds file, line, column and object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The key inside the description, dotted (`center`, `shape.sphere.radius`); empty: the whole.
    pub key: String,
    /// What was found, as a phrase: `radius is -1`.
    pub found: String,
    /// What would be right, as a phrase: `a number greater than 0`.
    pub expected: String,
}

impl Fault {
    /// From its three parts.
    pub fn new(key: &str, found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self { key: key.to_string(), found: found.into(), expected: expected.into() }
    }
}
