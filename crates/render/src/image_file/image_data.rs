//! Input of the picture encoders (PNG and OpenEXR) except for the samples.

use crate::film::Display;
use crate::film::LightWeights;
use std::io::{self, Seek, SeekFrom, Write};

/// Size and settings of a picture file without its samples, which come from
/// [`Bands`](crate::image_file::Bands).
#[derive(Clone, Copy, Debug)]
pub struct ImageData<'a> {
    /// Width and height of the image in pixels.
    pub size: [u32; 2],
    /// Weight of each light group (lights with sums of their own in the film): colour times
    /// intensity.
    pub mix: &'a LightWeights,
    /// Name of each light group, for file formats with layers of channels (OpenEXR).
    pub group_names: &'a [String],
    /// Exposure and tone curve, for file formats with displayed values (PNG).
    pub display: Display,
    /// Bits per channel, for file formats with displayed values (PNG).
    pub depth: Depth,
}

/// Number of bits per channel of a picture file with display values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Depth {
    /// 8 bits per channel: 256 levels.
    #[default]
    Eight,
    /// 16 bits per channel: 65 536 levels.
    Sixteen,
}

/// Output that an encoder can write to and seek in.
pub(super) trait WriteSeek: Write + Seek {}
impl<T: Write + Seek> WriteSeek for T {}

/// Replaces the first bytes of a file by `after`, then seeks to the end of the file. `before` must
/// be the bytes with which the file begins.
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
