//! From radiance to the numbers of a picture file: exposure, tone curve, sRGB.

use std::fmt;
use std::str::FromStr;

/// What is done with light that is brighter than the display's white.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Tone {
    /// Each channel stops at 1.
    #[default]
    Clip,
    /// The Khronos PBR Neutral tone mapper (KHR specification of 2024): keeps hues and all but the
    /// brightest fifth of the range, up to a small constant in the dark, and compresses the rest.
    Neutral,
}

impl Tone {
    /// Every tone curve and its name.
    pub const NAMED: [(&'static str, Self); 2] = [("clip", Self::Clip), ("neutral", Self::Neutral)];
}

impl fmt::Display for Tone {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let named = Self::NAMED.iter().find(|(_, tone)| tone == self);
        f.write_str(named.map_or("", |(name, _)| name))
    }
}

impl FromStr for Tone {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let named = Self::NAMED.iter().find(|(name, _)| *name == text);
        named.map(|(_, tone)| *tone).ok_or_else(|| {
            let names: Vec<_> = Self::NAMED.iter().map(|(name, _)| *name).collect();
            format!("tone curve `{text}` is not known; known: {}", names.join(", "))
        })
    }
}

/// How radiance becomes a picture.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Display {
    /// Radiance is multiplied by 2 to the power of this.
    pub exposure_ev: f64,
    /// What follows the exposure.
    pub tone: Tone,
}

impl Display {
    /// Radiance to sRGB codes, 0..=255, not rounded.
    pub fn codes(&self, radiance: [f64; 3]) -> [f64; 3] {
        self.shown(radiance).map(|c| 255.0 * srgb_from_linear(c))
    }

    /// Radiance to linear light of the display, 0..=1.
    pub fn shown(&self, radiance: [f64; 3]) -> [f64; 3] {
        toned(self.tone, radiance.map(|c| c * self.exposure_factor()))
    }

    /// What the exposure multiplies radiance with.
    pub fn exposure_factor(&self) -> f64 {
        self.exposure_ev.exp2()
    }
}

/// Applies a tone curve; the result lies in 0..=1.
#[inline(always)]
pub(super) fn toned(tone: Tone, color: [f64; 3]) -> [f64; 3] {
    match tone {
        Tone::Clip => color.map(|c| c.clamp(0.0, 1.0)),
        Tone::Neutral => neutral(color).map(|c| c.clamp(0.0, 1.0)),
    }
}

/// Khronos PBR Neutral, as published.
#[inline(always)]
fn neutral(color: [f64; 3]) -> [f64; 3] {
    const F90: f64 = 0.04;
    const START: f64 = 0.8 - F90;
    const DESATURATION: f64 = 0.15;
    let least = color[0].min(color[1]).min(color[2]);
    let offset = if least < 2.0 * F90 { least - least * least / (4.0 * F90) } else { F90 };
    let color = color.map(|c| c - offset);
    let peak = color[0].max(color[1]).max(color[2]);
    if peak < START {
        return color;
    }
    let room = 1.0 - START;
    let new_peak = 1.0 - room * room / (peak + room - START);
    let to_white = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    color.map(|c| c * (new_peak / peak)).map(|c| c + (new_peak - c) * to_white)
}

/// Linear light 0..=1 to sRGB code 0..=1 (IEC 61966-2-1, piecewise).
pub(super) fn srgb_from_linear(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// A code 0..=255 to the nearest of 8 bits.
pub fn quantised_8(code: f64) -> u8 {
    code.round() as u8
}

/// A code 0..=255 to the nearest of 16 bits, 65535 for 255.
pub fn quantised_16(code: f64) -> u16 {
    (code * (65535.0 / 255.0)).round() as u16
}
