//! Metadata of picture files and film files.

use crate::film::file::{FilmFileHeader, FilmReader, is_film_file};
use crate::image_file::exr_reader::read_exr_meta;
use exr::meta::attribute::AttributeValue;
use png::Decoder;
use png::text_metadata::ITXtChunk;
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

/// Largest length of a compressed text in a PNG file that is read \[bytes\].
const TEXT_BYTES: usize = 64 << 10;

/// Returns the text of a chunk, or a note if it is too long or damaged.
fn text_of(mut chunk: ITXtChunk) -> String {
    let text = chunk.decompress_text_with_limit(TEXT_BYTES).and_then(|()| chunk.get_text());
    text.unwrap_or_else(|_| "(longer than 64 KB, or damaged)".to_string())
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
        decoder.set_ignore_iccp_chunk(true);
        if let Ok(info) = decoder.read_header_info() {
            let (width, height) = info.size();
            let reader = decoder.read_info().map_err(|e| format!("cannot read {shown}: {e}"))?;
            let info = reader.info();
            let latin = info.uncompressed_latin1_text.iter();
            let latin = latin.map(|chunk| (chunk.keyword.clone(), chunk.text.clone()));
            let utf8 = info.utf8_text.iter();
            let utf8 = utf8.map(|chunk| (chunk.keyword.clone(), text_of(chunk.clone())));
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that texts of up to `TEXT_BYTES` are read in full, and that a longer one, even in a
    /// short compressed chunk, is not inflated.
    #[test]
    fn long_texts_are_not_inflated() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let mut encoder = png::Encoder::new(std::fs::File::create(&path).unwrap(), 1, 1);
        let texts = [3, TEXT_BYTES, TEXT_BYTES + 1, 50 << 20].map(|length| "x".repeat(length));
        for (i, text) in texts[..3].iter().enumerate() {
            encoder.add_itxt_chunk(i.to_string(), text.clone()).unwrap();
        }
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[0]).unwrap();
        drop(writer);
        // The encoder compresses no texts.
        let entries = FileMetadata::read(&path).unwrap().entries;
        assert_eq!(entries.into_iter().map(|(_, text)| text).collect::<Vec<_>>(), texts[..3]);
        let note = "(longer than 64 KB, or damaged)";
        for (text, shown) in texts.iter().zip([&*texts[0], &*texts[1], note, note]) {
            let mut chunk = ITXtChunk::new("a", text.as_str());
            chunk.compress_text().unwrap();
            assert_eq!(text_of(chunk), shown);
        }
    }
}
