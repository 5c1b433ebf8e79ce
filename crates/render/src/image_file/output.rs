//! Output of picture files in the format of their extension.

use crate::film::Film;
use crate::film::file::FilmFileHeader;
use crate::image_file::{exr_writer, hdr_writer, png_writer};
use std::fs::File;
use std::io::{self, BufWriter, ErrorKind, Seek, SeekFrom, Write};
use std::path::PathBuf;
use zerkalo_scene::disk::{Existing, Replacement, WriteError, replace_file};

/// Number of bits per channel of a PNG file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Depth {
    #[default]
    Eight,
    Sixteen,
}

/// Source of a picture's rows: one film, or a film for each of several bands of rows, which are
/// rendered one after another while the file is written.
pub trait Bands {
    /// Returns the film that holds row `y`. Encoders request all rows, in increasing order.
    fn film_with_row(&mut self, y: usize) -> io::Result<&Film>;

    /// Returns the metadata as they are after the last row. `None` if they are those of the header.
    ///
    /// A value may differ from that of the header only if both have at most 128 bytes.
    fn final_metadata(&self) -> Option<Vec<(String, String)>> {
        None
    }
}

impl Bands for &Film {
    fn film_with_row(&mut self, _: usize) -> io::Result<&Film> {
        Ok(self)
    }
}

/// Picture file format with its encoder.
#[derive(Debug)]
struct Format {
    extension: &'static str,
    encode: fn(&FilmFileHeader, Depth, &mut dyn Bands, &mut dyn WriteSeek) -> io::Result<()>,
}

/// Formats that an extension chooses.
static FORMATS: [Format; 3] = [
    Format { extension: "png", encode: png_writer::encode },
    Format { extension: "exr", encode: exr_writer::encode },
    Format { extension: "hdr", encode: hdr_writer::encode },
];
/// Format that only [`ImageOutput::without_layers`] chooses.
static EXR_WITHOUT_LAYERS: Format =
    Format { extension: "exr", encode: exr_writer::encode_without_layers };

/// Path of a picture file to be written, with a known extension.
#[derive(Clone, Debug)]
pub struct ImageOutput {
    pub path: PathBuf,
    format: &'static Format,
    /// Decides if an existing file may be replaced; checked when the write begins and when it ends.
    pub existing: Existing,
}

impl ImageOutput {
    /// Creates an output for `path`, whose extension chooses the format. Accesses no file.
    pub fn from_path(path: impl Into<PathBuf>) -> Result<Self, WriteError> {
        let path = path.into();
        let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
        Self::of_format(path, &extension)
    }

    /// Creates an output for `path` in the format whose files have the given extension. Accesses no
    /// file.
    pub fn of_format(path: PathBuf, extension: &str) -> Result<Self, WriteError> {
        let is_known = |format: &&Format| extension.eq_ignore_ascii_case(format.extension);
        if let Some(format) = FORMATS.iter().find(is_known) {
            return Ok(Self { path, format, existing: Existing::Replace });
        }
        let what = match extension {
            "" => "its name has no extension that names the picture format".to_string(),
            extension => format!("no picture format has the extension .{extension}"),
        };
        let known = FORMATS.iter().map(|format| format!(".{}", format.extension));
        let remedy = format!("known extensions: {}", known.collect::<Vec<_>>().join(", "));
        Err(WriteError::new(&path, ErrorKind::InvalidFilename, what, &remedy))
    }

    /// Returns `true` if the format stores linear radiance.
    pub fn is_linear(&self) -> bool {
        self.format.extension != "png"
    }

    /// Leaves out all channels of an EXR file except those of the picture.
    pub fn without_layers(mut self) -> Self {
        if self.format.extension == "exr" {
            self.format = &EXR_WITHOUT_LAYERS;
        }
        self
    }

    /// Checks, before a long render, that the file can be written.
    pub fn check_writable(&self) -> Result<(), WriteError> {
        Replacement::begin(&self.path, self.existing).map(drop)
    }

    /// Writes the picture with its `header` row by row to a temporary file. This file replaces an
    /// old file when it is complete and stored on the disk. Only PNG files use `depth`.
    ///
    /// A key of the metadata has 1 to 79 printable ASCII characters without leading, trailing or
    /// double spaces. It begins with an upper-case letter, because the keys that OpenEXR itself
    /// defines begin with lower-case letters.
    ///
    /// Returns the file with its lock.
    pub fn write(
        &self,
        header: &FilmFileHeader,
        depth: Depth,
        bands: &mut dyn Bands,
    ) -> Result<File, WriteError> {
        replace_file(&self.path, self.existing, |file| {
            let mut out = BufWriter::with_capacity(1 << 16, file);
            (self.format.encode)(header, depth, bands, &mut out)?;
            out.flush()
        })
    }
}

/// Output that an encoder can write to and seek in.
pub(super) trait WriteSeek: Write + Seek {}
impl<T: Write + Seek> WriteSeek for T {}

