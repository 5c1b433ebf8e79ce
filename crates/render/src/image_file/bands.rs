//! Sources of the rows of a picture file.

use crate::film::Film;
use std::io;

/// Source of a picture's rows: one film, or a film for each of several bands of rows, which are
/// rendered one after another while the file is written.
pub trait Bands {
    /// Returns the film that holds row `y`. Encoders request all rows, in increasing order.
    fn film_with_row(&mut self, y: usize) -> io::Result<&Film>;

    /// Returns the metadata after the last row; `None` if they are those of the header.
    ///
    /// A value such as the noise may differ from that of the header if it has at most 128 bytes.
    fn final_metadata(&self) -> Option<Vec<(String, String)>> {
        None
    }
}

impl Bands for &Film {
    fn film_with_row(&mut self, _: usize) -> io::Result<&Film> {
        Ok(self)
    }
}
