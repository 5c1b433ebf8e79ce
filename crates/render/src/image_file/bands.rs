//! Source of the samples of a picture file: one film, or one film for each band of rows.

use crate::film::Film;
use std::io;

/// Source of a picture's samples. A picture that does not fit into memory is rendered in bands of
/// rows, one after another, while the file is written.
pub trait Bands {
    /// Returns the film that holds row `y` of the picture. Row 0 of this film is the row
    /// [`Film::first_row`] of the picture. Encoders request all rows, in increasing order.
    ///
    /// # Errors
    /// Fails if the rows cannot be rendered.
    fn film_with_row(&mut self, y: usize) -> io::Result<&Film>;

    /// Returns the metadata of the picture as pairs of a key and a value.
    ///
    /// A value that is known only after the last row, such as the noise, may change until the last
    /// row has been rendered. Such a value has at most 128 bytes. A key has 1 to 79 printable ASCII
    /// characters, without leading, trailing or double spaces. Its first letter is upper-case,
    /// because the keys that OpenEXR itself defines start with a lower-case letter.
    fn metadata(&self) -> Vec<(String, String)>;
}

/// Film that holds the whole picture, as a source of its rows.
#[derive(Clone, Copy, Debug)]
pub struct WholeFilm<'a> {
    /// Film of the whole picture.
    pub film: &'a Film,
    /// Metadata keys and values, see [`Bands::metadata`].
    pub metadata: &'a [(String, String)],
}

impl Bands for WholeFilm<'_> {
    fn film_with_row(&mut self, _: usize) -> io::Result<&Film> {
        Ok(self.film)
    }

    fn metadata(&self) -> Vec<(String, String)> {
        self.metadata.to_vec()
    }
}
