//! Linear colours with red, green and blue.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::fmt;

/// Linear red, green, blue; no upper bound. In files `[r, g, b]` (linear) or `"#rrggbb"` (sRGB).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Color(pub [f64; 3]);

impl Color {
    /// No light.
    pub const BLACK: Self = Self([0.0; 3]);
    /// One in every channel.
    pub const WHITE: Self = Self([1.0; 3]);

    /// Each channel times `s`.
    pub fn scaled(self, s: f64) -> Self {
        Self(self.0.map(|c| c * s))
    }
}

/// sRGB (IEC 61966-2-1) code 0..1 to linear light 0..1.
fn linear_from_srgb(code: f64) -> f64 {
    if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

impl Serialize for Color {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

struct ColorVisitor;

impl<'de> de::Visitor<'de> for ColorVisitor {
    type Value = Color;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a linear colour [r, g, b] or a string \"#rrggbb\"")
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Color, E> {
        let wrong = || E::invalid_value(de::Unexpected::Str(text), &self);
        let digits = text.strip_prefix('#').filter(|d| d.len() == 6).ok_or_else(wrong)?;
        let code = u32::from_str_radix(digits, 16).map_err(|_| wrong())?;
        Ok(Color([16, 8, 0].map(|shift| linear_from_srgb(f64::from(code >> shift & 255) / 255.0))))
    }

    fn visit_seq<A: de::SeqAccess<'de>>(self, mut seq: A) -> Result<Color, A::Error> {
        let mut rgb = [0.0; 3];
        for (i, channel) in rgb.iter_mut().enumerate() {
            *channel = seq.next_element()?.ok_or_else(|| de::Error::invalid_length(i, &self))?;
        }
        match seq.next_element::<de::IgnoredAny>()? {
            None => Ok(Color(rgb)),
            Some(_) => Err(de::Error::invalid_length(4, &self)),
        }
    }
}

impl<'de> Deserialize<'de> for Color {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ColorVisitor)
    }
}
