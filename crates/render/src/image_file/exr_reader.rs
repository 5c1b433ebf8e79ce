//! OpenEXR reader for reference pictures.

use crate::image_file::check_pixels;
use exr::io::Tracking;
use exr::meta::header::Header;
use exr::prelude::*;
use std::io::BufReader;
use std::path::Path;
use zerkalo_scene::disk::open_regular;

/// Picture from an OpenEXR file.
pub struct ReadPicture {
    /// Width and height of the picture in pixels.
    pub size: [usize; 2],
    /// Pixels in linear radiance, `[row][column]`.
    pub pixels: Vec<[f64; 3]>,
    /// Pictures of the replicates A and B. `None` if the file lacks these channels.
    pub replicates: Option<[Vec<[f64; 3]>; 2]>,
}

/// Reads the headers of an OpenEXR file.
pub(super) fn read_exr_meta(path: &Path) -> Result<MetaData> {
    MetaData::read_from_buffered(Tracking::new(BufReader::new(open_regular(path)?)), false)
}

/// Reads the channels `R`, `G` and `B` of an OpenEXR file, and those of the replicates, `A.R` to
/// `B.B`, if they exist.
pub fn read_exr(path: &Path) -> std::result::Result<ReadPicture, String> {
    let meta = read_exr_meta(path).map_err(|e| e.to_string())?;
    let largest = meta.headers.iter().map(|h| h.layer_size.area()).max().unwrap_or(0);
    // Samples of all channels, and up to three pictures in double precision.
    let bytes = |h: &Header| h.layer_size.area() as u64 * (72 + 12 * h.channels.list.len() as u64);
    let needed = meta.headers.iter().map(bytes).max().unwrap_or(0);
    check_pixels(largest as u64, needed)?;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(BufReader::new(open_regular(path).map_err(|e| e.to_string())?))
        .map_err(|e| e.to_string())?;
    let layer = &image.layer_data;
    let size = [layer.size.width(), layer.size.height()];
    let channel = |name: &str| {
        let all = &layer.channel_data.list;
        let found = all.iter().find(|channel| channel.name.to_string() == name)?;
        Some(found.sample_data.values_as_f32().map(f64::from).collect::<Vec<_>>())
    };
    let picture = |prefix: &str| {
        let [r, g, b] = ["R", "G", "B"].map(|color| channel(&format!("{prefix}{color}")));
        let (r, g, b) = (r?, g?, b?);
        Some(r.iter().zip(&g).zip(&b).map(|((r, g), b)| [*r, *g, *b]).collect::<Vec<_>>())
    };
    let pixels = picture("").ok_or("it has no channels R, G and B")?;
    let replicates = picture("A.").zip(picture("B.")).map(|(a, b)| [a, b]);
    let bad = pixels.iter().flatten().filter(|x| !x.is_finite()).count();
    if bad > 0 {
        return Err(format!("{bad} of its values are infinite or no numbers"));
    }
    Ok(ReadPicture { size, pixels, replicates })
}