/// Replaces `before`, the first bytes of a file, by `after`, then seeks to the end of the file.
///
/// # Errors
/// Fails if `before` and `after` have different lengths, or if the output cannot be written.
pub(super) fn replace_start(
    sink: &mut dyn WriteSeek,
    before: &[u8],
    after: &[u8],
) -> io::Result<()> {
    if before.len() != after.len() {
        return Err(io::Error::other("metadata of another length"));
    }
    sink.seek(SeekFrom::Start(0))?;
    sink.write_all(after)?;
    sink.seek(SeekFrom::End(0))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::testing::{fill, film, header};
    use crate::image_file::FileMetadata;
    use std::fs;
    use std::path::Path;

    #[test]
    fn extension_chooses_the_format() {
        for good in ["a.png", "A.PNG", "dir.x/b.Exr"] {
            assert_eq!(ImageOutput::from_path(good).unwrap().path, Path::new(good));
        }
        let error = ImageOutput::from_path("out.jpeg").unwrap_err().to_string();
        assert_eq!(
            error,
            "cannot write out.jpeg: no picture format has the extension .jpeg; \
             known extensions: .png, .exr, .hdr"
        );
        let error = ImageOutput::from_path("picture").unwrap_err().to_string();
        assert!(error.contains("has no extension") && error.contains(".png, .exr"), "{error}");
    }

    /// Returns the header of a picture of 40 x 20 pixels.
    fn picture(noise: &str) -> FilmFileHeader {
        FilmFileHeader { metadata: entries(noise), ..header(&film(40, 20, &[1.0])) }
    }

    #[test]
    fn failed_write_keeps_the_old_file_and_names_the_reason() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        fs::write(&path, "old").unwrap();
        let target = ImageOutput::from_path(&path).unwrap();
        let mut full = Failing(film(40, 20, &[1.0]), || ErrorKind::StorageFull.into());
        let error =
            target.write(&picture("unknown"), Depth::Eight, &mut full).unwrap_err().to_string();
        assert!(error.contains("no space is left"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn refusing_output_overwrites_no_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        let mut target = ImageOutput::from_path(&path).unwrap();
        target.existing = Existing::Refuse;
        let film = film(40, 20, &[1.0]);
        let write = |noise: &str| target.write(&picture(noise), Depth::Eight, &mut &film);
        write("new").unwrap();
        let error = write("newer").unwrap_err().to_string();
        assert!(error.contains("such a file already"), "{error}");
        assert_eq!(FileMetadata::read(&path).unwrap().get("Noise"), Some("new"));
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    /// Source of picture rows for tests. Its metadata change after the last row, like those of a
    /// render that runs while the file is written.
    struct Late<'a> {
        film: &'a Film,
        rows: usize,
    }

    fn entries(noise: &str) -> Vec<(String, String)> {
        [("Noise", noise), ("Source", "окно.toml")].map(|(k, v)| (k.into(), v.into())).to_vec()
    }

    impl Bands for Late<'_> {
        fn film_with_row(&mut self, y: usize) -> io::Result<&Film> {
            self.rows += 1;
            assert_eq!(y + 1, self.rows, "rows in increasing order");
            Ok(self.film)
        }

        fn final_metadata(&self) -> Option<Vec<(String, String)>> {
            assert_eq!(self.rows, self.film.header.height);
            Some(entries("0.5 8-bit levels"))
        }
    }

    #[test]
    fn metadata_that_are_known_last_replace_placeholders() {
        let mut film = film(40, 20, &[1.0]);
        fill(&mut film, 2, |x, y, _| vec![x as f64, y as f64, 1.0]);
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.png", "a.exr"] {
            let write = |noise: &str, bands: &mut dyn Bands| {
                let path = folder.path().join(name);
                let output = ImageOutput::from_path(&path).unwrap();
                output.write(&picture(noise), Depth::Eight, bands).unwrap();
                assert_eq!(
                    FileMetadata::read(&path).unwrap().get("Noise"),
                    Some("0.5 8-bit levels")
                );
                fs::read(path).unwrap()
            };
            let late = write("unknown", &mut Late { film: &film, rows: 0 });
            let known = write("0.5 8-bit levels", &mut &film);
            assert!(late == known, "{name}");
        }
    }

    /// Source of picture rows that fails after ten rows, as when a signal stops the render or the
    /// disk is full. The fields are the film and the function that creates the error.
    struct Failing(Film, fn() -> io::Error);

    impl Bands for Failing {
        fn film_with_row(&mut self, y: usize) -> io::Result<&Film> {
            if y < 10 { Ok(&self.0) } else { Err(self.1()) }
        }
    }

    #[test]
    fn failed_bands_leave_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.png", "a.exr"] {
            let path = folder.path().join(name);
            fs::write(&path, "old").unwrap();
            let output = ImageOutput::from_path(&path).unwrap();
            let mut stopped =
                Failing(film(40, 20, &[1.0]), || io::Error::other("stopped by a signal"));
            let error =
                output.write(&picture("unknown"), Depth::Sixteen, &mut stopped).unwrap_err();
            assert!(error.to_string().contains("stopped by a signal, and the old file"), "{error}");
            assert_eq!(fs::read(&path).unwrap(), b"old");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
