//! Input of the picture encoders (PNG and OpenEXR) except for the samples.

use crate::film::display::Display;
use crate::film::light_weights::LightWeights;
use std::io::{self, Seek, SeekFrom, Write};

/// Size and settings of a picture file without its samples, which come from
/// [`Bands`](crate::film::Bands).
#[derive(Clone, Copy, Debug)]
pub struct ImageData<'a> {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Weight of each light group: colour times intensity.
    pub mix: &'a LightWeights,
    /// Name of each light group, for formats with layers.
    pub group_names: &'a [String],
    /// Exposure and tone curve, for formats that hold display values.
    pub display: Display,
    /// Bits per channel, for formats that hold display values.
    pub depth: Depth,
}

/// Bits per channel of a picture file with display values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Depth {
    /// 8 bits: 256 levels.
    #[default]
    Eight,
    /// 16 bits: 65 536 levels.
    Sixteen,
}

/// Output that an encoder can write to and seek in.
pub(super) trait WriteSeek: Write + Seek {}
impl<T: Write + Seek> WriteSeek for T {}

/// Replaces `before`, the first bytes of a file, by `after`, then seeks to the end of the file.
///
/// # Errors
/// Fails if the lengths differ, or the output cannot be written.
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
