//! Input of the picture encoders (PNG and OpenEXR) except for the samples.

use crate::film::display::Display;
use crate::film::light_weights::LightWeights;
use std::io::{Seek, Write};

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
