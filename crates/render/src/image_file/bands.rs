//! Sources of the rows of a picture file.

use crate::film::Film;
use std::io;

/// Source of a picture's rows: one film, or a film for each of several bands of rows, which are
/// rendered one after another while the file is written.
pub trait Bands {
    /// Returns the film that holds row `y`. Encoders request all rows, in increasing order.
    fn film_with_row(&mut self, y: usize) -> io::Result<&Film>;

    /// Returns the metadata as pairs of key and value.
    ///
    /// A value such as the noise may change until the last row has been rendered, if it has at most
    /// 128 bytes. A key has 1 to 79 printable ASCII characters without leading, trailing or double
    /// spaces. It begins with an upper-case letter, because the keys of OpenEXR itself do not.
    fn metadata(&self) -> Vec<(String, String)>;
}

/// Row source of a picture whose film fits into memory.
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
