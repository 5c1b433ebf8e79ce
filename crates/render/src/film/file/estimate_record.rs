//! Encoding of the error estimates of tiles in film files.

use crate::film::file::decode::Fields;
use crate::film::{ByMeasure, Captures, Class, TileNoise};

/// Appends the record of `noise` to `out`.
pub(crate) fn encode(noise: &TileNoise, out: &mut Vec<u8>) {
    let TileNoise { reported, allocation, squares, captures, sliver, pixels, samples } = *noise;
    for ByMeasure { linear, levels } in [reported, allocation, squares] {
        [linear, levels].iter().for_each(|value| out.extend(value.to_le_bytes()));
    }
    for class in captures.iter().flat_map(|captures| captures.0) {
        let Class { once, twice, excess, contrast } = class;
        [once, twice, excess, contrast].iter().for_each(|n| out.extend(n.to_le_bytes()));
    }
    out.extend(sliver.to_le_bytes());
    [pixels, samples].iter().for_each(|count| out.extend(count.to_le_bytes()));
}

/// Decodes a record. Returns `None` if it is invalid. Errors of extreme pictures are infinite or
/// NaN, but not negative.
pub(crate) fn decode(fields: &mut Fields) -> Option<TileNoise> {
    let mut error = || fields.f64().filter(|value| value.is_nan() || *value >= 0.0);
    let mut pair = || Some(ByMeasure { linear: error()?, levels: error()? });
    let [reported, allocation, squares] = [pair()?, pair()?, pair()?];
    let mut number = || fields.u32().map(f32::from_bits).filter(|n| n.is_nan() || *n >= 0.0);
    let mut captures = [Captures::default(); 2];
    for class in captures.iter_mut().flat_map(|captures| &mut captures.0) {
        let [once, twice] = [number()?, number()?];
        *class = Class { once, twice, excess: number()?, contrast: number()? };
    }
    let sliver = number()?;
    let (pixels, samples) = (fields.u32()?, fields.u32().filter(|samples| *samples > 0)?);
    Some(TileNoise { reported, allocation, squares, captures, sliver, pixels, samples })
}
