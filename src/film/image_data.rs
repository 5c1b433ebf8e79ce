//! Input of the picture encoders.

use crate::film::display::Display;
use crate::film::light_weights::LightWeights;
use crate::film::store::Film;
use std::io::{Seek, Write};

/// Contents of a picture file.
#[derive(Clone, Copy, Debug)]
pub struct ImageData<'a> {
    /// The samples.
    pub film: &'a Film,
    /// Colour and strength of the light groups.
    pub mix: &'a LightWeights,
    /// Name of each light group, for formats with layers.
    pub group_names: &'a [String],
    /// Exposure and tone curve, for formats that hold display values.
    pub display: Display,
    /// Bits per channel, for formats that hold display values.
    pub depth: Depth,
    /// Metadata keys and values. A key has 1 to 79 printable ASCII characters without leading, trailing
    /// or double spaces and starts with a capital (OpenEXR's own keys start small).
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

/// Destination of an encoder.
pub(super) trait WriteSeek: Write + Seek {}
impl<T: Write + Seek> WriteSeek for T {}
