//! Metadata of picture files and film files.

use crate::film::file::{FilmFileHeader, FilmReader, is_film_file};
use crate::image_file::exr_reader::read_exr_meta;
use exr::meta::attribute::AttributeValue;
use png::Decoder;
use std::io::BufReader;
use std::path::Path;
use zerkalo_scene::disk::open_regular;

/// Metadata values are padded to a multiple of this number of bytes.
const PADDED: usize = 128;

/// Pads a metadata value with spaces. At the end of a render, the final noise and sample counts
/// overwrite the values of the same padded length that were written at its start.
pub(super) fn padded(value: &str) -> String {
    let len = value.len().next_multiple_of(PADDED).max(PADDED);
    format!("{value}{}", " ".repeat(len - value.len()))
}

/// Removes the padding of a metadata entry.
fn unpadded((key, value): (String, String)) -> (String, String) {
    (key, value.trim_end_matches(' ').to_string())
}

/// Metadata of a picture file (PNG, OpenEXR) or film file.
#[derive(Clone, Debug)]
pub struct FileMetadata {
    /// Name of the file's format: `PNG`, `OpenEXR`, `film` or `plan`.
    pub format: &'static str,
    /// Width and height of the picture in pixels.
    pub size: [usize; 2],
    /// Keys and values in the order of the file; sorted in OpenEXR files.
    pub entries: Vec<(String, String)>,
    /// Header of a film file; `None` for other files.
    pub film: Option<FilmFileHeader>,
}

impl FileMetadata {
    /// Reads the metadata of a file, and verifies the checksums of a film file.
    pub fn read(path: &Path) -> Result<Self, String> {
        if is_film_file(path) {
            let header = FilmReader::open(path).and_then(FilmReader::verify);
            let header = header.map_err(|error| error.to_string())?;
            return Ok(Self {
                format: "film",
                size: [header.film.width, header.film.height],
                entries: header.metadata.clone(),
                film: Some(header),
            });
        }
        let shown = path.display();
        let file = open_regular(path).map_err(|error| format!("cannot read {shown}: {error}"))?;
        let mut decoder = Decoder::new(BufReader::new(file));
        if let Ok(info) = decoder.read_header_info() {
            let (width, height) = info.size();
            let reader = decoder.read_info().map_err(|e| format!("cannot read {shown}: {e}"))?;
            let info = reader.info();
            let latin = info.uncompressed_latin1_text.iter();
            let latin = latin.map(|chunk| (chunk.keyword.clone(), chunk.text.clone()));
            let utf8 = info.utf8_text.iter();
            let utf8 =
                utf8.filter_map(|chunk| Some((chunk.keyword.clone(), chunk.get_text().ok()?)));
            return Ok(Self {
                format: "PNG",
                size: [width as usize, height as usize],
                entries: latin.chain(utf8).map(unpadded).collect(),
                film: None,
            });
        }
        let meta = read_exr_meta(path)
            .map_err(|_| format!("cannot read {shown}: it is no PNG, OpenEXR or film file"))?;
        let header = meta.headers.first().ok_or(format!("{shown} has no picture"))?;
        let text = |value: &AttributeValue| match value {
            AttributeValue::Text(text) => Some(text.to_string()),
            _ => None,
        };
        let all = header.own_attributes.other.iter();
        let mut entries: Vec<_> = all
            .filter_map(|(key, value)| Some(unpadded((key.to_string(), text(value)?))))
            .collect();
        entries.sort_unstable();
        let size = [header.layer_size.width(), header.layer_size.height()];
        Ok(Self { format: "OpenEXR", size, entries, film: None })
    }

    /// Returns the value of the entry `key`.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.entries.iter().find(|(k, _)| k == key).map(|(_, value)| value.as_str())
    }
}
