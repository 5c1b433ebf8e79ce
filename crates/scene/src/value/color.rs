//! Linear RGB colours with the primaries of sRGB.

/// Linear RGB colour without an upper bound.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Color(pub [f64; 3]);

impl Color {
    /// Black: zero in every channel.
    pub const BLACK: Self = Self([0.0; 3]);
    /// White: one in every channel.
    pub const WHITE: Self = Self([1.0; 3]);

    /// Returns the colour with each channel multiplied by `s`.
    pub fn scaled(self, s: f64) -> Self {
        Self(self.0.map(|c| c * s))
    }

    /// Returns the largest of the three channels.
    pub fn largest(self) -> f64 {
        self.0.into_iter().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Parses an sRGB colour `#rrggbb`; `None` if `text` has another form.
    pub fn from_hex(text: &str) -> Option<Self> {
        let digits = text.strip_prefix('#')?;
        // All characters are checked here, because `from_str_radix` would also accept a sign.
        if digits.len() != 6 || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
            return None;
        }
        let rgb = u32::from_str_radix(digits, 16).ok()?;
        Some(Self([16, 8, 0].map(|shift| linear_from_srgb(f64::from(rgb >> shift & 255) / 255.0))))
    }

    /// Returns the `#rrggbb` that decodes to exactly this colour, if one exists.
    pub fn to_hex(self) -> Option<String> {
        let [r, g, b] = self.0.map(|channel| (srgb_from_linear(channel) * 255.0).round() as u8);
        let text = format!("#{r:02x}{g:02x}{b:02x}");
        (Self::from_hex(&text) == Some(self)).then_some(text)
    }
}

/// Converts linear light in 0..=1 to an sRGB level in 0..=1 (IEC 61966-2-1).
pub fn srgb_from_linear(linear: f64) -> f64 {
    if linear <= 0.0031308 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Converts an sRGB level (IEC 61966-2-1) from 0..1 to linear light in 0..1.
pub fn linear_from_srgb(level: f64) -> f64 {
    if level <= 0.04045 { level / 12.92 } else { ((level + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::Color;

    #[test]
    fn hex_colors_round_trip() {
        for code in ["#000000", "#ffffff", "#0a80fe", "#010b0c"] {
            let color = Color::from_hex(code).unwrap();
            assert_eq!(color.to_hex().as_deref(), Some(code));
        }
        assert_eq!(Color::from_hex("#ffffff"), Some(Color::WHITE));
        let half = Color::from_hex("#bcbcbc").unwrap().0[0];
        assert!((half - 0.502_886).abs() < 1e-6, "sRGB 188 is {half}");
        assert_eq!(Color([0.5, 0.5, 0.5]).to_hex(), None);
        assert_eq!(Color([2.0, 0.0, 0.0]).to_hex(), None);
        assert_eq!(Color([f64::NAN, 0.0, 0.0]).to_hex(), None);
    }

    #[test]
    fn malformed_hex_colors_are_rejected() {
        for text in ["", "#", "ffffff", "#fff", "#+12345", "#gggggg", "#ffffff0", "#ééé"] {
            assert_eq!(Color::from_hex(text), None, "{text}");
        }
    }
}
