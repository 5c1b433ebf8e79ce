//! Input of the picture encoders (PNG and OpenEXR).

use crate::film::display::Display;
use crate::film::light_weights::LightWeights;
use crate::film::store::Film;
use std::io::{Seek, Write};

/// Contents of a picture file.
#[derive(Clone, Copy, Debug)]
pub struct ImageData<'a> {
    /// Film that holds the samples.
    pub film: &'a Film,
    /// Weight of each light group: colour times intensity.
    pub mix: &'a LightWeights,
    /// Name of each light group, used by formats with layers.
    pub group_names: &'a [String],
    /// Exposure and tone curve, used by formats that hold display values.
    pub display: Display,
    /// Bits per channel, used by formats that hold display values.
    pub depth: Depth,
    /// Metadata keys and values. A key has 1 to 79 printable ASCII characters, without leading,
    /// trailing or double spaces. It starts with a capital letter, because OpenEXR's own keys start
    /// with a small one.
    pub metadata: &'a [(String, String)],
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
