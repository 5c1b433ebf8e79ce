//! Bit depth and output of the encoders.

use std::io::{self, Seek, SeekFrom, Write};

/// Number of bits per channel of a PNG file.
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

/// Replaces `before`, the first bytes of a file, by `after`, then seeks to its end.
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
